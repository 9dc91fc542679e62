#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One HTML file of the page's parts: pack.py PAGE OUT NAME=FILE[,FILE...] ...

{{NAME}} in PAGE becomes the text of the files, one behind the other; of NAME@=FILE the file compressed (gzip) as base64."""
import base64
import gzip
import pathlib
import sys


def part(argument: str) -> tuple[str, str]:
    name, files = argument.split("=", 1)
    content = b"".join(pathlib.Path(file).read_bytes() for file in files.split(","))
    if name.endswith("@"):
        return name[:-1], base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()
    return name, content.decode()


def main() -> None:
    page, out, *arguments = sys.argv[1:]
    text = pathlib.Path(page).read_text()
    for name, content in map(part, arguments):
        mark = "{{" + name + "}}"
        if text.count(mark) != 1:
            sys.exit(f"pack.py: {page}: found {text.count(mark)} of {mark}, expected one")
        text = text.replace(mark, content)
    pathlib.Path(out).write_text(text)


if __name__ == "__main__":
    main()
