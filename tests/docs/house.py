#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""docs/develop/house.md against the code: every arrow between rooms that the code draws stands in the page's table, and no other.

Usage: house.py ROOT
An arrow is an #include of one room's header in another room, or a library of one room that a target of another room links. The table
is the page's first fenced block: a room and the rooms it uses, a line each; a room named without its sub-room stands for all of them.
Exit status: 0 the page is true, 1 it is not (a line for each arrow), 2 wrong use.
"""
import os
import pathlib
import re
import sys

PARTED = ("asic", "hls", "motion", "tb")  # rooms whose sub-rooms are told apart
SOURCES = {".cpp", ".hpp", ".inc"}
SKIPPED = {"tests", "build", "out"}  # tests may use every room; nothing may use them


def room_of(path: pathlib.PurePosixPath) -> str:
    parts = path.parts
    return "/".join(parts[:2]) if parts[0] in PARTED and len(parts) > 2 else parts[0]


def rooms(root: pathlib.Path):
    """Folders of the project that hold code."""
    return [entry for entry in sorted(root.iterdir()) if entry.is_dir() and entry.name not in SKIPPED and entry.name[0] != "."]


def include_arrows(root: pathlib.Path):
    for folder in rooms(root):
        for file in sorted(folder.rglob("*")):
            if file.suffix not in SOURCES:
                continue
            here = file.relative_to(root)
            for number, line in enumerate(file.read_text().splitlines(), 1):
                found = re.match(r'#include "([^"]+)"', line)
                if found and (root / found[1]).is_file():
                    yield room_of(here), room_of(pathlib.PurePosixPath(found[1])), f"{here}:{number}"


CALL = re.compile(r"\b(\w+)\((\w[\w-]*)\s+([^()]*(?:\([^)]*\)[^()]*)*)\)")


def link_arrows(root: pathlib.Path):
    """From the CMakeLists.txt: a library belongs to the room of its first source, whether add_library or a function of ours makes it."""
    lists = [(file.relative_to(root), file.read_text()) for folder in rooms(root) for file in sorted(folder.rglob("CMakeLists.txt"))]
    prefix = {}  # of the targets that a function makes
    for _, text in lists:
        for name, body in re.findall(r"function\((\w+) name\)(.*?)endfunction", text, re.S):
            made = re.search(r"(meltstage_\w*)\$\{name\}", body)
            prefix[name] = made[1] if made else ""
    made_in, uses = {}, []
    for file, text in lists:
        for call in CALL.finditer(text):
            function, name, rest = call[1], call[2], call[3]
            if function not in ("add_library", "add_executable", "target_link_libraries", *prefix):
                continue
            target = prefix.get(function, "") + name
            source = re.search(r"[\w./]+\.cpp", rest)
            if source and function != "target_link_libraries":
                made_in[target] = room_of(pathlib.PurePosixPath(os.path.normpath(file.parent / source[0])))
            line = text.count("\n", 0, call.start()) + 1
            uses += [(target, used.replace("::", "_"), f"{file}:{line}") for used in re.findall(r"\bmeltstage(?:::|_)\w+", rest)]
    made_in["meltstage_rtl"] = "rtl"  # what Verilator makes of it
    for target, used, place in uses:
        if target in made_in and used in made_in:
            yield made_in[target], made_in[used], place


def said(page: pathlib.Path) -> dict[str, set[str]]:
    block = re.search(r"```text\n(.*?)```", page.read_text(), re.S)
    if not block:
        sys.exit(f"{page}: found no fenced text block, expected the table of rooms")
    table = {}
    for line in block[1].splitlines():
        words = line.split("#")[0].split()
        if words:
            table[words[0]] = set(words[1:])
    return table


def covered(arrow: tuple[str, str], table: dict[str, set[str]]) -> bool:
    used = table.get(arrow[0], set()) | table.get(arrow[0].split("/")[0], set())
    return arrow[1] in used or arrow[1].split("/")[0] in used


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__.split("\n\n")[1], file=sys.stderr)
        return 2
    root = pathlib.Path(sys.argv[1]).resolve()
    page = root / "docs/develop/house.md"
    table = said(page)
    drawn = {}
    for source, target, place in [*include_arrows(root), *link_arrows(root)]:
        if source != target:
            drawn.setdefault((source, target), place)
    wrong = [f"{place}: {a} uses {b}, which docs/develop/house.md does not say" for (a, b), place in sorted(drawn.items())
             if not covered((a, b), table)]
    for room, used in table.items():
        for other in sorted(used):
            if not any(a in (room, ) or a.split("/")[0] == room for a, b in drawn if b == other or b.split("/")[0] == other):
                wrong.append(f"docs/develop/house.md: {room} uses {other}, which no include and no link line shows")
    order = list(table)
    for room, used in table.items():  # floors: a room uses only rooms above it in the table
        for other in used:
            above = [name for name in order if name == other or name.split("/")[0] == other]
            if not above:
                wrong.append(f"docs/develop/house.md: {room} uses {other}, which the table does not name")
            elif any(order.index(name) >= order.index(room) for name in above if name.split("/")[0] != room.split("/")[0] or name == other):
                wrong.append(f"docs/develop/house.md: {room} uses {other}, which stands below it")
    print("\n".join(wrong) if wrong else f"{len(drawn)} arrows between rooms, all in docs/develop/house.md")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
