# SPDX-License-Identifier: Apache-2.0
"""A copy of the RTL in which input bug_i of tc_top chooses a variant; 0 is the chip as it is. Each module has the input, since Yosys
follows no name upward through the hierarchy."""
import pathlib
import re

HEAD = re.compile(r"^module \w+ (?:#\(.*?\n\) )?\(\n", re.DOTALL | re.MULTILINE)
INSTANCE = re.compile(r"\btc_\w+ (?:#\([^;]*?\) )?u_\w+ \(")
PORT = "  input logic [15:0] bug_i,\n"


def read(folder: pathlib.Path) -> dict[str, str]:
    """File names and texts of the RTL, its properties too; the copy has them in one folder."""
    return {path.name: path.read_text() for path in sorted(folder.rglob("tc*.sv*"))}


def choose(number: int, broken: str, right: str) -> str:
    """An expression that is `broken` in variant `number`. Both must read the same signals: no new combinational loop."""
    return f"(bug_i == 16'd{number} ? ({broken}) : ({right}))"


def omit(number: int, statement: str) -> str:
    """A statement of a clocked process that is not there in variant `number`."""
    return f"begin if (bug_i != 16'd{number}) {statement} end"


def with_port(text: str) -> str:
    """The modules of a file with the input, and their instances with it connected."""
    text = HEAD.sub(lambda head: head[0] + PORT, text)
    return INSTANCE.sub(lambda instance: instance[0] + ".bug_i(bug_i), ", text)


def write(text: dict[str, str], folder: pathlib.Path) -> None:
    """Adds the port and writes the files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, body in text.items():
        (folder / name).write_text(with_port(body))
