#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Manual pages, shell completion and a page of all commands, made from what the programs say of themselves.

reference.py OUT VERSION PROGRAM... : asks each program with --describe (app/help_text.hpp) and writes into OUT
  man/meltstage.1.gz, man/meltstage-VERB.1.gz   manual pages
  meltstage.bash                          completion for bash
  commands.md                             every command with its options
"""
import gzip
import json
import pathlib
import subprocess
import sys


def described(programs: list[str]) -> dict[str, dict]:
    """Commands by what is typed: "dft grade"."""
    commands = {}
    for program in programs:
        for command in json.loads(subprocess.run([program, "--describe"], check=True, capture_output=True).stdout):
            commands.setdefault(command["command"], command)
    return dict(sorted(commands.items()))


def synopsis(command: dict) -> str:
    words = ["meltstage", command["command"]]
    for option in command["options"]:
        if option["required"]:
            words.append(f"{option['names'][-1]} {option['value']}")
    if any(not option["required"] for option in command["options"] if "--help" not in option["names"]):
        words.append("[OPTIONS]")
    for argument in command["arguments"]:
        word = argument["name"] + ("..." if argument["value"].endswith("...") else "")
        words.append(word if argument["required"] else f"[{word}]")
    return " ".join(words)


def parts_of(command: dict) -> list[tuple[str, str]]:
    """Each argument and option: how it is given, what it is."""
    rows = [(argument["name"], argument) for argument in command["arguments"]]
    rows += [(", ".join(option["names"]) + (f" {option['value']}" if option["value"] else ""), option)
             for option in command["options"]]
    return [(given, part["summary"] + (f"; {part['range']}" if part["range"] else "") + (" (required)" if part["required"] else ""))
            for given, part in rows]


def roff(text: str) -> str:
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("`", "\\(ga").replace("'", "\\(aq")
    return "\\&" + text if text.startswith(".") else text


def leaves(commands: dict[str, dict], verb: str) -> list[dict]:
    under = [c for name, c in commands.items() if name.startswith(verb + " ")]
    return under or [commands[verb]]


def manual_page(commands: dict[str, dict], verb: str, version: str) -> str:
    top = commands[verb]
    lines = [f'.TH MELTSTAGE\\-{roff(verb.upper())} 1 "" "Meltstage {version}" "Meltstage"', ".SH NAME",
             f"meltstage\\-{roff(verb)} \\- {roff(top['summary'])}", ".SH SYNOPSIS"]
    for command in leaves(commands, verb):
        lines += [".B " + roff(synopsis(command)), ".br"]
    lines.append(".SH OPTIONS")
    for command in leaves(commands, verb):
        lines += [".SS meltstage " + roff(command["command"]), roff(command["summary"]) + "."]
        for given, what in parts_of(command):
            lines += [".TP", ".B " + roff(given), roff(what)]
    lines += [".SH EXAMPLES", ".nf"]
    lines += [roff(command["example"]) for command in leaves(commands, verb)]
    lines += [".fi", *exit_status(), ".SH SEE ALSO", "meltstage(1)"]
    return "\n".join(lines) + "\n"


def exit_status() -> list[str]:
    return [".SH EXIT STATUS", ".TP", ".B 0", "All went well.", ".TP", ".B 1", "The job's own verdict is bad.", ".TP", ".B 2",
            "The input or the call is wrong; one line on standard error says what, where, and what was expected."]


def top_page(commands: dict[str, dict], version: str) -> str:
    lines = [f'.TH MELTSTAGE 1 "" "Meltstage {version}" "Meltstage"', ".SH NAME",
             "meltstage \\- electronics and motion of a print head", ".SH SYNOPSIS", ".B meltstage VERB", "[OPTIONS]", ".SH DESCRIPTION",
             "A temperature\\-controller chip in SystemVerilog and in bit\\-accurate C++, the bench around both, and the motion of the stage "
             "that carries the head.", ".SH VERBS"]
    for verb in verbs_of(commands):
        lines += [".TP", f".B {roff(verb)}", f"{roff(commands[verb]['summary'])}; meltstage\\-{roff(verb)}(1)."]
    lines += exit_status()
    return "\n".join(lines) + "\n"


def verbs_of(commands: dict[str, dict]) -> list[str]:
    return [name for name in commands if " " not in name]


def completion(commands: dict[str, dict]) -> str:
    """Words that may follow, by the command and by the option that wants a value; files where neither says."""
    values, words = [], []
    for name, command in commands.items():
        below = [other.rsplit(" ", 1)[1] for other in commands if " " in other and other.rsplit(" ", 1)[0] == name]
        options = [given for option in command["options"] for given in option["names"] if given.startswith("--")]
        words.append(f'      "{name}") words="{" ".join(below + options)}" ;;')
        for option in command["options"]:
            choices = option["value"].replace("|", " ") if "|" in option["value"] else ""
            if option["value"]:
                values += [f'    "{name} {given}") words="{choices}" ;;' for given in option["names"]]
    typed = [f'      "{name if " " in name else " " + name}") command="{name}" ;;' for name in commands]
    return "\n".join(["# bash completion of meltstage", "_meltstage() {",
                      '  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command="" words="" each',
                      '  for each in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do', '    case "$command $each" in', *typed, "    esac", "  done",
                      '  case "$command $before" in', *values, '    *) case "$command" in',
                      f'      "") words="{" ".join(verbs_of(commands))} --help --version" ;;', *words, "    esac ;;", "  esac",
                      '  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")', "}", "complete -o default -F _meltstage meltstage", ""])


def page(commands: dict[str, dict]) -> str:
    lines = ["# Every command and its options", ""]
    for name, command in commands.items():
        if not command["example"]:
            continue
        lines += [f"## `meltstage {name}`", "", command["summary"] + ".", "", "```text", synopsis(command),
                  command["example"], "```", "", "| | |", "|---|---|"]
        lines += [f"| `{given.replace('|', chr(92) + '|')}` | {what.replace('|', chr(92) + '|')} |" for given, what in parts_of(command)]
        lines.append("")
    return "\n".join(lines)


def main() -> None:
    out, version, *programs = sys.argv[1:]
    commands = described(programs)
    man = pathlib.Path(out, "man")
    man.mkdir(parents=True, exist_ok=True)
    pages = {"meltstage": top_page(commands, version)}
    pages |= {f"meltstage-{verb}": manual_page(commands, verb, version) for verb in verbs_of(commands)}
    for name, text in pages.items():
        (man / f"{name}.1.gz").write_bytes(gzip.compress(text.encode(), 9, mtime=0))
    pathlib.Path(out, "meltstage.bash").write_text(completion(commands))
    pathlib.Path(out, "commands.md").write_text(page(commands))


if __name__ == "__main__":
    main()
