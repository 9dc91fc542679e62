#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""report_page_test.py MELTSTAGE ROOT: the page of a print in Chromium. Curves zoom by a drag, the map of droplets by the wheel, and the
map tells what each droplet did; the summary is copied; two prints stand side by side."""
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "page"))
from browser import Browser  # noqa: E402


def printed(meltstage: str, job: str, out: pathlib.Path) -> pathlib.Path:
    subprocess.run([meltstage, "print", job, "--rtl", "none", "--out", out], stdout=subprocess.DEVNULL, check=False)
    return out / "report.html"


def pointer(browser: Browser, selector: str, *steps: dict) -> None:
    """Moves are from the middle of the element, in pixels."""
    origin = {"element-6066-11e4-a52e-4f735466cecf": browser.find(selector)}
    actions = [{"origin": origin, "duration": 20, **step} if step["type"] == "pointerMove" else step for step in steps]
    browser.call("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions}]})


def move(x: int) -> dict:
    return {"type": "pointerMove", "x": x, "y": 0}


PRESS, RELEASE = {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}


def times(browser: Browser, chart: str) -> list[float]:
    return browser.run("const { x } = Chart.getChart(arguments[0]).scales; return [x.min, x.max];", chart)


def map_width(browser: Browser) -> float:
    return browser.run("const { x } = Chart.getChart('droplets').options.plugins.equalAspect; return x[1] - x[0];")


def curves_zoom(browser: Browser) -> None:
    whole = times(browser, "temperature")
    pointer(browser, "#temperature", move(-100), PRESS, move(100), RELEASE)
    part = times(browser, "temperature")
    assert whole[0] < part[0] < part[1] < whole[1], (whole, part)
    assert times(browser, "deviation") == part, "both curves show the same times"
    pointer(browser, "#temperature", move(0), PRESS, RELEASE)
    assert times(browser, "temperature") == part, "a click is no drag"
    pointer(browser, "#temperature", move(0), PRESS, RELEASE, PRESS, RELEASE)
    assert times(browser, "temperature") == whole, "a double click shows all"


def map_zooms(browser: Browser) -> None:
    whole = map_width(browser)
    origin = {"element-6066-11e4-a52e-4f735466cecf": browser.find("#droplets")}
    browser.call("POST", "/actions", {"actions": [{"type": "wheel", "id": "wheel", "actions": [
        {"type": "scroll", "x": 0, "y": 0, "deltaX": 0, "deltaY": -100, "origin": origin}]}]})
    browser.until(f"return Chart.getChart('droplets').options.plugins.equalAspect.x.reduce((a, b) => b - a) < {whole}", "the map is larger", 5)
    pointer(browser, "#droplets", move(0), PRESS, RELEASE, PRESS, RELEASE)
    assert abs(map_width(browser) - whole) < 1e-9, "a double click shows all"


def droplets_are_told(browser: Browser, summary: dict) -> None:
    figures = {figure["what"]: figure["value"] for figure in summary["key_figures"]}
    misses = browser.run("return Chart.getChart('droplets').data.datasets.flatMap(d => d.data.map(p => p.miss_um ?? null));")
    assert len(misses) == summary["path"]["points"]
    fallen = [miss for miss in misses if miss is not None]
    assert len(fallen) == figures["Droplets"]
    if fallen:
        assert abs(max(fallen) - figures["Largest miss of a droplet"]) < 1e-3 * max(fallen), (max(fallen), figures)


def fault_leads_to_its_time(browser: Browser, summary: dict) -> None:
    browser.click("#faults button")
    begin, end = times(browser, "temperature")
    assert begin <= summary["faults"][0]["t_s"] <= end and end - begin <= 10.01, (begin, end)


def side_by_side(meltstage: str, good: pathlib.Path, bad: pathlib.Path) -> None:
    compared = subprocess.run([meltstage, "report", good, bad], capture_output=True, text=True)
    assert compared.returncode == 1, "one print is not good"
    assert "**not good**" in compared.stdout and "| Droplets | 24 | " in compared.stdout, compared.stdout
    assert subprocess.run([meltstage, "report", good, good], capture_output=True).returncode == 0
    (good / "summary.json").write_text("{}")
    refused = subprocess.run([meltstage, "report", good], capture_output=True, text=True)
    assert refused.returncode == 2 and "summary.json" in refused.stderr, refused.stderr


def main() -> None:
    meltstage, root = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        good = printed(meltstage, f"{root}/examples/first.toml", work / "good")
        job = pathlib.Path(root, "examples/first.toml").read_text().replace('"bumps_8x8.xls"', f'"{root}/examples/bumps_8x8.xls"')
        (work / "stopped.toml").write_text(job + '\n[[event]]\nat_s = 26.5\nwhat = "emergency-stop"\n')
        stopped = printed(meltstage, str(work / "stopped.toml"), work / "stopped")
        with Browser() as browser:
            for page in (good, stopped):
                browser.open(page.as_uri())
                summary = json.loads(page.with_name("summary.json").read_text())
                curves_zoom(browser)
                map_zooms(browser)
                droplets_are_told(browser, summary)
                if page == stopped:
                    assert summary["faults"], "the emergency stop is told"
                    fault_leads_to_its_time(browser, summary)
                assert "| Droplets | " in browser.run("return summaryText();")
                assert browser.errors() == [], "the page runs without an error"
        side_by_side(meltstage, work / "good", work / "stopped")


if __name__ == "__main__":
    main()
