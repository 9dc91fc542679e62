#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The machine-made part of docs/verify/properties.md: every assertion of the RTL, its proof, its antecedent, the bug that refutes it.

  report.py TABLE   writes it from what prove.sh --table has found (report.sh calls this)
  report.py --check the page lists exactly the assertions of the RTL, each said and claimed for where the RTL and the harnesses say so;
                    every part of P1-P18 is proved, covered and refuted, or listed as not proved. Proves nothing itself.
Exit status: 0 well, 1 the page is stale or lacks something.
"""
import collections
import fnmatch
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "verify" / "properties.md"
BEGIN, END = "<!-- made by tests/proofs/formal/report.sh: begin -->", "<!-- end -->"
PROPERTIES = {
    1: "reset turns the heater off, and it stays off till a Run command",
    2: "a cause of a fault turns the heater off till a keyed clear",
    3: "the heater is on only in RUN, without a fault, below T_MAX",
    4: "no accepted sample for SAMPLE_TIMEOUT is a fault",
    5: "an accepted sample at or above T_MAX turns the heater off",
    6: "a host that is silent for HOST_WD turns the heater off",
    7: "no PWM period is on for longer than DUTY_MAX, without DITHER",
    8: "the heater is low before a period's end, unless the duty is 100 %",
    9: "a sound STOP frame turns the heater off in every state",
    10: "no frame that is damaged or for another slave changes a register",
    11: "the loop sees one set of parameters a tick",
    12: "no sum or product of the loop wraps, and the duty stays in its limits",
    13: "a broadcast is never answered",
    14: "no answer starts before 3.5 characters of silence",
    15: "whatever comes on UART or SPI, the state machine is back in time",
    16: "an illegal state becomes Idle and turns the heater off",
    17: "the first fault since the clear is kept",
    18: "a rise without heat opens the second switch",
}

Assertion = collections.namedtuple("Assertion", "name file says property conditional step")  # step: for proofs alone


def assertions():
    """Assertions of the RTL in the order of file and line, with the last comment above each since a blank line."""
    found = []
    for path in sorted((ROOT / "rtl").rglob("tc_*.sv"), key=lambda path: path.name):
        comment, used, inside, macros = [], False, False, []
        for line in path.read_text().splitlines():
            text = line.strip()
            if text.startswith("`if"):
                macros.append(text.split()[1])
            elif text.startswith("`endif"):
                macros.pop()
            labelled = re.match(r"`TC_ASSERT(_IF|_NEXT|_RESET)?\((\w+)", text) or re.match(r"()(\w+_A): assert", text)
            if text.startswith("//"):
                comment, used = (comment if inside else []) + [text[2:].strip()], False
            elif labelled:
                said = not used or labelled[2].startswith("P")   # one comment may stand above several parts of a property
                says = " ".join(c for c in comment if said and not c.startswith("----"))
                number_of = re.match(r"P(\d\d)_", labelled[2]) or re.match(r"P(\d+)[:,]", says)
                found.append(Assertion(labelled[2], path.name, re.sub(r"^P\d+(, P\d+)*: ", "", says),
                                       int(number_of[1]) if number_of else 0, labelled[1] in ("_IF", "_NEXT"), "FORMAL" in macros))
                used = True
            elif not text:
                comment = []
            inside = text.startswith("//")
    return found


def read_table(path):
    proofs, covers, bugs = {}, {}, {}
    for line in pathlib.Path(path).read_text().splitlines():
        kind, *rest = line.split("\t")
        if kind == "proof":
            harness, engine, seconds, name = rest
            proofs.setdefault(name, []).append((harness, engine, float(seconds)))
        elif kind == "cover":
            harness, clock, name = rest
            covers.setdefault(name, clock)
        elif kind == "bug":
            block, name, clock, what = rest
            bugs.setdefault(name, (block, clock, what))
    return proofs, covers, bugs


def table(rows, proofs, covers, bugs):
    lines = ["| assertion | says | in | proved in | engine, CPU s of that harness | antecedent reached in clock | refuted by |",
             "|---|---|---|---|---|---|---|"]
    for a in rows:
        proof = list(dict.fromkeys(proofs.get(a.name, [])))  # of several instances in a harness once
        lines.append("| {} | {} | {} | {} | {} | {} | {} |".format(
            a.name, a.says.replace("|", "\\|"), a.file, "<br>".join(p[0] for p in proof) or "**not proved**",
            "<br>".join(f"{p[1]}, {p[2]:.1f}" for p in proof) or "-",
            covers.get(a.name + "_C", "**not reached**") if a.conditional else "always",
            f"{bugs[a.name][2]} ({bugs[a.name][0]}, clock {bugs[a.name][1]})" if a.name in bugs else "step of a proof" if a.step else "-"))
    return lines


def write(path):
    found, (proofs, covers, bugs) = assertions(), read_table(path)
    lines = [BEGIN, ""]
    for number, title in PROPERTIES.items():
        lines += [f"### P{number}: {title}", ""] + table([a for a in found if a.property == number], proofs, covers, bugs) + [""]
    lines += ["### Other assertions of the blocks", ""] + table([a for a in found if not a.property], proofs, covers, bugs) + [""]
    missing = [a.name for a in found if a.name not in proofs]
    lines += ["### Not proved", ""] + ([f"- {name}" for name in missing] or ["Nothing of the above."]) + ["", END]
    page = PAGE.read_text()
    page = page[:page.index(BEGIN)] + "\n".join(lines) + page[page.index(END) + len(END):]
    part = PAGE.with_suffix(".part")
    part.write_text(page)
    part.replace(PAGE)
    print(f"{PAGE.relative_to(ROOT)}: {len(found)} assertions, {len(found) - len(missing)} proved")


def check():
    page = PAGE.read_text()
    made = page[page.index(BEGIN):page.index(END)]
    split = [re.split(r"(?<!\\)\|", line) for line in made.splitlines() if line.startswith("| ")]
    rows = {row[1].strip(): row for row in split if row[1].strip() != "assertion"}
    found, wrong = assertions(), []
    names = [a.name for a in found]
    wrong += [f"{name}: twice in rtl/" for name, n in collections.Counter(names).items() if n > 1]
    wrong += [f"{name}: in rtl/, not on the page" for name in names if name not in rows]
    wrong += [f"{name}: on the page, not in rtl/" for name in rows if name not in names]
    not_proved = re.findall(r"^- (\w+)$", made, re.M)
    asked = [(harness, re.findall(r"\S+", words)) for harness in sorted((ROOT / "tests" / "proofs" / "formal").glob("*/*.sv"))
             for words in re.findall(r"^// prove: *(.*)$", harness.read_text(), re.M)]
    for a in found:
        row = rows.get(a.name)
        if row is None:
            continue
        _, _, says, file, proved, _, reached, refuted, _ = (cell.strip() for cell in row)
        if says.replace("\\|", "|") != a.says or file != a.file:
            wrong.append(f"{a.name}: the page says something else than rtl/{a.file}")
        if (proved == "**not proved**") != (a.name in not_proved):
            wrong.append(f"{a.name}: proved or not? The table and the list 'Not proved' differ")
        for harness in proved.replace("**not proved**", "").split("<br>"):
            path = ROOT / "tests" / "proofs" / "formal" / f"{harness}.sv"
            if harness and not path.exists():
                wrong.append(f"{a.name}: proved in tests/proofs/formal/{harness}.sv, which isn't there")
            lists = [names for h, names in asked if h == path]
            if lists and not any(fnmatch.fnmatchcase(a.name, name) for names in lists for name in names):
                wrong.append(f"{a.name}: no longer asked for in tests/proofs/formal/{harness}.sv")
        if a.property and a.name not in not_proved and reached == "**not reached**":
            wrong.append(f"{a.name}: its antecedent has not been reached")
        if re.match(r"P\d\d_", a.name) and not a.step and a.name not in not_proved and refuted == "-":
            wrong.append(f"{a.name}: no seeded bug refutes it")
    wrong += [f"P{number}: no heading '### P{number}: {title}'" for number, title in PROPERTIES.items() if f"\n### P{number}: {title}\n" not in made]
    wrong += [f"P{number}: no assertion" for number in PROPERTIES if not any(a.property == number for a in found)]
    for line in wrong:
        print(f"report.py: docs/verify/properties.md: {line}; run tests/proofs/formal/report.sh", file=sys.stderr)
    print(f"docs/verify/properties.md: {len(rows)} assertions listed, {len(not_proved)} of them not proved")
    return 1 if wrong else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("report.py: expected TABLE or --check")
    sys.exit(check() if sys.argv[1] == "--check" else write(sys.argv[1]))
