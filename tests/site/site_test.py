#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""site_test.py BUILD TEST: the site that the build folder BUILD has made. Exit status 1 when the test fails."""
import html.parser
import pathlib
import subprocess
import sys
import tempfile
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "docs/site"), str(ROOT / "tests/app/page")]

import stage
from browser import Browser

BUILD = pathlib.Path(sys.argv[1])
SITE = (BUILD / "site").resolve()
LOADED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}  # what a browser fetches by itself


class Page(html.parser.HTMLParser):
    """Names, links and loaded files of a page."""

    def __init__(self, path: pathlib.Path) -> None:
        super().__init__()
        self.names: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.names |= {found[key] for key in ("id", "name") if found.get(key)}
        if tag == "a" and found.get("href"):
            self.links.append(found["href"])
        if tag in LOADED and found.get(LOADED[tag]):
            self.loaded.append(found[LOADED[tag]])


def outside(pages: set[pathlib.Path], parts: dict[str, list[pathlib.Path]]) -> set[pathlib.Path]:
    """Pages that the navigation lacks, and those that it has and are none."""
    return pages ^ {page for part in parts.values() for page in part}


def navigation() -> None:
    """Each page stands in one place, under one of five readers."""
    pages = {ROOT / "README.md", *(ROOT / "docs").rglob("*.md")} - {ROOT / "docs/index.md"}
    parts = stage.navigation(ROOT / "docs/index.md")
    assert list(parts) == ["Quick start", "How-to", "Reference", "Explanation", "Develop"], list(parts)
    assert not outside(pages, parts), outside(pages, parts)
    # one left out, and one said twice, is seen
    text = (ROOT / "docs/index.md").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        index = pathlib.Path(name) / "index.md"
        index.write_text(text.replace("| [chip/control.md](chip/control.md) |", "| chip/control.md |"), encoding="utf-8")
        there = {page.relative_to(index.parent) for part in stage.navigation(index).values() for page in part if page.is_relative_to(index.parent)}
        assert pathlib.Path("chip/control.md") not in there and pathlib.Path("chip/protection.md") in there
        index.write_text(text + "\n| [chip/control.md](chip/control.md) | again |\n", encoding="utf-8")
        try:
            stage.navigation(index)
        except ValueError as error:
            assert "found chip/control.md twice" in str(error), error
        else:
            raise AssertionError("a page in two places was taken")
    for page in pages:
        built = SITE / (page.relative_to(ROOT / "docs") if page.is_relative_to(ROOT / "docs") else page.relative_to(ROOT)).with_suffix(".html")
        assert built.is_file(), f"no {built}"


def links() -> None:
    """What the pages link to and load is in the site; nothing is loaded from elsewhere."""
    pages = {path: Page(path) for path in SITE.rglob("*.html")}
    assert len(pages) > 60
    checked = 0
    for path, page in pages.items():
        for target in page.links + page.loaded:
            parts = urllib.parse.urlsplit(target)
            if parts.scheme:
                assert target in page.links and parts.scheme == "https", f"{path}: loads {target}"
                continue
            there = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            assert there.exists(), f"{path}: found a link to {target}, which is not there"
            if parts.fragment and there in pages:
                assert urllib.parse.unquote(parts.fragment) in pages[there].names, f"{path}: found a link to {target}, expected a heading of that name"
            checked += 1
    assert checked > 3000, checked
    for style in SITE.rglob("*.css"):
        text = style.read_text(encoding="utf-8")
        assert "@import" not in text and "http:" not in text.replace("http://www.w3.org", ""), style


def broken_links() -> None:
    """A link to a file that is not there stops the stage, one to a heading that is not there stops Sphinx, and a sound site passes both."""
    with tempfile.TemporaryDirectory() as name:
        root = pathlib.Path(name) / "project"
        (root / "docs").mkdir(parents=True)
        (root / "README.md").write_text("# A project\n\nSee [the page](docs/page.md#a-heading).\n")
        (root / "docs/index.md").write_text("# Pages\n\n## Begin\n\n| page | for |\n|---|---|\n| [r](../README.md) | all |\n| [p](page.md) | all |\n")

        def built(text: str) -> tuple[int, str]:
            (root / "docs/page.md").write_text(text)
            out = pathlib.Path(name) / "stage"
            done = subprocess.run(["/usr/bin/python3", "-B", ROOT / "docs/site/stage.py", "--root", root, "--out", out], capture_output=True, text=True)
            if done.returncode == 0:
                done = subprocess.run(["sphinx-build", "-q", "-E", "-W", "--keep-going", "-b", "html", out, pathlib.Path(name) / "site"], capture_output=True, text=True)
            return done.returncode, done.stderr

        assert built("# Page\n\n## A heading\n\n[back](../README.md), [folder](../docs)\n") == (0, "")
        status, said = built("# Page\n\n## A heading\n\n[away](nowhere.md)\n")
        assert status == 2 and said == "stage.py: docs/page.md: found a link to nowhere.md, which is not there, expected a file of the project\n", said
        status, said = built("# Page\n\n## Another heading\n\nText.\n")
        assert status != 0 and "a-heading" in said, (status, said)
        status, said = built("# Page\n\n## A heading\n\n[out](../../outside)\n")
        assert status == 2 and said.count("\n") == 1, said


def browsed() -> None:
    """From disk, without a network: search finds, dark is dark, no page is wider than the window, nothing goes wrong."""
    address = SITE.as_uri()
    for width in (1280, 800):
        with Browser(width, 900) as browser:
            for page in ("index.html", "chip/registers.html", "chip/protection.html", "README.html"):
                browser.open(f"{address}/{page}")
                assert browser.run("return document.documentElement.scrollWidth <= innerWidth"), f"{page} is wider than {width}"
            browser.open(f"{address}/search.html?q=HoldPower")
            browser.until("return document.querySelectorAll('#search-results li a').length > 2", "results of the search", 30)
            titles = browser.run("return [...document.querySelectorAll('#search-results li a')].map(link => link.innerText)")
            assert "Protection" in titles, titles
            light = browser.run("return getComputedStyle(document.body).backgroundColor")
            button = "theme-toggle-content" if width > 1000 else "theme-toggle-header"
            browser.click(f".{button} button")  # light
            browser.click(f".{button} button")  # dark
            dark = browser.run("return getComputedStyle(document.body).backgroundColor")
            assert light == "rgb(255, 255, 255)" and dark == "rgb(19, 20, 22)", (light, dark)
            assert not browser.errors()
    with Browser(1280, 900, dark=True) as browser:
        browser.open(f"{address}/index.html")
        assert browser.run("return getComputedStyle(document.body).backgroundColor") == "rgb(19, 20, 22)"


if __name__ == "__main__":
    {test.__name__: test for test in (navigation, links, broken_links, browsed)}[sys.argv[2]]()
