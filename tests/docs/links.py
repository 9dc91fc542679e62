#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that every link between the pages of README.md and docs/ leads somewhere: file, folder and #heading."""

import pathlib
import re
import sys

from pages import ROOT, all_pages, pieces, without_comments

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


def faults(page: pathlib.Path) -> list[str]:
    """One line a link that leads nowhere."""
    found = []
    fenced = False
    for number, line in enumerate(without_comments(page.read_text(encoding="utf-8")).splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        if fenced:
            continue
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
