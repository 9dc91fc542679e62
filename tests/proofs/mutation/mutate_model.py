#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""mutate_model.py CMODEL_FOLDER OUT_FOLDER: copies of the model's sources in which a number chooses a mutant (model_mutant.hpp).

Writes OUT/*.cpp and OUT/mutants.tsv: number, file, line, "step" or "idle" (a closed form of idle time), kind, change, text. Sites are
function bodies: comparisons, sums, bit operations, && and ||, shifts, numbers, conditions, assignments. Headers and what works for a
host are left alone.
"""
import pathlib
import re
import sys

MARKS = {"<": "Lt", "<=": "Le", ">": "Gt", ">=": "Ge", "==": "Eq", "!=": "Ne", "+": "Add", "-": "Sub", "&&": "And", "||": "Or",
         "&": "BitAnd", "|": "BitOr", "^": "Xor", "<<": "Left", ">>": "Right"}
BROKEN = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+", "&&": "||", "||": "&&", "&": "|",
          "|": "&", "^": "|", "<<": ">>", ">>": "<<"}
OPERATOR = re.compile(r"(?<=\s)(<=|>=|==|!=|&&|\|\||<<|>>|[<>+\-&|^])(?=\s|$)")
NUMBER = re.compile(r"(?<![\w.'<\[])(0x[0-9A-Fa-f]+|\d+)[uU]?(?![\w.'>\]])")
ASSIGNMENT = re.compile(r"^(\s+)((?:\+\+|--)?[A-Za-z_][\w.\[\]]*(?:->[\w.\[\]]+)*\s(?:=|\+=|-=|\|=|&=|\^=)\s|(?:\+\+|--)[A-Za-z_][\w.]*;)")
SKIPPED = re.compile(r"^\s*(//|#|case |default|template|using |static_assert|static constexpr|constexpr \w[\w:<>, ]* k|enum|return \{|\})")
IDLE = re.compile(r"(quiet|skip|idle|_for|advance|next_event|horizon)", re.IGNORECASE)
LEFT_ALONE = {"host_access.cpp"}


class Mutator:
    def __init__(self) -> None:
        self.rows: list[str] = []

    def add(self, file: str, line: int, where: str, kind: str, change: str, text: str) -> int:
        number = len(self.rows) + 1
        self.rows.append("\t".join([str(number), file, str(line), where, kind, change, text.strip()]))
        return number

    def line(self, file: str, at: int, where: str, text: str) -> str:
        code, slash, comment = text.partition("  //")
        if SKIPPED.match(code) or '"' in code:
            return text
        whole = code

        def condition(code: str) -> str:
            found = re.match(r"^(\s*(?:\} else )?if )\(", code) or re.match(r"^(\s*else if )\(", code)
            if not found or ";" in code[: code.find(")")]:
                return code
            depth = 0
            for i in range(found.end() - 1, len(code)):
                depth += {"(": 1, ")": -1}.get(code[i], 0)
                if depth == 0:
                    inside = code[found.end():i]
                    if inside.startswith(("const ", "auto ")):
                        return code
                    number = self.add(file, at, where, "condition negated", inside, whole)
                    return f"{found[1]}(mutant::condition({number}, {inside})){code[i + 1:]}"
            return code

        def operator(found: re.Match) -> str:
            op = found[1]
            number = self.add(file, at, where, "operator", f"{op} -> {BROKEN[op]}", whole)
            return f"{op} mutant::{MARKS[op]}{{{number}}} {op}"

        def literal(found: re.Match) -> str:
            number = self.add(file, at, where, "number + 1", found[0], whole)
            return f"mutant::next({number}, {found[0]})"

        brace = code.find("{", 0, len(code.rstrip()) - 1) >= 0
        if not brace:
            code = NUMBER.sub(literal, code)
        code = OPERATOR.sub(operator, code)
        code = condition(code)
        if dropped := ASSIGNMENT.match(code):
            number = self.add(file, at, where, "assignment dropped", "", whole)
            code = f"{dropped[1]}if (mutant::is({number})) {{}} else {code[len(dropped[1]):]}"
        return code + slash + comment

    def file(self, path: pathlib.Path) -> str:
        out, function, inside = [], "", False
        for at, text in enumerate(path.read_text().splitlines(), 1):
            if not text.startswith((" ", "}", "#", "/")) and text:
                function, inside = text, False
            if inside:
                text = self.line(path.name, at, "idle" if IDLE.search(function) else "step", text)
            if not inside and text.rstrip().endswith("{") and "(" in function and not function.startswith(("struct", "namespace", "class")):
                inside = True
            if text.startswith("}"):
                inside = False
            out.append(text)
        return "\n".join(out) + "\n"


def main() -> int:
    model, out = map(pathlib.Path, sys.argv[1:3])
    out.mkdir(parents=True, exist_ok=True)
    mutator = Mutator()
    for path in sorted(model.glob("*.cpp")):
        text = path.read_text() if path.name in LEFT_ALONE else mutator.file(path)
        # the headers stand where they stood
        text = re.sub(r'^#include "(?!cmodel/|base/)([\w.]+)"', r'#include "cmodel/\1"', text, flags=re.MULTILINE)
        (out / path.name).write_text('#include "tests/proofs/mutation/model_mutant.hpp"\n' + text)
    (out / "mutants.tsv").write_text("\n".join(mutator.rows) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
