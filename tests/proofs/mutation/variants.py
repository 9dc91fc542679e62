# SPDX-License-Identifier: Apache-2.0
"""A copy of the RTL in which input bug_i of tc_top chooses a variant; 0 is the chip as it is."""
import pathlib
import re

FIRST_PORT = re.compile(r"module tc_top (?:#\(.*?\n\) )?\(\n", re.DOTALL)
PORT = "  input logic [15:0] bug_i,\n"


def read(folder: pathlib.Path) -> dict[str, str]:
    """File names and texts of the RTL, its properties too; the copy has them in one folder."""
    return {path.name: path.read_text() for path in sorted(folder.rglob("tc*.sv*"))}


def choose(number: int, broken: str, right: str) -> str:
    """An expression that is `broken` in variant `number`. Both must read the same signals: no new combinational loop."""
    return f"(tc_top.bug_i == 16'd{number} ? ({broken}) : ({right}))"


def omit(number: int, statement: str) -> str:
    """A statement of a clocked process that is not there in variant `number`."""
    return f"begin if (tc_top.bug_i != 16'd{number}) {statement} end"


def write(text: dict[str, str], folder: pathlib.Path) -> None:
    """Adds the port and writes the files."""
    text = text | {"tc_top.sv": FIRST_PORT.sub(lambda head: head[0] + PORT, text["tc_top.sv"], count=1)}
    folder.mkdir(parents=True, exist_ok=True)
    for name, body in text.items():
        (folder / name).write_text(body)
