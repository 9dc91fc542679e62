#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""mutate.py RTL_FOLDER OUT_FOLDER [--file FILE]: a copy of the RTL in which input bug_i of tc_top chooses one of all mutants, or
of those of one file; 0 none. OUT_FOLDER/mutants.tsv lists them: number, file, line, `reset` or `logic`, kind, change, text; tabs
between. Their numbers are the same with and without --file.

Sites are the conditions of `if` and the right-hand sides of assignments in the modules (packages pass unchanged: bug_i can not be
seen from there), reset branches included; assertions, code for proofs, parameters and port connections are left alone. One more,
an identity, stands behind the last: it must survive.
A mutant reads no signal that the code did not read there, so none closes a combinational loop.
"""
import argparse
import collections
import pathlib
import re
import sys

import variants

Site = collections.namedtuple("Site", "file start end line branch lhs clocked width1 expression")
Mutant = collections.namedtuple("Mutant", "site kind change broken")  # broken None: the assignment is dropped

LITERAL = re.compile(r"\b(\d+)'(s?)([bdh])([0-9A-Fa-f_]+)\b")
BOUNDARY = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
FUNCTION = re.compile(r"\bfunction automatic [^;]*?(\w+)\([^;]*;.*?\bendfunction\b", re.DOTALL)
RESET = re.compile(r"\bif \(!rst_ni\)(?: begin\b.*?\bend else\b|[^;]*;)", re.DOTALL)
GENERATE_IF = re.compile(r"\bif \([^\n]*\) begin :")
STEP = re.compile(
    r"(?P<word>\b(?:if|for|case)\b\s*(?=\())|(?P<lhs>\b[A-Za-z_]\w*(?:\.\w+)*(?:\[[^\]=;]*\])*)\s*(?P<op><=|=)(?!=)\s*")


def closing(text: str, at: int) -> int:
    """Place of the bracket that closes the one at `at`."""
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] in "([{") - (text[i] in ")]}")
        if depth == 0:
            return i
    raise ValueError("unbalanced brackets")


def blank(text: str, start: int, end: int) -> str:
    return text[:start] + re.sub(r"[^\n]", " ", text[start:end]) + text[end:]


def code_only(text: str) -> str:
    """The text with everything that is no site blanked out, places kept."""
    for pattern in (r"//[^\n]*", r"\(\*.*?\*\)", r"\blocalparam\b[^;]*;", r"\btypedef enum\b[^;]*;", r"\bparameter\b[^\n]*"):
        for found in list(re.finditer(pattern, text, re.S)):
            text = blank(text, *found.span())
    # Only what a build without any macro sees; `ifndef SYNTHESIS holds assertions alone.
    stack, keep, kept = [], True, []
    for line in text.splitlines(keepends=True):
        word = line.split()[0] if line.split() else ""
        if word in ("`ifdef", "`ifndef"):
            stack.append(keep)
            keep = keep and word == "`ifndef" and line.split()[1] != "SYNTHESIS"
        elif word == "`else":
            keep = stack[-1]
        elif word == "`endif":
            keep = stack.pop()
        kept.append(line if keep and not word.startswith("`") or word.startswith("`TC_") and keep else re.sub(r"[^\n]", " ", line))
    text = "".join(kept)
    for found in list(re.finditer(r"`TC_\w+\(", text)):
        text = blank(text, found.start(), closing(text, found.end() - 1) + 1)
    for found in list(re.finditer(r"\btc_\w+ (?:#\([^;]*?\) )?u_\w+ \([^;]*;", text)):  # instances: port connections
        text = blank(text, *found.span())
    return text


def one_bit_names(code: str) -> set[str]:
    names = set()
    for kind, rest in re.findall(r"\blogic\s+((?:signed\s+)?(?:\[[^\]]*\])?)\s*([^;()\n]*)", code):
        if not kind.strip():
            names.update(re.findall(r"[A-Za-z_]\w*", re.sub(r"\[[^\]]*\]", "", rest)))
    return names


def is_one_bit(lhs: str, code: str, scalars: set[str]) -> bool:
    select = re.search(r"\[([^\]]*)\]$", lhs)
    if not select:
        return lhs in scalars
    array = re.search(rf"\b{re.escape(lhs.split('[')[0])} \[", code)  # declared with a space before its size
    return ":" not in select.group(1) and not array


def without_constants(code: str, text: str) -> str:
    """Blanks in place of what is worked out while the chip is put together, where bug_i can not be seen: functions that a localparam
    calls, with those that they call, and the conditions of generate blocks."""
    bodies = {match[1]: match for match in FUNCTION.finditer(code)}
    constant = set(re.findall(r"\b(\w+)\(", " ".join(re.findall(r"\blocalparam\b[^;]*;", text)))) & bodies.keys()
    while further := {name for name in bodies for caller in constant if f"{name}(" in bodies[caller][0]} - constant:
        constant |= further
    spans = [bodies[name].span() for name in constant] + [match.span() for match in GENERATE_IF.finditer(code)]
    for start, end in spans:
        code = code[:start] + re.sub(r"\S", " ", code[start:end]) + code[end:]
    return code


def sites(name: str, text: str) -> list[Site]:
    code = code_only(text)
    scalars = one_bit_names(code)
    code = without_constants(code, text)
    resets = [match.span() for match in RESET.finditer(code)]
    found, at = [], 0
    while match := STEP.search(code, at):
        line = text.count("\n", 0, match.start()) + 1
        branch = "reset" if any(a <= match.start() < b for a, b in resets) else "logic"
        if word := match.group("word"):
            end = closing(code, match.end())
            if word.strip() == "if":
                found.append(Site(name, match.end() + 1, end, line, branch, None, False, True, code[match.end() + 1:end]))
            at = end + 1
            continue
        end = code.index(";", match.end())
        lhs = match.group("lhs")
        clocked = match.group("op") == "<="
        start = match.start() if clocked else match.end()
        found.append(Site(name, start, end, line, branch, lhs, clocked, is_one_bit(lhs, code, scalars), code[match.end():end]))
        at = end + 1
    return found


def split(text: str, start: int, end: int, separator: str) -> list[tuple[int, int]]:
    """Spans of what stands between the separators outside brackets."""
    spans, depth, begin, i = [], 0, start, start
    while i < end:
        depth += (text[i] in "([{") - (text[i] in ")]}")
        if depth == 0 and text.startswith(separator, i):
            spans.append((begin, i))
            begin = i = i + len(separator)
        else:
            i += 1
    return spans + [(begin, end)]


def conditions(text: str, start: int, end: int) -> list[tuple[int, int]]:
    """Spans of the conditions of ?: outside brackets."""
    pieces = split(text, start, end, "?")
    return [(split(text, *piece, " : ")[-1]) for piece in pieces[:-1]]


def operand_drops(text: str, start: int, end: int):
    """(operand, text without it) for every operand of && and ||, inside brackets too."""
    for span in conditions(text, start, end):
        yield from operand_drops(text, *span)
    if len(split(text, start, end, "?")) > 1:
        return
    for operator in ("||", "&&"):
        parts = split(text, start, end, operator)
        if len(parts) == 1:
            continue
        for i, (a, b) in enumerate(parts):
            cut = (a - 2, b) if i else (a, parts[1][0])
            yield text[a:b], text[:cut[0]] + " " + text[cut[1]:]
            yield from operand_drops(text, a, b)
        return
    inner = re.match(r"\s*!?\(", text[start:end])
    if inner and text[closing(text, start + inner.end() - 1) + 1:end].strip() == "":
        yield from operand_drops(text, start + inner.end(), closing(text, start + inner.end() - 1))


def around(text: str, start: int, end: int) -> tuple[int, int]:
    """Where the operands of the comparison at start:end begin and end."""
    text = text.replace("::", "__")
    left, right, depth = start, end, 0
    while left > 0:
        depth += (text[left - 1] in ")]}") - (text[left - 1] in "([{")
        if depth < 0 or depth == 0 and text[left - 1] in "?:,&|^":
            break
        left -= 1
    depth = 0
    while right < len(text):
        depth += (text[right] in "([{") - (text[right] in ")]}")
        if depth < 0 or depth == 0 and text[right] in "?:,&|^":
            break
        right += 1
    return left, right


def literal_plus_one(found: re.Match) -> str:
    width, sign, base, digits = int(found[1]), found[2], found[3], found[4].replace("_", "")
    value = (int(digits, {"b": 2, "d": 10, "h": 16}[base]) + 1) % 2**width
    return f"{width}'{sign}" + {"b": f"b{value:b}", "d": f"d{value}", "h": f"h{value:X}"}[base]


def condition_mutants(site: Site, start: int, end: int, what: str) -> list[Mutant]:
    text = site.expression
    condition = text[start:end].strip()
    broken = [("negated", f"!({condition})"), ("stuck at 1", "1'b1"), ("stuck at 0", "1'b0")]
    return [Mutant(site, f"{what} {kind}", f"{condition} -> {new}", f"{text[:start]} ({new}) {text[end:]}") for kind, new in broken]


def mutants(site: Site) -> list[Mutant]:
    text = site.expression
    constant = LITERAL.fullmatch(text.strip()) or re.fullmatch(r"'0|[A-Z]\w*|\w+::[A-Z]\w*", text.strip())
    found = []
    if site.lhs is None:
        found += condition_mutants(site, 0, len(text), "condition")
    else:
        if site.clocked:
            found.append(Mutant(site, "assignment dropped", f"{site.lhs} keeps its value", None))
        if site.width1 and not constant:
            found += condition_mutants(site, 0, len(text), "value")
        elif site.width1:
            found.append(Mutant(site, "value negated", f"!({text.strip()})", f"({text}) ^ 2'sd1"))
        else:
            found.append(Mutant(site, "lowest bit flipped", site.lhs, f"({text}) ^ 2'sd1"))
            found.append(Mutant(site, "middle bit flipped", site.lhs, f"({text}) ^ (2'sd1 <<< ($bits({site.lhs}) / 2))"))
            found.append(Mutant(site, "highest bit flipped", site.lhs, f"({text}) ^ (2'sd1 <<< ($bits({site.lhs}) - 1))"))
    for span in conditions(text, 0, len(text)):
        found += condition_mutants(site, *span, "condition")
    for operand, rest in operand_drops(text, 0, len(text)):
        found.append(Mutant(site, "operand dropped", f"without {operand.strip()}", rest))
    for operator in re.finditer(r"(?<= )(&&|\|\|)(?= )", text):
        new = {"&&": "||", "||": "&&"}[operator[0]]
        found.append(Mutant(site, "&& and || exchanged", f"{operator[0]} -> {new}", text[:operator.start()] + new + text[operator.end():]))
    for literal in [] if constant else LITERAL.finditer(text):
        new = literal_plus_one(literal)
        found.append(Mutant(site, "literal + 1", f"{literal[0]} -> {new}", text[:literal.start()] + new + text[literal.end():]))
    for operator in re.finditer(r"(?<= )(<=?|>=?|[=!]=)(?= )", text):
        new = BOUNDARY[operator[0]]
        found.append(Mutant(site, "comparison moved", f"{operator[0]} -> {new}", text[:operator.start()] + new + text[operator.end():]))
        left, right = around(text, *operator.span())
        a, b = text[left:operator.start()], text[operator.end():right]
        for what, shift in ("lowest", ">>> 1"), ("highest", "<<< 1"):
            short = f" (({a.strip()}) {shift}) {operator[0]} (({b.strip()}) {shift}) "
            found.append(Mutant(site, f"{what} bit not compared", f"{a.strip()} {operator[0]} {b.strip()}", text[:left] + short + text[right:]))
    for operator in re.finditer(r"(?<= )[+-](?= )", text):
        new = {"+": "-", "-": "+"}[operator[0]]
        found.append(Mutant(site, "+ and - swapped", f"{operator[0]} -> {new}", text[:operator.start()] + new + text[operator.end():]))
    return found


def put_in(text: str, site: Site, numbered: list[tuple[int, Mutant]]) -> str:
    """The file's text with these mutants of one site."""
    expression = site.expression
    for number, mutant in numbered:
        if mutant.broken is not None:
            expression = variants.choose(number, mutant.broken, expression)
    if not site.clocked:
        return text[:site.start] + expression + text[site.end:]
    statement = f"{site.lhs} <= {expression};"
    for number, mutant in numbered:
        if mutant.broken is None:
            statement = variants.omit(number, statement)
    return text[:site.start] + statement + text[site.end + 1:]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("rtl", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--file")
    wanted = parser.parse_args()
    text = variants.read(wanted.rtl)
    places = [site for name in text if name.endswith(".sv") and not name.endswith("_pkg.sv") for site in sites(name, text[name])]
    chosen = [mutant for site in places for mutant in mutants(site)]
    pin = next(site for site in places if site.lhs == "heater_o" and site.file == "tc_top.sv")
    chosen.append(Mutant(pin, "identity", "control", pin.expression))

    rows = []
    at_site = collections.defaultdict(list)
    for number, mutant in enumerate(chosen, 1):
        at_site[mutant.site].append((number, mutant))
        line = text[mutant.site.file].splitlines()[mutant.site.line - 1].strip()
        rows.append([str(number), mutant.site.file, str(mutant.site.line), mutant.site.branch, mutant.kind, " ".join(mutant.change.split()), line])
    if wanted.file:
        identity = len(chosen)
        at_site = {site: [one for one in own if one[0] == identity or site.file == wanted.file] for site, own in at_site.items()}
        rows = [row for row in rows if row[1] == wanted.file or row[0] == str(identity)]
    for site in sorted(at_site, key=lambda s: -s.start):  # from behind: the places before stay true
        text[site.file] = put_in(text[site.file], site, at_site[site])
    variants.write(text, wanted.out)
    (wanted.out / "mutants.tsv").write_text("".join("\t".join(row) + "\n" for row in rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
