#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the fenced blocks of README.md and docs/.

    blocks.py list [--long]                           pages, a line each (for CMake); --long: those that have long blocks
    blocks.py programs FOLDER                         writes every C++ program, prints "FILE|LIBRARIES" (for CMake)
    blocks.py run PAGE --build BUILD [--long]         runs the page's commands and reads its other blocks; --long: also those
                                                      that ./check full alone runs
    blocks.py not-run                                 the blocks that are long or only parsed, each with the reason

A fence says what it holds, then perhaps the name of the file to write it to, or to add it to: ```sh, ```toml my_job.toml,
```toml >> spec/registers.toml. A diff is applied to the folder, to the letter (patch -p1). The commands of a page run one block after the other in one temporary folder, which holds besides those files only what markers bring.
There, `meltstage` and `./run` are the command that was built, and build/release is the build folder.

A marker is an HTML comment just above the fence:
    not run: REASON             needs root, hardware, a person, or much time. Commands are parsed, their options looked up
    long: REASON                takes more than some seconds: parsed, and run by ./check full
    with: PATH [as NAME], ...   copies files or folders of the repository into the folder first; "." is all of it
    links: LIBRARY ...          CMake targets that a C++ program is linked with
    left running                a server: the next block begins when it has printed a line
    after Ctrl-C                ends the servers that were left running first, as a person would
    prints                      a text block: exactly what the commands above print
"""

import argparse
import json
import os
import pathlib
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import tomllib

from pages import ROOT, Piece, all_pages, pieces

SECONDS_AT_MOST = 900
COMPILER_CACHE = "/usr/lib/ccache"  # Debian's: g++ found there compiles what it has not compiled before
RUN = ("sh",)
READ = ("toml", "json", "python", "c", "cpp", "cmake", "systemverilog", "ini", "diff", "text", "mermaid")
TOOL = r"(?:[A-Z_]+=\S+ )*(?:meltstage|\./run|\./check|make|cmake|ctest|git|g\+\+|python3)(?: |$)"
TOOL_COMMAND = re.compile(r"\s*(?:\$ )?" + TOOL)
COMMAND = re.compile(rf"\s*(?:{TOOL}|[\w.-]+/[\w./-]+(?: |$))")


# Verbs of ./run that build something and say where it is; the command knows nothing of them.
RUN_BUILDS = re.findall(r"^  ([a-z]+)\)$", (ROOT / "run").read_text(encoding="utf-8"), re.M)


class Fault(Exception):
    """What is wrong with a block; the caller adds the place."""


def name_of(page: pathlib.Path) -> str:
    """The page's path in the repository."""
    return str(page.relative_to(ROOT))


def blocks(page: pathlib.Path) -> list[Piece]:
    """The page's fenced blocks."""
    return [piece for piece in pieces(page.read_text(encoding="utf-8")) if piece.kind == "fence"]


def language(block: Piece) -> str:
    """First word behind the fence, "" when there is none."""
    return (block.info.split() or [""])[0]


def file_name(block: Piece) -> str:
    """Second word behind the fence: the file that the block is written to, "" when there is none."""
    return " ".join(block.info.split()[1:])


def marker(block: Piece, key: str) -> str | None:
    """What stands behind `key:` in the comments above the block; "" for a bare `key`, None without it."""
    for comment in re.findall(r"<!--(.*?)-->", block.remark, re.S):
        text = " ".join(comment.split())
        if text == key:
            return ""
        if text.startswith(key + ":"):
            return text[len(key) + 1 :].strip()
    return None


def program_name(page: pathlib.Path, block: Piece) -> str:
    """Name of the executable that is built of a C++ program."""
    places = [each.line for each in blocks(page) if language(each) == "cpp"]
    return f"{name_of(page).removesuffix('.md').replace('/', '_')}_{places.index(block.line) + 1}"


def content(block: Piece) -> str:
    """The block's text, as a file would hold it."""
    return "\n".join(block.lines) + "\n"


OF_RUN = {("./run", "python"), ("./run", "--build")}  # the script's own, not verbs of the command


class Help:
    """What `meltstage ... --help` knows; each page of help is asked for once."""

    def __init__(self, meltstage: pathlib.Path):
        self.meltstage = meltstage
        self.seen: dict[tuple[str, ...], str] = {}

    def text(self, verbs: tuple[str, ...]) -> str:
        if verbs not in self.seen:
            asked = subprocess.run([self.meltstage, *verbs, "--help"], capture_output=True, text=True, check=False)
            if asked.returncode != 0:
                raise Fault(f"meltstage {' '.join(verbs)} --help exits {asked.returncode}: {asked.stderr.strip()}")
            self.seen[verbs] = asked.stdout
        return self.seen[verbs]

    def check(self, words: list[str]) -> None:
        """Raises Fault if a verb or option of `meltstage WORDS` does not exist. What ./run builds by itself takes nothing more."""
        if len(words) == 1 and words[0] in RUN_BUILDS:
            return
        verbs: tuple[str, ...] = ()
        for word in words:
            known = re.search(r"Subcommands:\n(.*)", self.text(verbs), re.S)
            names = re.findall(r"^  (\S+)", known.group(1), re.M) if known else []
            if not names or word.startswith("-"):
                break
            if word not in names:
                raise Fault(f"meltstage {' '.join((*verbs, word))}: no such verb")
            verbs += (word,)
        for word in words:
            option = re.match(r"--[a-z][a-z0-9-]*", word)
            if option and not re.search(re.escape(option.group()) + r"(?![a-z0-9-])", self.text(verbs)):
                raise Fault(f"meltstage {' '.join(verbs)}: no option {option.group()}")


def simple_commands(script: str) -> list[list[str]]:
    """The words of each simple command that begins a line or stands behind a pipe, && or ; in it."""
    found = []
    for line in script.replace("\\\n", " ").splitlines():
        if not COMMAND.match(line):
            continue  # perhaps the text of a file
        lexer = shlex.shlex(line, posix=True, punctuation_chars="|&;<>()")
        lexer.whitespace_split = True
        words: list[str] = []
        for word in [*lexer, ";"]:
            if set(word) <= set("|&;"):
                found.append(words)
                words = []
            else:
                words.append(word)
    return [words for words in found if words]


def check_commands(script: str, known: Help, folder: pathlib.Path) -> None:
    """Raises Fault for a verb, an option, a script of the repository or a name of tests that does not exist."""
    for words in simple_commands(script):
        while words and re.match(r"[A-Z_]+=", words[0]):
            words = words[1:]
        if not words:
            continue
        if tuple(words[:2]) in OF_RUN:
            continue
        if words[0] in ("meltstage", "./run"):
            known.check(words[1:])
        elif words[0] == "ctest" and "-R" in words:
            listed = subprocess.run([*words, "-N"], cwd=folder, capture_output=True, text=True, check=False).stdout
            if not re.search(r"Total Tests: [1-9]", listed):
                raise Fault(f"{' '.join(words)}: no such test")
        elif "/" in words[0] and not re.match(r"/|~|\.|\$|build/", words[0]) and not any((there / words[0]).exists() for there in (ROOT, folder)):
            raise Fault(f"{words[0]}: no such file")


def check_spans(page: pathlib.Path, known: Help) -> list[str]:
    """Faults of the commands that stand between single backquotes in text and tables."""
    found = []
    for piece in pieces(page.read_text(encoding="utf-8")):
        if piece.kind == "fence":
            continue
        text = "\n".join(piece.lines)
        for span in re.finditer(r"`((?:meltstage|\./run) [^`]+)`", text):
            line = piece.line + text.count("\n", 0, span.start())
            words = span.group(1).replace("\\|", "|").split()
            if tuple(words[:2]) in OF_RUN:
                continue
            words = words[1:]
            words = [re.split(r"[|=]", word.strip("[]"))[0] for word in words]
            verbs = []
            for word in words:  # stops at what stands for a name: JOB.toml, NAME, ...
                if re.match(r"-|[a-z][a-z-]*$", word):
                    verbs.append(word)
            try:
                known.check(verbs)
            except Fault as fault:
                found.append(f"{name_of(page)}:{line}: {fault}")
    return found


class Folder:
    """The temporary folder in which the commands of one page run."""

    def __init__(self, path: pathlib.Path, build: pathlib.Path):
        self.path = path
        self.build = build
        self.started: list[subprocess.Popen] = []
        self.last_output = ""
        (path / "build").mkdir()
        (path / "build/release").symlink_to(build)
        # ./run installs, builds and hands its arguments on; installed and built is all when tests run
        stand_in = path / "run"
        stand_in.write_text(
            '#!/bin/bash\n[ "$1" != python ] || PYTHONPATH=build/release/python exec /usr/bin/python3 -B "${@:2}"\nexec meltstage "$@"\n'
        )
        stand_in.chmod(0o755)
        self.environment = {**os.environ, "PATH": f"{build / 'app'}:{COMPILER_CACHE}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8"}

    def bring(self, what: str) -> None:
        """Copies the files and folders of a `with` marker."""
        for entry in what.split(","):
            source, _, name = entry.strip().partition(" as ")
            if source == ".":
                not_copied = [each.strip("/") for each in (ROOT / ".gitignore").read_text(encoding="utf-8").split()]
                shutil.copytree(ROOT, self.path, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".git", "run", *not_copied))
                continue
            there = self.path / (name or source)
            there.parent.mkdir(parents=True, exist_ok=True)
            if not (ROOT / source).exists():
                raise Fault(f"marker names {source}: no such file")
            if (ROOT / source).is_dir():
                shutil.copytree(ROOT / source, there, dirs_exist_ok=True)
            else:
                shutil.copy(ROOT / source, there)

    def write(self, name: str, text: str) -> None:
        """Writes a file, or adds to it when the name begins with >>."""
        there = self.path / name.removeprefix(">>").strip()
        if name.startswith(">>") and not there.exists():
            raise Fault(f"{there.relative_to(self.path)}: no such file to add to")
        there.parent.mkdir(parents=True, exist_ok=True)
        with there.open("a" if name.startswith(">>") else "w", encoding="utf-8") as file:
            file.write(text)

    def run(self, block: Piece, command: list[str], entered: str = "") -> None:
        """Runs a block's commands or program to the end; `entered` is what it gets to read."""
        process = subprocess.Popen(
            command,
            cwd=self.path,
            env=self.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self.started.append(process)
        if marker(block, "left running") is not None:
            self.wait_for_line(process)
            return
        try:
            output, errors = process.communicate(entered, timeout=SECONDS_AT_MOST)
        except subprocess.TimeoutExpired:
            raise Fault(f"still running after {SECONDS_AT_MOST} s") from None
        self.last_output = output
        if process.returncode != 0:
            raise Fault(f"exit status {process.returncode}\n{output[-2000:]}{errors[-2000:]}")

    def wait_for_line(self, process: subprocess.Popen) -> None:
        """Waits until a server has printed its first line, on either stream."""
        ready = threading.Event()

        def read(stream) -> None:
            for _ in stream:
                ready.set()

        for stream in (process.stdout, process.stderr):
            threading.Thread(target=read, args=(stream,), daemon=True).start()
        if not ready.wait(20):
            raise Fault("left running, but printed nothing in 20 s")
        if process.poll() is not None:
            raise Fault(f"left running, but ended with exit status {process.returncode}")

    def stop(self) -> None:
        """Ends what still runs."""
        for process in self.started:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGINT)
                process.wait(20)


def treat(page: pathlib.Path, block: Piece, folder: Folder, known: Help, long: bool) -> str:
    """Runs or reads one block; returns what was done with it, in a word. Raises Fault."""
    kind = language(block)
    if kind not in RUN + READ:
        raise Fault(f'the fence says "{block.info}", expected one of {", ".join(RUN + READ)}')
    reason = marker(block, "not run")
    if not long and reason is None:
        reason = marker(block, "long")
    if reason == "":
        raise Fault("not run, but no reason is given")
    if marker(block, "after Ctrl-C") is not None:
        folder.stop()
    bring = marker(block, "with")
    if bring is not None:
        folder.bring(bring)
    if kind == "sh":
        parsed = subprocess.run(["bash", "-n"], input=content(block), capture_output=True, text=True, check=False)
        if parsed.returncode != 0:
            raise Fault(f"not a script: {parsed.stderr.strip()}")
        check_commands(content(block), known, folder.path)
        if reason:
            return "parsed"
        folder.run(block, ["bash", "-c", "set -euo pipefail\n" + content(block)])
        return "run"
    if kind == "diff":
        folder.run(block, ["patch", "-p1", "--fuzz=0"], content(block))
    elif file_name(block):
        folder.write(file_name(block), content(block))
    if kind == "toml":
        tomllib.loads(content(block))
    elif kind == "json":
        json.loads(content(block))
    elif kind == "python":
        compile(content(block), "block", "exec")
    elif kind == "text" and marker(block, "prints") is not None and content(block) != folder.last_output:
        raise Fault(f"the commands above print this instead:\n{folder.last_output}")
    elif kind == "text" and any(TOOL_COMMAND.match(line) for line in block.lines):
        raise Fault("commands in a text block: make it sh")
    elif kind == "cpp" and not file_name(block) and not reason:
        program = folder.build / "tests/docs" / program_name(page, block)
        if not program.exists():
            raise Fault(f"{program} is not built")
        folder.run(block, [str(program)])
        return "run"
    return "read"


def run_page(page: pathlib.Path, build: pathlib.Path, long: bool) -> int:
    """Runs and reads every block of a page; prints a line a block and a line a fault."""
    known = Help(build / "app/meltstage")
    faults = check_spans(page, known)
    with tempfile.TemporaryDirectory(prefix="meltstage_page_") as path:
        folder = Folder(pathlib.Path(path), build)
        try:
            for block in blocks(page):
                before = processor_seconds()
                try:
                    done = treat(page, block, folder, known, long)
                    print(f"{name_of(page)}:{block.line}: {language(block)} {done}, {processor_seconds() - before:.1f} s")
                except (Fault, ValueError, SyntaxError) as fault:
                    faults.append(f"{name_of(page)}:{block.line}: {fault}")
        finally:
            folder.stop()
    for fault in faults:
        print(fault)
    return 1 if faults else 0


def processor_seconds() -> float:
    """Processor time of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def programs(into: pathlib.Path) -> int:
    """Writes each complete C++ program to a file of its own and prints its name and libraries."""
    into.mkdir(parents=True, exist_ok=True)
    for page in all_pages():
        for block in blocks(page):
            if language(block) != "cpp" or file_name(block) or marker(block, "not run") is not None:
                continue
            there = into / f"{program_name(page, block)}.cpp"
            if not there.exists() or there.read_text(encoding="utf-8") != content(block):
                there.write_text(content(block), encoding="utf-8")
            print(f"{there}|{' '.join((marker(block, 'links') or '').split())}")
    return 0


def not_run() -> int:
    """Prints the blocks that ./check does not run, with their reasons."""
    long = parsed = total = 0
    for page in all_pages():
        for block in blocks(page):
            if language(block) in ("sh", "cpp"):
                total += 1
                place = f"{name_of(page)}:{block.line}"
                if (reason := marker(block, "long")) is not None:
                    long += 1
                    print(f"{place}: ./check full: {reason}")
                if (reason := marker(block, "not run")) is not None:
                    parsed += 1
                    print(f"{place}: not run: {reason}")
    print(f"{total} blocks of commands and programs: ./check runs {total - long - parsed}, ./check full {long} more, {parsed} are parsed")
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    verbs.add_parser("list").add_argument("--long", action="store_true")
    verbs.add_parser("not-run")
    verbs.add_parser("programs").add_argument("folder", type=pathlib.Path)
    run = verbs.add_parser("run")
    run.add_argument("page", type=pathlib.Path)
    run.add_argument("--build", type=pathlib.Path, required=True)
    run.add_argument("--long", action="store_true")
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that what was started is ended
    if arguments.verb == "list":
        for page in all_pages():
            if not arguments.long or any(marker(block, "long") is not None for block in blocks(page)):
                print(name_of(page))
        return 0
    if arguments.verb == "not-run":
        return not_run()
    if arguments.verb == "programs":
        return programs(arguments.folder)
    return run_page(arguments.page.resolve(), arguments.build.resolve(), arguments.long)


if __name__ == "__main__":
    sys.exit(main())
