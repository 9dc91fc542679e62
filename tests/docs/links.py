#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that what the pages of README.md and docs/ point to is there: links to files, folders and #headings, and
`folder/file` in code marks (BLOCK and other words in capitals stand for any name)."""

import pathlib
import re
import sys

from pages import ROOT, all_pages, pieces, without_comments

ROOMS = sorted(path.name for path in ROOT.iterdir() if path.is_dir() and not path.name.startswith("."))
CODE = re.compile(rf"`((?:{'|'.join(map(re.escape, set(ROOMS) - {'build', 'out'}))})/[\w./*{{}},-]+)`")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def anchors(page: pathlib.Path) -> set[str]:
    """The names that GitHub gives the page's headings."""
    names: set[str] = set()
    for piece in pieces(page.read_text(encoding="utf-8")):
        if piece.kind == "heading":
            title = piece.lines[0].lstrip("#").strip()
            title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title).lower()
            plain = re.sub(r"[^\w\- ]", "", title).replace(" ", "-")
            name, again = plain, 0
            while name in names:
                again += 1
                name = f"{plain}-{again}"
            names.add(name)
    return names


def is_there(name: str) -> bool:
    """Whether a name as the pages write it has files: a glob, {a,b}, words in capitals for any name."""
    choice = re.fullmatch(r"(.*)\{(.*)\}(.*)", name)
    if choice:
        return all(is_there(choice[1] + part + choice[3]) for part in choice[2].split(","))
    return any(ROOT.glob(re.sub(r"(?<=/)[A-Z]+(?=[/.]|$)", "*", name)))


def faults(page: pathlib.Path) -> list[str]:
    """One line a link that leads nowhere."""
    found = []
    fenced = False
    for number, line in enumerate(without_comments(page.read_text(encoding="utf-8")).splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        if fenced:
            continue
        for name in CODE.findall(line):
            if not is_there(name):
                found.append(f"{page.relative_to(ROOT)}:{number}: `{name}`: no such file")
        for target in LINK.findall(re.sub(r"`[^`]*`", "", line)):
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            there = (page.parent / path).resolve() if path else page
            where = f"{page.relative_to(ROOT)}:{number}: link to {target}"
            if not there.is_relative_to(ROOT):
                found.append(f"{where}: leads out of the repository")
            elif not there.exists():
                found.append(f"{where}: no such file")
            elif anchor and (there.suffix != ".md" or anchor not in anchors(there)):
                found.append(f"{where}: no heading gives that name")
    return found


def main() -> int:
    found = [fault for page in all_pages() for fault in faults(page)]
    for fault in found:
        print(fault)
    print(f"{len(all_pages())} pages, {len(found)} links lead nowhere")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
