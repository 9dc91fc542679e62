#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes what Sphinx makes the site of: README.md and the pages of docs/ as they stand, with links that lead within the site.

Usage: stage.py --out DIR [--root DIR]
DIR of --root: the project, default the parent of docs/
docs/index.md says which page stands where: a heading is a part of the navigation, and the links to pages in the first column of the
table below it are its pages. A link to a file or folder of the project outside of docs/ leads to a page that shows it.
Exit status: 0 written, 2 for an input that can't be used, in one line.
"""
import argparse
import os
import pathlib
import re
import shutil
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(HERE.parent / "datasheet"), str(HERE.parents[1] / "spec")]

import furo

import diagrams
import generate

LINK = re.compile(r"\]\(([^)\s]+)\)")
CODE = re.compile(r"(`[^`\n]*`)")
FENCE = re.compile(r"\s*```")
LANGUAGES = {".cpp": "cpp", ".hpp": "cpp", ".sv": "systemverilog", ".svh": "systemverilog", ".toml": "toml", ".py": "python", ".sh": "sh", ".cmake": "cmake",
             ".json": "json", ".v": "verilog"}
MOST_BYTES = 200_000  # of a file that the site shows


SHEET = '\n<p>Here: <a href="../meltstage.pdf">data sheet as PDF</a>, <a href="../meltstage.html">as a page</a>.</p>\n'


class Stage:
    """From `root`, the project, to `out`, the folder that Sphinx reads."""

    def __init__(self, root: pathlib.Path, out: pathlib.Path) -> None:
        self.root, self.docs, self.out = root, root / "docs", out
        self.shown: set[pathlib.Path] = set()  # files and folders outside of docs/ that a page links to

    def place(self, source: pathlib.Path) -> pathlib.Path:
        """Where a file of the project stands in the stage."""
        if source.is_relative_to(self.docs):
            return self.out / source.relative_to(self.docs)
        if source == self.root / "README.md":
            return self.out / "README.md"
        self.shown.add(source)
        return self.out / "files" / source.relative_to(self.root).parent / (source.name + ".md" if source.is_file() else source.name + "/index.md")

    def link(self, page: pathlib.Path, target: str) -> str:
        """A link of a page as the stage has it."""
        if re.match(r"[a-z]+:|#", target):
            return target
        name, mark, heading = target.partition("#")
        source = (page.parent / name).resolve()
        if source.is_dir() and source.is_relative_to(self.docs):  # a folder of pages: its first one
            source = sorted(source.glob("*.md"))[0]
        if not source.exists() or not source.is_relative_to(self.root):
            raise ValueError(f"{page.relative_to(self.root)}: found a link to {target}, which is not there, expected a file of the project")
        return os.path.relpath(self.place(source), self.place(page).parent) + mark + heading

    def page(self, source: pathlib.Path) -> str:
        """A page's text with the stage's links. Blocks and words of code stay as they are, but for a diagram of states."""
        lines, fenced, drawn = [], False, False
        for line in source.read_text(encoding="utf-8").splitlines():
            if FENCE.match(line):
                if not fenced and line.strip() == "```mermaid":
                    drawn = True
                    lines.append(self.states(source))
                if not drawn:
                    lines.append(line)
                if fenced:
                    drawn = False
                fenced = not fenced
            elif not fenced:
                parts = CODE.split(line)
                parts[::2] = [LINK.sub(lambda found: f"]({self.link(source, found[1])})", part) for part in parts[::2]]
                lines.append("".join(parts))
            elif not drawn:
                lines.append(line)
        return "\n".join(lines) + "\n"

    def states(self, source: pathlib.Path) -> str:
        """The main state machine as a picture, as code hosts draw it from the block."""
        picture = self.out / "pictures" / "states.svg"
        picture.parent.mkdir(parents=True, exist_ok=True)
        picture.write_text(diagrams.states(generate.load()["state"]).replace('width="100%"', 'width="640"'), encoding="utf-8")
        return f"![Main state machine]({os.path.relpath(picture, self.place(source).parent)})"

    def write(self) -> None:
        for source in [self.root / "README.md", *sorted(self.docs.rglob("*.md"))]:
            text = self.page(source)
            if source == self.docs / "index.md":
                text += "\n".join(self.trees())
            if source == self.docs / "chip/data-sheet.md":  # which lies beside the pages in a site
                text += SHEET
            write_text(self.place(source), text)
        for source in sorted(self.docs.rglob("*")):
            if source.suffix in (".svg", ".png", ".csv", ".json"):
                self.place(source).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, self.place(source))
        for source in sorted(self.shown):
            write_text(self.place(source), self.shown_file(source) if source.is_file() else self.shown_folder(source))
        shutil.copyfile(HERE / "conf.py", self.out / "conf.py")
        self.style()

    def style(self) -> None:
        """Files of the theme that Debian has for a web server alone are taken from here: what stands in _static goes before the theme's."""
        static = self.out / "_static"
        write_text(static / "site.css", (HERE / "site.css").read_text(encoding="utf-8"))
        write_text(static / "scripts/furo.js", (HERE / "site.js").read_text(encoding="utf-8"))
        css = (pathlib.Path(furo.__file__).parent / "theme/furo/static/styles/furo.css").read_text(encoding="utf-8")
        other = re.match(r"@import url\((/javascript/[\w./]+)\);", css)
        if other:
            css = pathlib.Path("/usr/share" + other[1]).read_text(encoding="utf-8") + css[other.end():]
        write_text(static / "styles/furo.css", css)

    def trees(self) -> list[str]:
        """The navigation, for Sphinx."""
        lines = []
        for title, pages in navigation(self.docs / "index.md").items():
            names = [os.path.relpath(self.place(page), self.out)[:-len(".md")] for page in pages]
            lines += ["", "```{toctree}", f":caption: {title}", ":hidden:", "", *names, "```", ""]
        return lines

    def shown_file(self, source: pathlib.Path) -> str:
        name = source.relative_to(self.root)
        data = source.read_bytes()[:MOST_BYTES]
        if b"\0" in data:
            return f"{orphan()}# {name}\n\nA binary file of the project.\n"
        text = data.decode("utf-8", "replace")
        fence = "`" * (max((len(run) for run in re.findall(r"`+", text)), default=2) + 1)
        fence = "```" if len(fence) < 3 else fence
        return f"{orphan()}# {name}\n\nA file of the project.\n\n{fence}{LANGUAGES.get(source.suffix, 'text')}\n{text.rstrip()}\n{fence}\n"

    def shown_folder(self, source: pathlib.Path) -> str:
        entries = sorted(entry.name + ("/" if entry.is_dir() else "") for entry in source.iterdir() if entry.name[0] != "." and entry.name != "__pycache__")
        names = "\n".join(f"- `{entry}`" for entry in entries)
        return f"{orphan()}# {source.relative_to(self.root)}/\n\nA folder of the project. It holds:\n\n{names}\n"


def orphan() -> str:
    """Front matter of a page that stands in no navigation."""
    return "---\norphan: true\n---\n\n"


def navigation(index: pathlib.Path) -> dict[str, list[pathlib.Path]]:
    """Parts of the navigation in their order, each with its pages; ValueError when a page stands in two places."""
    parts: dict[str, list[pathlib.Path]] = {}
    title = ""
    for line in index.read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            title = line[3:].strip()
        elif title and line.startswith("| ["):
            first = line.split(" | ")[0]
            for target in LINK.findall(first):
                page = (index.parent / target).resolve()
                if page.suffix != ".md":
                    continue
                if any(page in pages for pages in parts.values()):
                    raise ValueError(f"docs/index.md: found {target} twice in the first column, expected each page in one place")
                parts.setdefault(title, []).append(page)
    return parts


def write_text(path: pathlib.Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder that Sphinx reads")
    parser.add_argument("--root", type=pathlib.Path, default=HERE.parents[1], help="the project")
    args = parser.parse_args()
    try:
        Stage(args.root.resolve(), args.out.resolve()).write()
    except OSError as error:
        print(f"stage.py: {error.filename}: found {error.strerror}, expected a file", file=sys.stderr)
        return 2
    except (ValueError, generate.SpecError) as error:
        print(f"stage.py: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
