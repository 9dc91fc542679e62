# SPDX-License-Identifier: Apache-2.0
"""Reads the Markdown of README.md and docs/ into the pieces that the tests of the pages look at."""

import dataclasses
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]

FENCE = re.compile(r"^\s*(```+)(.*)$")
ITEM = re.compile(r"^\s*(?:[-*+]|\d+[.)])\s+")
COMMENT = re.compile(r"<!--.*?-->", re.S)


@dataclasses.dataclass
class Piece:
    """A heading, table, fenced block, list item or paragraph; `line` is the first one, from 1."""

    kind: str  # heading, table, fence, item, text
    line: int
    lines: list[str]
    info: str = ""  # what stands behind a fence's first ```
    remark: str = ""  # text of an HTML comment that stands just above


def all_pages(root: pathlib.Path = ROOT) -> list[pathlib.Path]:
    """README.md and every page of docs/, sorted."""
    return [root / "README.md", *sorted((root / "docs").rglob("*.md"))]


def without_comments(text: str) -> str:
    """The text with each HTML comment's characters gone and its line ends kept."""
    return COMMENT.sub(lambda found: "\n" * found.group().count("\n"), text)


def pieces(text: str) -> list[Piece]:
    """The page's pieces in order. A comment belongs to the piece below it, if no blank line parts them."""
    found: list[Piece] = []
    remark = ""
    fence = ""
    in_comment = False
    for number, line in enumerate(text.splitlines(), 1):
        mark = FENCE.match(line)
        if fence:
            if mark and mark.group(1) == fence and not mark.group(2).strip():
                fence = ""
                found.append(Piece("end", number, []))
            else:
                found[-1].lines.append(line)
            continue
        if in_comment or line.lstrip().startswith("<!--"):
            remark += line + "\n"
            in_comment = "-->" not in line
            continue
        if mark:
            fence = mark.group(1)
            found.append(Piece("fence", number, [], mark.group(2).strip(), remark))
        elif not line.strip():
            found.append(Piece("end", number, []))
        elif line.startswith("#"):
            found.append(Piece("heading", number, [line]))
        elif line.lstrip().startswith("|"):
            join_or_begin(found, "table", number, line)
        elif ITEM.match(line):
            found.append(Piece("item", number, [ITEM.sub("", line)]))
        elif found and found[-1].kind == "item":
            found[-1].lines.append(line)
        else:
            join_or_begin(found, "text", number, line)
        remark = ""
    if fence:
        raise ValueError(f"line {found[-1].line}: a fence that nothing ends")
    return [piece for piece in found if piece.kind != "end"]


def join_or_begin(found: list[Piece], kind: str, number: int, line: str) -> None:
    """Adds a line to the piece of this kind that is open, or opens one."""
    if found and found[-1].kind == kind:
        found[-1].lines.append(line)
    else:
        found.append(Piece(kind, number, [line]))
