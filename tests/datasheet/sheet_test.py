#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""sheet_test.py BUILD TEST: the data sheet that the build folder BUILD has made. Exit status 1 when the test fails."""
import html
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "spec"))

import generate

BUILD = pathlib.Path(sys.argv[1])
SHEET = BUILD / "datasheet/meltstage.html"
PDF = BUILD / "datasheet/meltstage.pdf"
RUNS = BUILD / "docs/datasheet/runs"


def plain(markup: str) -> str:
    """Words as a reader sees them."""
    markup = re.sub(r"<sup>(.*?)</sup>", r"^\1", markup)
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", markup)).replace("°C", "degC").replace("Ω", "ohm").replace("−", "-").split())


def rows(text: str) -> dict[str, str]:
    """Of each row of a table that has a name: its cells as words, a bar between them."""
    found = {}
    for name, row in re.findall(r'<tr id="([\w-]+)">(.*?)</tr>', text, re.DOTALL):
        assert name not in found, f"two rows are {name}"
        found[name] = " | ".join(plain(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", row, re.DOTALL))
    return found


def made(folder: pathlib.Path, spec: pathlib.Path = ROOT / "spec", runs: pathlib.Path = RUNS) -> subprocess.CompletedProcess:
    """The sheet from another specification or other runs, in `folder`."""
    command = ["/usr/bin/python3", "-B", ROOT / "docs/datasheet/sheet.py", "--runs", runs, "--out", folder / "sheet.html", "--spec", spec]
    return subprocess.run(command, capture_output=True, text=True)


def everything() -> None:
    """Each entry of the specification stands in its table, with the values that it has there."""
    found, spec = rows(SHEET.read_text(encoding="utf-8")), generate.load()
    expected = {}
    for reg in spec["input"] + spec["holding"]:
        expected[f"register-{reg['name']}"] = [f"0x{reg['addr']:03X}", reg["name"], reg["doc"]]
    for reg in spec["holding"]:
        expected[f"register-{reg['name']}"] += [f"{reg['min']}..{reg['max']} | {reg['reset']}", reg["access"]]
    for pin in spec["pin"]:
        expected[f"pin-{pin['name']}"] = [pin["name"], "output" if pin["output"] else "input", f"| {pin['width']} | {'high' if pin['idle'] else 'low'} |", pin["doc"]]
    for pin in spec["test_pin"]:
        expected[f"pin-{pin['name']}"] = [pin["name"], f"| {pin['width']} |", pin["doc"]]
    for fault in spec["fault"]:
        expected[f"fault-{fault['name']}"] = [f"{fault['bit']} | {fault['name']} |", fault["doc"], *fault["limits"]]
    for state in spec["state"]:
        expected[f"state-{state['name']}"] = [f"{state['name']} | {state['code']:05b} | {', '.join(state['to'])}", state["doc"]]
    for kind, key in (("function", "code"), ("exception", "code"), ("command", "name"), ("preset", "name")):
        for entry in spec[kind]:
            expected[f"{kind}-{entry[key]}"] = [entry["name"], entry.get("doc", "")]
    for name, texts in expected.items():
        assert name in found, f"no row {name}"
        for text in texts:
            assert text in found[name], f"{name}: found '{found[name]}', expected '{text}' in it"


def figures() -> None:
    """The diagrams name each pin, the one of states each state, and the one of blocks each block of the RTL."""
    text, spec = SHEET.read_text(encoding="utf-8"), generate.load()
    drawn = {label: set(re.findall(r"<text[^>]*>([^<]*)</text>", body)) for label, body in re.findall(r'<svg[^>]* aria-label="([^"]*)">(.*?)</svg>', text)}
    circuit, blocks = (next(words for label, words in drawn.items() if label.startswith(begin)) for begin in ("Application", "Functional"))
    pins = {pin["name"] for pin in spec["pin"]} | {"clk_i"}
    assert pins <= blocks, f"no {pins - blocks} in the diagram of blocks"
    # the telemetry line may stay open
    assert pins - {"tlm_tx_o"} <= circuit, f"no {pins - circuit} in the circuit"
    top = (ROOT / "rtl/tc_top.sv").read_text(encoding="utf-8")
    parts = {name.upper() for name in re.findall(r"^  tc_(\w+) (?:#\(.*\) )?u_", top, re.MULTILINE)} - {"RST_SYNC", "SYNC", "PROPERTIES"}
    assert len(parts) == 10 and parts <= blocks, f"no {parts - blocks} in the diagram of blocks"
    states = drawn["Main state machine"]
    assert {state["name"] for state in spec["state"]} <= states, states


def changed_reset() -> None:
    """Another reset value in the specification is another one in the sheet: the word, its unit, and the detector that it sets."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copytree(ROOT / "spec", folder / "spec", ignore=shutil.ignore_patterns("__pycache__"))
        file = folder / "spec/registers.toml"
        text = file.read_text(encoding="utf-8")
        changed, count = re.subn(r'(name = "T_MAX".*?\nreset = )1500\n', r"\g<1>1234\n", text, count=1, flags=re.DOTALL)
        assert count == 1
        file.write_text(changed, encoding="utf-8")
        done = made(folder, folder / "spec")
        assert done.returncode == 0, done.stderr
        before, after = (rows(path.read_text(encoding="utf-8")) for path in (SHEET, folder / "sheet.html"))
        assert "1500 150 degC" in before["register-T_MAX"] and "1234 123.4 degC" in after["register-T_MAX"], after["register-T_MAX"]
        assert "T_MAX 123.4 degC" in after["fault-OverTemp"], after["fault-OverTemp"]
        others = [row for row in before if before[row] != after[row]]
        assert sorted(others) == ["fault-OverTemp", "register-T_MAX"], others


def no_task() -> None:
    """A register that no task names, a state without a place in the diagram, and a run that is not there are told in one line."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copytree(ROOT / "spec", folder / "spec", ignore=shutil.ignore_patterns("__pycache__"))
        for file, old, new, told in (
                ("registers.toml", 'name = "PEAK"', 'name = "SUMMIT"', "docs/datasheet/tasks.toml: found PEAK, SUMMIT in a task or in spec/registers.toml alone"),
                ("chip.toml", 'to = ["TempDisplay"]', 'to = ["CfgPwm"]', "diagrams.py: ReadTemp to CfgPwm|diagrams.py: found PLACES and WAYS of other states"),
                ("chip.toml", "clk_hz = 12_000_000", 'clk_hz = "fast"', "chip.toml: [chip]: found clk_hz fast")):
            sound = (folder / "spec" / file).read_text(encoding="utf-8")
            assert old in sound
            (folder / "spec" / file).write_text(sound.replace(old, new), encoding="utf-8")
            done = made(folder, folder / "spec")
            (folder / "spec" / file).write_text(sound, encoding="utf-8")
            assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
            assert any(text in done.stderr for text in told.split("|")), done.stderr
        done = made(folder, runs=folder)
        assert done.returncode == 2 and re.fullmatch(r"sheet\.py: .*timing\.vcd: found No such file or directory, expected a file\n", done.stderr), done.stderr
        assert not (folder / "sheet.html").exists()


def pins_by_clock(text: str) -> dict[str, list[tuple[int, int]]]:
    """Clock and level of each change in a VCD of picoseconds, read line by line."""
    codes = {code: name for code, name in re.findall(r"\$var wire 1 (\S+) (\w+) \$end", text)}
    unit_ps = {"1 ps": 1, "10 ps": 10, "100 ps": 100, "1 ns": 1000}[re.search(r"\$timescale (\d+ \w+)", text)[1]]
    found: dict[str, list[tuple[int, int]]] = {name: [] for name in codes.values()}
    clock = 0
    for line in text.splitlines():
        if line.startswith("#"):
            clock = round(int(line[1:]) * unit_ps * 12e6 / 1e12)
        elif line[:1] in "01" and line[1:] in codes:
            found[codes[line[1:]]].append((clock, int(line[0])))
    return found


def said_lengths(sheet: pathlib.Path) -> dict[str, int]:
    return {row[len("length-"):]: int(cells.split(" | ")[3]) for row, cells in rows(sheet.read_text(encoding="utf-8")).items() if row.startswith("length-")}


def lengths() -> None:
    """Each length of the table is that between two edges of the run, and what the RTL's description says; a diagram shows it."""
    said, pins = said_lengths(SHEET), pins_by_clock((RUNS / "timing.vcd").read_text(encoding="ascii"))

    def first(pin: str, level: int, after: float) -> int:
        return next(clock for clock, new in pins[pin][1:] if clock >= after and new == level)

    second = 12_000_000
    inhibit = first("inhibit_i", 1, 0)
    assert said["t_stop"] == first("heater_o", 0, inhibit) - inhibit == 0
    assert said["t_latch"] == first("fault_no", 0, inhibit) - inhibit == 4  # two clocks of the synchroniser, cause, fault
    fault = first("fault_no", 0, 2.35 * second)
    read_end = max(clock for clock, level in pins["spi_cs_no"][1:] if clock < fault and level == 1)
    assert said["t_off"] == said["t_fault"] == fault - read_end == first("heater_o", 0, read_end) - read_end
    refused = [clock for clock, level in pins["spi_cs_no"] if level == 1 and 2.35 * second <= clock < fault]
    assert len(refused) == 3, refused  # BAD_MAX
    half = 5 + 1  # SPI_DIV + 1
    select = first("spi_cs_no", 0, 1.2 * second)
    assert said["t_lead"] == first("spi_sclk_o", 1, select) - select == half
    assert said["t_sclk"] == 2 * half and said["t_high"] == half
    assert said["t_read"] == first("spi_cs_no", 1, select) - select == (1 + 2 * 32) * half
    rise = first("heater_o", 1, 1.15 * second)
    fall = first("heater_o", 0, rise)
    assert said["t_on"] == fall - rise and abs(said["t_on"] - 3600) <= 1
    assert said["t_pwm"] == first("heater_o", 1, fall) - rise == 12000
    toggles = [clock for clock, _ in pins["safe_en_o"] if clock > rise]
    assert said["t_enable"] == toggles[1] - toggles[0] == 1024
    driver = first("uart_de_o", 1, 1.2 * second)
    start = first("uart_tx_o", 0, driver)
    assert said["t_de_on"] == start - driver and abs(start - driver - 3 * 12e6 / 115200) <= 1  # three bits
    request = first("uart_rx_i", 0, 1.2 * second)
    assert abs(said["t_turn"] - (start - request - 8 * 11 * 12e6 / 115200)) <= 0.5
    assert said["t_turn"] >= 3.5 * 11 * 12e6 / 115200  # what Modbus asks for
    drawn = " ".join(re.findall(r"<text[^>]*>(t_\w+ \d+)", SHEET.read_text(encoding="utf-8")))
    for symbol in ("t_read", "t_lead", "t_high", "t_sclk", "t_turn", "t_de_on", "t_pwm", "t_on", "t_enable", "t_stop", "t_latch", "t_off"):
        assert f"{symbol} {said[symbol]}" in drawn, f"no {symbol} {said[symbol]} in {drawn}"


def moved_edge() -> None:
    """A heater that goes off a clock later in the run is one that goes off a clock later in the sheet."""
    text = (RUNS / "timing.vcd").read_text(encoding="ascii")
    code = re.search(r"\$var wire 1 (\S+) heater_o ", text)[1]
    at = text.rindex(f"\n0{code}\n")  # the fall after the fault
    stamp = re.findall(r"\n#(\d+)", text[:at])[-1]
    period = 1_000_000 // 12
    moved = text[:at] + text[at + len(code) + 2:]
    end = moved.index("\n#", at)
    assert int(re.match(r"\n#(\d+)", moved[end:])[1]) > int(stamp) + period
    moved = f"{moved[:end]}\n#{int(stamp) + period}\n0{code}{moved[end:]}"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for trace in RUNS.glob("*.csv"):
            shutil.copyfile(trace, folder / trace.name)
        (folder / "timing.vcd").write_text(moved, encoding="ascii")
        done = made(folder, runs=folder)
        assert done.returncode == 0, done.stderr
        before, after = said_lengths(SHEET), said_lengths(folder / "sheet.html")
        assert after == before | {"t_off": before["t_off"] + 1}, after
        assert f">t_off {after['t_off']} clocks<" in (folder / "sheet.html").read_text(encoding="utf-8")


# What the sheet says in words of its own, and the page or file that says so.
TOLD = (
    ("two clocks (0.17 µs) from the cause to heater off", "docs/chip/protection.md", "two clocks (0.17 us) after it is there"),
    ("The result is there 19 clocks after it was started", "docs/chip/blocks/algor.md", "every start is answered in 19 clocks"),
    ("at most 50 clocks, and 125 more behind a Discard", "docs/chip/blocks/sysctrl.md", "at most 50 clocks: 16 values are judged, then written. It takes 125 more"),
    ("2.3 characters; with FORMAT bit 2 (PAUSE) 1.75 ms", "docs/host/bus.md", "A host may pause for 2.3 characters inside a frame"),
    ("1.75 ms at any speed", "docs/host/bus.md", "bit 2 (PAUSE) set: up to 1.75 ms"),
    ("4 to 256 bytes", "docs/chip/blocks/uartc.md", "it has 4 to 256 bytes"),
    ("-3.5 0 3.5 % Held by test", "docs/chip/blocks/uartc.md", "the tests hold 3.5 % in both directions"),
    ("first start bit comes after the full 3.5 characters", "docs/chip/blocks/uartc.md", "its first start bit comes after the full 3.5 characters"),
    ("function, length, address, value, lock, busy, state", "docs/chip/blocks/paramc.md", "| state | Run not allowed"),
    ("samples spi_miso_i h - 3 clocks behind each rising edge", "docs/chip/blocks/sensc.md", "that is the pin h - 3 clocks after that edge"),
    ("at the second rising edge after", "rtl/tc_rst_sync.sv", "rises at the second clock edge after rst_ni has risen"),
    ("High and low", "spec/chip.toml", "A pulse lasts two clocks or more"),
    ("holds Q2 for about 1 ms", "docs/chip/protection.md", "(1 ms in the virtual printer)"),
    ("polynomial 0xA001 reflected, start 0xFFFF", "spec/generate.py", "crc = 0xFFFF"),
)


def told() -> None:
    """What is typed in a template stands in a page or file beside it, which has its own test; so do the numbers of each limitation."""
    sheet = plain(re.sub(r"<style>.*?</style>", "", SHEET.read_text(encoding="utf-8"), flags=re.DOTALL))
    for text, file, source in TOLD:
        assert text in sheet, f"found no '{text}' in the sheet"
        said = " ".join(line.lstrip("/# ") for line in (ROOT / file).read_text(encoding="utf-8").splitlines())
        assert source in " ".join(said.split()), f"{file}: found no '{source}', expected it, as the sheet says '{text}'"
    notes = tomllib.loads((ROOT / "docs/datasheet/notes.toml").read_text(encoding="utf-8"))
    for limitation in notes["limitation"]:
        page = (ROOT / "docs" / limitation["page"]).read_text(encoding="utf-8")
        for number in re.findall(r"\d+(?:\.\d+)?", limitation["what"]):
            assert re.search(rf"(?<![\d.]){re.escape(number)}(?![\d.]*\d)", page), f"docs/{limitation['page']}: found no {number}, expected it: {limitation['what']}"


def output(*command: object) -> str:
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, check=True).stdout


def pages() -> None:
    """No page is empty, nothing is cut at an edge or too small to read, and each has its number."""
    count = int(re.search(r"Pages:\s+(\d+)", output("pdfinfo", PDF))[1])
    assert 15 <= count <= 40, count
    texts = output("pdftotext", "-layout", PDF, "-").split("\f")[:count]
    for number, text in enumerate(texts, 1):
        assert len(text.split()) > 80, f"page {number}: found {len(text.split())} words, expected a full page"
        assert f"page {number} of {count}" in " ".join(text.split()), f"page {number} has no number"
    boxes = output("pdftotext", "-bbox", PDF, "-")
    for number, page in enumerate(re.findall(r"<page.*?</page>", boxes, re.DOTALL), 1):
        width, height = (float(value) for value in re.match(r'<page width="([\d.]+)" height="([\d.]+)"', page).groups())
        for box, word in re.findall(r"<word (.*?)>(.*?)</word>", page):
            left, top, right, bottom = (float(value) for value in re.findall(r'"([-\d.]+)"', box))
            assert 40 < left and right < width - 40 and 20 < top and bottom < height - 20, f"page {number}: {word} at {left}..{right}, {top}..{bottom} is cut"
            assert max(bottom - top, right - left if len(word) < 3 else 0) > 5.5, f"page {number}: {word} is {bottom - top:.1f} points high"


def links() -> None:
    """Each link within the sheet leads somewhere, in the page and in the PDF; no other file is loaded."""
    text = SHEET.read_text(encoding="utf-8")
    names = re.findall(r' id="([^"]+)"', text)
    assert len(names) == len(set(names)), "an id stands twice"
    targets = set(re.findall(r'href="([^"]*)"', text))
    assert len(targets) > 100 and all(target[0] == "#" for target in targets), targets
    assert {target[1:] for target in targets} <= set(names), {target[1:] for target in targets} - set(names)
    there = {line.split('"')[1] for line in output("pdfinfo", "-dests", PDF).splitlines() if '"' in line}
    assert {target[1:] for target in targets} <= there, {target[1:] for target in targets} - there
    assert not re.search(r'(src|xlink:href)="|url\(|@import', text), "found a file that is loaded, expected all in one"


if __name__ == "__main__":
    {test.__name__: test for test in (everything, figures, changed_reset, no_task, lengths, moved_edge, told, pages, links)}[sys.argv[2]]()
