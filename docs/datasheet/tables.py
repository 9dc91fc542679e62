# SPDX-License-Identifier: Apache-2.0
"""Tables of the pages in docs/: figures that a command has printed there stand here too, and are typed once."""
import pathlib
import re

DOCS = pathlib.Path(__file__).resolve().parents[1]


def cells(line: str) -> list[str]:
    return [plain(cell.strip()) for cell in line.strip().strip("|").split("|")]


def plain(text: str) -> str:
    """Without the marks and links of Markdown."""
    return re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text).replace("**", "").replace("`", "")


def table(page: str, heading: str) -> list[list[str]]:
    """Rows below the line of headings that begins with these; ValueError when the page has no such table."""
    begin = "|" + "|".join(f" {name} " if name else " " for name in heading.split("|")) + "|"
    lines = (DOCS / page).read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines[:-1]):
        if line.startswith(begin) and set(lines[number + 1]) <= set("|-: "):
            rows = []
            for row in lines[number + 2:]:
                if not row.startswith("|"):
                    break
                rows.append(cells(row))
            return rows
    raise ValueError(f"docs/{page}: found no table that begins with {begin}, expected one")


def value(page: str, heading: str, row: str, column: int = 1) -> str:
    """A cell of such a table, by the name of its row."""
    for found in table(page, heading):
        if found[0] == row:
            return found[column]
    raise ValueError(f"docs/{page}: found no row {row} below | {heading} |, expected one")
