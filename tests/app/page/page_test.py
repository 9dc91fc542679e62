#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The chip's page in Chromium: page_test.py MELTSTAGE TEST [PICTURES]. TEST: traces, given, operated, small, keyboard, failures, bad_scenarios, looks."""
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import urllib.parse

from browser import Browser

MELTSTAGE = sys.argv[1]
MOST_BYTES = 400_000


def command(*arguments: str, status: int | tuple[int, ...] = 0) -> str:
    done = subprocess.run([MELTSTAGE, *arguments], capture_output=True, text=True, timeout=600)
    assert done.returncode in (status if isinstance(status, tuple) else (status,)), f"{arguments}: exit status {done.returncode}, expected {status}: {done.stderr}"
    return done.stdout + done.stderr


def address(page: pathlib.Path, scenario: str) -> str:
    return page.as_uri() + "#" + urllib.parse.quote(scenario)


def drawn_scenario(draw: random.Random) -> str:
    """A head and events of every word at random times, valid but for what the chip refuses."""
    lines = [f"head {draw.choice(['PH-1', 'PH-A', 'PH-B', 'PH-C', 'E3D-like'])}",
             f"sensor {draw.choice(['MAX31855', 'MAX6675', 'MAX31865', 'ADT7320', 'ADT7310', 'LM70'])}",
             f"noise {draw.uniform(0, 0.4):.3f}", f"seed {draw.randrange(1 << 40)}", f"second_switch {draw.choice(['on', 'off'])}",
             f"{draw.uniform(0.2, 1):.4f} set SETPOINT {draw.uniform(40, 95):.1f}", "1.1 try run"]
    events = [lambda: f"set SETPOINT {draw.uniform(30, 95):.1f}", lambda: draw.choice(["run", "stop", "clear", "tune", "hold", "commit", "discard"]),
              lambda: f"frame {' '.join(f'{draw.randrange(256):02x}' for _ in range(draw.randrange(1, 20)))}",
              lambda: f"host {draw.choice(['on', 'off'])}", lambda: f"clock {draw.choice(['on', 'on', 'off'])}",
              lambda: f"sensor {draw.choice(['sound', 'sound', 'open', 'to_ground', 'to_supply', 'low', 'high', 'silent', 'frozen', 'wrong_bits'])}",
              lambda: f"seat {draw.uniform(0, 1):.3f}", lambda: f"heater {draw.choice(['sound', 'sound', 'open', 'shorted'])}",
              lambda: f"supply {draw.uniform(0, 1.3):.3f}", lambda: f"ambient {draw.uniform(-20, 40):.2f}", lambda: f"fan {draw.uniform(0, 0.4):.3f}",
              lambda: f"drops {draw.uniform(0, 900):.2f} {draw.uniform(0, 20):.2f}", lambda: f"estop {draw.choice(['on', 'off'])}",
              lambda: f"reset {draw.choice(['on', 'off', 'off'])}", lambda: f"flip guard.{draw.choice(['run_q', 'heater_q', 'run_nq'])} 0"]
    at = 5.0
    for _ in range(25):
        at += draw.expovariate(1 / 3)
        lines.append(f"{at:.6f} {draw.choice(events)()}")
    return "\n".join(lines)


def traces(page: pathlib.Path, folder: pathlib.Path) -> None:
    """The page's run and the command's are the same text, the hash of every change of a pin in it."""
    seed = int(os.environ.get("MELTSTAGE_PAGE_SEED", random.SystemRandom().randrange(1 << 32)))
    print(f"MELTSTAGE_PAGE_SEED={seed}")
    draw = random.Random(seed)
    readings = set()
    with Browser() as browser:
        for number in range(4):
            scenario = drawn_scenario(draw)
            file = folder / f"{number}.txt"
            file.write_text(scenario)
            command("chip", "play", str(file), "--for", "90", "--out", str(folder / "trace.csv"), status=(0, 1))  # the chip may refuse
            native = (folder / "trace.csv").read_text()
            browser.open(address(page, f"trace=90&{scenario}"))
            shown = browser.until("return document.getElementById('trace').textContent", "the trace")
            assert native.count("\n") == 902, native.count("\n")
            assert shown == native, f"{scenario}\nfirst difference: " + next(
                f"{a} in the page, {b} by the command" for a, b in zip(shown.splitlines(), native.splitlines()) if a != b)
            readings |= {line.split(",")[2] for line in native.splitlines()}
    assert len(readings) > 20, "the reading hardly moved"


def given(page: pathlib.Path, folder: pathlib.Path) -> None:
    """A page with a scenario built in begins with it, also with one in which nothing happens."""
    file, own = folder / "given.txt", folder / "given.html"
    for text, shown in [("head PH-B  # </script> & \"quotes\"\n0.2 fan 0.1\n", "fan 0.1"), ("", "")]:
        file.write_text(text)
        command("page", "--scenario", str(file), "--out", str(own))
        with Browser() as browser:
            browser.open(own.as_uri())
            browser.choose("#speed", "1e9")
            browser.until("return parseFloat(document.getElementById('now').textContent) > 5", "time passes")
            log = browser.text("#log")
            assert shown in log and "SETPOINT" not in log, log
            assert browser.errors() == [], browser.errors()


def operated(page: pathlib.Path, _: pathlib.Path) -> None:
    with Browser() as browser:
        browser.open(address(page, "head PH-B"))
        browser.run("document.getElementById('setpoint').value = ''")
        browser.click("#heat")
        assert browser.text("#refused").startswith("found set SETPOINT, expected"), browser.text("#refused")
        browser.run("document.getElementById('setpoint').value = 80")
        browser.choose("#speed", "1e9")
        browser.click("#heat")
        browser.until("return parseFloat(document.querySelectorAll('#figures dd')[1].textContent) > 75", "the head is hot")
        assert browser.text("#log").count("run: done") == 1, browser.text("#log")
        assert "set SETPOINT 80 °C: done" in browser.text("#log"), browser.text("#log")
        browser.choose("#knob_heater", "shorted")
        fault = browser.until("return document.getElementById('fault').textContent", "a fault")
        assert re.match(r"HeaterFb: .*Limit: FB_TIME.* Next: ", fault), fault
        browser.choose("#speed", "1")
        browser.click("#newest")
        assert browser.run("return document.getElementById('kept').textContent") == ""
        drawn = browser.run("const c = document.getElementById('waves'); const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
                            "let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n;")
        assert drawn > 5000, f"{drawn} points of the waves are drawn"
        browser.keys("#event", "set T_MAX 9999")
        browser.click("#by_hand button")
        assert browser.text("#refused") == "found 9999, expected T_MAX of 0.0 to 500.0 degC", browser.text("#refused")
        link = browser.run("return location.href")
        shown = browser.run("return Array.from(document.querySelectorAll('#log td:last-child'), cell => cell.firstChild.textContent)")
        browser.open(link)  # the run again, from its address
        browser.choose("#speed", "1e9")
        browser.until("return document.getElementById('fault').textContent", "the fault again")
        again = browser.run("return Array.from(document.querySelectorAll('#log td:last-child'), cell => cell.firstChild.textContent)")
        assert again[:len(shown)] == shown, f"{again}\nnot\n{shown}"
        assert browser.errors() == [], browser.errors()


def small(page: pathlib.Path, _: pathlib.Path) -> None:
    """One file, which asks for no other one."""
    size = page.stat().st_size
    print(f"{size} bytes")
    assert size <= MOST_BYTES, f"{size} bytes, at most {MOST_BYTES}"
    with Browser() as browser:
        browser.open(page.as_uri())
        browser.until("return document.querySelectorAll('#figures dd').length", "figures")
        asked = browser.run("return performance.getEntriesByType('resource').map(entry => entry.name)")
        assert asked == [], asked
        assert browser.errors() == [], browser.errors()


def keyboard(page: pathlib.Path, _: pathlib.Path) -> None:
    """All that can be operated is reached by Tab, has a name, and heating is begun by keys alone."""
    tab, enter = "\ue004", "\ue007"
    with Browser() as browser:
        browser.open(address(page, "head PH-1"))
        browser.until("return document.querySelectorAll('#registers tbody tr').length", "registers")
        nameless = browser.run(
            "return Array.from(document.querySelectorAll('button, input, select, canvas'), e => [e.id || e.outerHTML.slice(0, 60),"
            " e.getAttribute('aria-label') || e.labels?.length || e.textContent.trim()]).filter(([, name]) => !name)")
        assert nameless == [], nameless
        browser.keys("body", tab)
        reached = set()
        for _ in range(40):
            reached.add(browser.run("return document.activeElement.id || document.activeElement.textContent.trim()"))
            browser.keys(":focus", tab)
        missing = {"speed", "setpoint", "heat", "Stop", "Clear faults", "scenario", "temperature", "knob_sensor", "event", "waves", "find"} - reached
        assert not missing, missing
        browser.keys("#heat", enter)
        browser.choose("#speed", "1e9")
        browser.until("return parseFloat(document.querySelectorAll('#figures dd')[1].textContent) > 40", "the head warms up")


def failures(page: pathlib.Path, folder: pathlib.Path) -> None:
    """What the chip refuses or does not answer stands in the page's log in the words of the command."""
    file = folder / "failures.txt"
    file.write_text("1 set SETPOINT 400;2 set ADDRESS 5;3 set SETPOINT 100;4 try run")
    said = command("chip", "play", str(file), "--for", "6", "--out", str(folder / "trace.csv"), status=1)
    told = re.findall(r" s: (set .*)", said)
    assert len(told) == 2, said
    with Browser() as browser:
        browser.open(address(page, file.read_text()))
        browser.choose("#speed", "1e9")
        browser.until("return parseFloat(document.getElementById('now').textContent) > 6", "time passes")
        bad = browser.run("return Array.from(document.querySelectorAll('#log td.bad'), cell => cell.firstChild.textContent)")
        assert bad == [words.replace("degC", "°C") for words in told], f"{bad} in the page, {told} by the command"
        assert "run: no answer" in browser.text("#log"), browser.text("#log")


def bad_scenarios(page: pathlib.Path, folder: pathlib.Path) -> None:
    file = folder / "bad.txt"
    refusals = {}
    for text, expected in [
            ("++1 run", "1: found ++1, expected a time of 0 to 1000000 s"),
            ("1e-400 run", "1: found 1e-400, expected a time of 0 to 1000000 s"),
            ("1 set SETPOINT 0x10", "1: found 0x10, expected SETPOINT of 0.0 to 500.0 degC"),
            ("head PH-9", "1: found head PH-9, expected head PH-1, PH-A"),
            ("\n\n5 sensor gone\n", "3: found gone, expected sensor sound, open"),
            ("nan run", "1: found nan run, expected head, sensor, noise"),
            ("1e99 run", "1: found 1e99, expected a time of 0 to 1000000 s"),
            ("1 set SETPOINT inf", "1: found inf, expected SETPOINT of 0.0 to 500.0 degC"),
            ("1 flip guard.run_q 1", "1: found 1, expected bit 0 of guard.run_q"),
            ("1 set CMD_ 1", "1: found CMD_, expected one of CMD, SETPOINT"),
            ("1 set KP 1e-9", "1: found 1e-9, expected KP of 0, or 1.52588e-05 1/K at least: the register would hold 0"),
            ("1 set STATUS 1", "1: found STATUS, expected a register that can be written"),
            ("1 supply 1e9", "1: found 1e9, expected supply of 0 to 2 of the nominal voltage"),
            ("1 flip nosuch.q 0", "1: found nosuch.q, expected BLOCK.FLOP with a block of"),
            ("seed 1\nseed 2", "2: found seed 2, expected seed once"),
            ("1 run; seed 3", "1: found seed 3, expected a time in seconds"),
            ("1 \x1b[31mrun", r"1: found \x1B[31mrun, expected one of set, run")]:
        file.write_text(text)
        for arguments in (["chip", "play", str(file)], ["page", "--scenario", str(file), "--out", str(folder / "no.html")]):
            said = command(*arguments, status=2)
            assert f"{file}:{expected}" in said, said
            assert said.count("\n") == 1, said
        refusals[text] = said.split(f"{file}:", 1)[1].rstrip()
        assert not (folder / "no.html").exists()
    with Browser() as browser:
        for text, refusal in refusals.items():  # the page has another C++ library
            browser.open(address(page, f"trace=1&{text}"))
            told = browser.until("return document.getElementById('trace').textContent", f"the refusal of {text}")
            assert told == f"line {refusal}", f"{told}, by the command {refusal}"
        browser.open(address(page, "5 sensor gone"))
        told = browser.until("return document.getElementById('trouble').textContent", "what is wrong")
        assert "line 1: found gone, expected sensor sound, open" in told, told
        browser.until("return document.querySelectorAll('#figures dd').length", "the page runs all the same")
        browser.open(page.as_uri() + "#%E0%A4%A")
        told = browser.until("return document.getElementById('trouble').textContent", "what is wrong")
        assert "found %E0%A4%A, expected head, sensor" in told, told
        browser.run("location.hash = '3 sensor open'")  # another address in the same window
        browser.until("return !document.getElementById('trouble').textContent", "the new scenario is taken")
        browser.choose("#speed", "1e9")
        browser.until("return document.getElementById('log').textContent.includes('sensor open')", "and runs")


def looks(page: pathlib.Path, _: pathlib.Path) -> None:
    """Pictures for a person, light and dark, wide and narrow; nothing sticks out to the side."""
    pictures = pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else None
    for name, width, dark in [("wide", 1280, False), ("dark", 1280, True), ("narrow", 800, False), ("phone", 420, True)]:
        with Browser(width, 2300, dark) as browser:
            browser.open(address(page, "head PH-1;1 set SETPOINT 110;1.2 run;240 seat 0.2"))
            browser.choose("#speed", "1e9")
            browser.until("return document.getElementById('fault').textContent", "a fault", 120)
            browser.choose("#speed", "1")
            browser.click("#newest")
            wide = browser.run("return [document.documentElement.scrollWidth, innerWidth]")
            assert wide[0] <= wide[1], f"{name}: {wide[0]} pixels in a window of {wide[1]}"
            back, front = browser.run("const s = getComputedStyle(document.body); return [s.backgroundColor, s.color]")
            assert (sum(map(int, re.findall(r"\d+", back)[:3])) < sum(map(int, re.findall(r"\d+", front)[:3]))) == dark, (back, front)
            if pictures:
                browser.picture(pictures / f"{name}.png")


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        page = folder / "chip.html"
        command("page", "--out", str(page))
        globals()[sys.argv[2]](page, folder)


if __name__ == "__main__":
    main()
