#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Tells how long the sentences of README.md and docs/ are.

    words.py [--check] [PAGE...]

Prints a row a page: words, sentences, mean words a sentence, longest sentence; then the sentences over 40 words.
With --check it exits 1 when a page's mean is over 20 or a sentence is over 40.

Headings, tables, fenced blocks, comments and the targets of links are left out. Each list item begins a sentence
of its own, and what introduces a list ends with its paragraph, at the colon.
"""

import argparse
import pathlib
import re
import sys

from pages import ROOT, all_pages, pieces

MEAN_AT_MOST = 20.0
SENTENCE_AT_MOST = 40

# A full stop behind one of these does not end a sentence.
SHORT_FORMS = ("e.g.", "i.e.", "etc.", "vs.", "cf.", "eq.", "eqs.", "fig.", "no.", "approx.", "resp.", "p.", "pp.")
SENTENCE_END = re.compile(r"""[.!?]["')\]*_]*\s+(?=["'(\[*_`]*[A-Z0-9`])""")
LINK = re.compile(r"!?\[([^\]]*)\]\([^)\s]*\)")
WORD = re.compile(r"[^\W_]")


def sentences(lines: list[str], first: int) -> list[tuple[int, str]]:
    """Line number and text of each sentence of a paragraph or list item."""
    text = "\n".join(lines)
    text = LINK.sub(lambda link: link.group(1), text)
    # what stands between backquotes is a name: its full stops end nothing
    hidden = re.sub(r"`[^`]*`", lambda code: re.sub(r"[.!?]", "x", code.group()), text)
    ends = []
    for end in SENTENCE_END.finditer(hidden):
        last_word = hidden[: end.start() + 1].split()[-1].lower().lstrip("(")
        if last_word not in SHORT_FORMS:
            ends.append(end.end())
    found = []
    for begin, end in zip([0, *ends], [*ends, len(text)]):
        found.append((first + text.count("\n", 0, begin), " ".join(text[begin:end].split())))
    return found


def words(sentence: str) -> int:
    """Words of a sentence: what blanks part and has a letter or a digit."""
    return sum(1 for word in sentence.split() if WORD.search(word))


def measure(page: pathlib.Path) -> list[tuple[int, str, int]]:
    """Line, text and words of each sentence of a page."""
    found = []
    for piece in pieces(page.read_text(encoding="utf-8")):
        if piece.kind in ("item", "text"):
            for line, text in sentences(piece.lines, piece.line):
                if words(text):
                    found.append((line, text, words(text)))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="exit 1 when a page is over a bound")
    parser.add_argument("pages", nargs="*", type=pathlib.Path, help="README.md and docs/ when none is named")
    arguments = parser.parse_args()

    faults = []
    print("words  sentences  mean  longest  page")
    for page in [page.resolve() for page in arguments.pages] or all_pages():
        name = page.relative_to(ROOT) if page.is_relative_to(ROOT) else page
        found = measure(page)
        total = sum(count for _, _, count in found)
        mean = total / max(len(found), 1)
        longest = max((count for _, _, count in found), default=0)
        print(f"{total:5}  {len(found):9}  {mean:4.1f}  {longest:7}  {name}")
        if mean > MEAN_AT_MOST:
            faults.append(f"{name}:1: mean sentence of {mean:.1f} words, at most {MEAN_AT_MOST:.0f}: say less at a time")
        for line, text, count in found:
            if count > SENTENCE_AT_MOST:
                faults.append(f"{name}:{line}: sentence of {count} words, at most {SENTENCE_AT_MOST}: {text}")
    for fault in faults:
        print(fault)
    return 1 if arguments.check and faults else 0


if __name__ == "__main__":
    sys.exit(main())
