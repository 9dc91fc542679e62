#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""mutated.py ROOT: copies of spec/ with a defect of chip.toml or presets.toml each: one line names file, key, what was found and expected; status 2."""
import contextlib
import importlib
import io
import pathlib
import random
import re
import shutil
import sys
import tempfile

LINE = re.compile(r"generate\.py: (chip|presets|registers)\.toml: [^\n]+, expected [^\n]+\n")

# file, what is replaced the first time it stands there, by what, what is told
CASES = [
    ("chip", "clk_hz = 12_000_000", "", r"\[chip\]: found no clk_hz, expected a whole number from 1000 to"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = \"12\"", r"\[chip\]: found clk_hz 12, expected a whole number"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = true", r"\[chip\]: found clk_hz True, expected a whole number"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = -1", r"\[chip\]: found clk_hz -1, expected"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = 12.5", r"\[chip\]: found clk_hz 12.5, expected"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = 1979-05-27", r"\[chip\]: found clk_hz 1979-05-27, expected"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = 0x" + "f" * 9000, r"\[chip\]: found clk_hz a number of 36000 bits, expected"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = " + "9" * 9000, r"found .*, expected a TOML file"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = " + "[" * 5000, r"found .*, expected a TOML file"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = 12\nclk_mhz = 3", r"\[chip\]: found clk_mhz, which nothing reads, expected one of name, clk_hz"),
    ("chip", "clk_hz = 12_000_000", "clk_hz = 12\nclk_hz = 13", r"found Cannot overwrite a value.*, expected a TOML file"),
    ("chip", "[chip]", "[chips]", r"found chips, which nothing reads, expected one of chip, modbus"),
    ("chip", "[chip]", "[[chip]]", r"found no \[chip\], expected it with name"),
    ("chip", "[autotune]", "[[function]]", r"found no \[autotune\]"),
    ("chip", "vendor = \"Meltstage\"", "vendor = \"Größe\"", r"\[chip\]: found vendor Größe, expected a text of 1 to 60 ASCII"),
    ("chip", "vendor = \"Meltstage\"", "vendor = \"\"", r"\[chip\]: found vendor , expected a text of 1 to 60"),
    ("chip", "vendor = \"Meltstage\"", "vendor = 3", r"\[chip\]: found vendor 3, expected a text"),
    ("chip", "product = \"TC1\"", "product = \"T\\u001b[31m\"", r"\[chip\]: found product T\\x1b\[31m, expected"),
    ("chip", "write_words = 16", "write_words = 12", r"\[chip\]: found write_words 12, expected 1, 2, 4, 8 or 16"),
    ("chip", "telemetry_words = 16", "telemetry_words = 60", r"\[chip\]: found telemetry_words 60, expected at most [0-9]+, the input registers"),
    ("chip", "holding_base = 0x0100", "holding_base = 3", r"\[modbus\]: found holding_base 3, expected a whole number from 64"),
    ("chip", "holding_base = 0x0100", "holding_base = \"0x100\"", r"\[modbus\]: found holding_base 0x100, expected a whole number"),
    ("chip", "max_read = 32", "", r"\[modbus\]: found no max_read, expected a whole number from 1 to 125"),
    ("chip", "name = \"ReadInput\"\ncode = 4", "name = \"ReadInput\"\ncode = 3", r"\[\[function\]\] ReadInput: found code 3 twice, as of number 1 too, expected each code once"),
    ("chip", "name = \"ReadInput\"", "name = \"ReadHolding\"", r"\[\[function\]\] ReadHolding: found name ReadHolding twice"),
    ("chip", "name = \"ReadInput\"\ncode = 4", "code = 4", r"\[\[function\]\] number 2: found no name, expected a name such as"),
    ("chip", "name = \"ReadInput\"", "name = \"Read Input\"", r"\[\[function\]\] Read Input: found name Read Input, expected a name such as"),
    ("chip", "name = \"8O1\"", "name = \"8-1\"", r"\[\[character\]\] 8-1: found name 8-1, expected"),
    ("chip", "name = \"8O1\"", "name = \"7O1\"", r"\[\[character\]\] 7O1: found name 7O1, expected a name such as 8E1"),
    ("chip", "name = \"8N1\"\ncode = 3", "name = \"8N1\"\ncode = 1", r"\[\[character\]\] 8N1: found code 1 twice"),
    ("chip", "[[character]]\nname = \"8N1\"\ncode = 3", "", r"found 3 \[\[character\]\], expected 4"),
    ("chip", "name = \"TimedOut\"\ncode = 4", "name = \"TimedOut\"\ncode = 3", r"\[\[tuning\]\] TimedOut: found code 3 twice"),
    ("chip", "name = \"uart_tx_o\"", "name = \"uart_tx\"", r"\[\[pin\]\] uart_tx: found name uart_tx, expected a name such as uart_rx_i, which ends in _i"),
    ("chip", "name = \"uart_tx_o\"", "name = \"o\"", r"\[\[pin\]\] o: found name o, expected"),
    ("chip", "name = \"uart_tx_o\"", "name = 5", r"\[\[pin\]\] number 3: found name 5, expected"),
    ("chip", "name = \"uart_tx_o\"", "name = \"uart_rx_o\"", r"\[\[pin\]\] uart_rx_o: found name uart_rx_o, which C\+\+ calls uart_rx as uart_rx_i"),
    ("chip", "name = \"drop_i\"", "name = \"class_i\"", r"\[\[pin\]\] class_i: found name class_i, of which class is a word of SystemVerilog"),
    ("chip", "width = 3\n", "width = 0\n", r"\[\[pin\]\] addr_strap_i: found width 0, expected a whole number from 1 to 8"),
    ("chip", "width = 3\n", "width = \"scan_chans\"\n", r"\[\[pin\]\] addr_strap_i: found width scan_chans, expected"),
    ("chip", "width = 3\n", "width = [3]\n", r"\[\[pin\]\] addr_strap_i: found width \[3\], expected"),
    ("chip", "width = 3\n", "width = 3\nasynch = true\n", r"\[\[pin\]\] addr_strap_i: found asynch, which nothing reads, expected one of name, idle"),
    ("chip", "async = true", "async = \"yes\"", r"\[\[pin\]\] uart_rx_i: found async yes, expected true or false"),
    ("chip", "name = \"heater_o\"\nidle = 0", "name = \"heater_o\"\nidle = 2", r"\[\[pin\]\] heater_o: found idle 2, expected a level of 1 bits"),
    ("chip", "name = \"heater_o\"\nidle = 0", "name = \"heater_o\"\nwidth = 2\nidle = 0", r"\[\[pin\]\] heater_o: found width 2, expected 1: an output"),
    ("chip", "name = \"heater_o\"\nidle = 0", "name = \"heater_o\"", r"\[\[pin\]\] heater_o: found no idle, expected"),
    ("chip", "doc = \"Into the chains.\"", "doc = \"Into | out\"", r"\[\[test_pin\]\] scan_i: found doc Into \| out, expected one line"),
    ("chip", "modelled = true", "modelled = 1", r"\[\[test_pin\]\] test_mode_i: found modelled 1, expected true or false"),
    ("chip", "code = 0b00011", "code = 0b00001", r"\[\[state\]\] CmdDecode: found code 00001 one bit from 00000 of Idle, expected two"),
    ("chip", "code = 0b00011", "code = 32", r"\[\[state\]\] CmdDecode: found code 32, expected a whole number from 0 to 31"),
    ("chip", "code = 0b00011", "code = \"00011\"", r"\[\[state\]\] CmdDecode: found code 00011, expected a whole number"),
    ("chip", "to = [\"CmdDecode\"]", "to = [\"CmdDecoed\"]", r"\[\[state\]\] Idle: found to CmdDecoed, expected names of states"),
    ("chip", "to = [\"CmdDecode\"]", "to = \"CmdDecode\"", r"\[\[state\]\] Idle: found to CmdDecode, expected a list of names"),
    ("chip", "to = [\"CmdDecode\"]", "", r"\[\[state\]\] Idle: found no to, expected a list of names"),
    ("chip", "frac = 6", "frac = \"6\"", r"\[\[format\]\] temp: found frac 6, expected a whole number"),
    ("chip", "bit = 1\n", "bit = 0\n", r"\[\[fault\]\] UnderTemp: found bit 0 twice"),
    ("chip", "bit = 14\n", "bit = 15\n", r"\[\[fault\]\] Inhibit: found bit 15 as number 15, expected 14"),
    ("chip", "latch = \"always\"", "latch = \"sometimes\"", r"\[\[fault\]\] OverTemp: found latch sometimes, expected always or run"),
    ("chip", "measured = [\"PV\"]", "measured = [\"PW\"]", r"\[\[fault\]\] OverTemp: found measured PW, expected names of input registers"),
    ("chip", "limits = [\"T_MAX\"]", "limits = [\"PV\"]", r"\[\[fault\]\] OverTemp: found limits PV, expected names of holding registers"),
    ("chip", "limits = [\"T_MAX\"]", "limits = [\"T_MAX\", \"T_MAX\"]", r"\[\[fault\]\] OverTemp: found limits T_MAX twice"),
    ("chip", "limits = [\"T_MAX\"]", "limits = [5]", r"\[\[fault\]\] OverTemp: found limits \[5\], expected a list of names"),
    ("chip", "next = \"Release", "nest = \"Release", r"\[\[fault\]\] Inhibit: found nest, which nothing reads"),
    ("chip", "code = 0xA501", "code = 0xA5F0", r"\[\[command\]\] ClearFault: found code 42480 twice"),
    ("chip", "code = 0xA501", "code = 0x1A501", r"\[\[command\]\] Run: found code 107777, expected a whole number from 0 to 65535"),
    ("chip", "measure_cycles = 4", "measure_cycles = 0", r"\[autotune\]: found measure_cycles 0, expected a whole number from 1"),
    ("chip", "measure_cycles = 4", "measure_cycles = 6", r"\[autotune\]: found 9 adapt_cycles and measure_cycles in all, expected at most 7"),
    ("chip", "ti_hold = 1.45", "ti_hold = 0", r"\[autotune\]: found ti_hold 0, expected a number from 0.001"),
    ("chip", "ti_hold = 1.45", "ti_hold = nan", r"\[autotune\]: found ti_hold nan, expected a number"),
    ("chip", "ti_hold = 1.45", "ti_hold = 0.001", r"\[autotune\]: found what makes ki_hold_factor 1024000, expected one above 0 of 18 bits"),
    ("chip", "kp = 0.337", "kp = \"high\"", r"\[autotune\]: found kp high, expected a number"),
    ("chip", "name = \"Inhibit\"", "name = \"Count\"", r"found an entry that makes the constant FaultCount twice in the RTL's package"),
    ("chip", "[autotune]", "[[preset]]\nname = \"X\"\n[autotune]", r"found preset, which nothing reads"),
    ("chip", "# SPDX", "\xff", r"found .*, expected a TOML file"),
    ("presets", "lsb = 18", "", r"\[\[preset\]\] MAX31855: found no lsb, expected a whole number from 0 to 31"),
    ("presets", "signed = true", "signed = \"no\"", r"\[\[preset\]\] MAX31855: found signed no, expected true or false"),
    ("presets", "code = 2", "code = 1", r"\[\[preset\]\] MAX6675: found code 1 twice"),
    ("presets", "code = 6", "code = 7", r"\[\[preset\]\] LM70: found code 7 as number 6, expected 6"),
    ("presets", "name = \"MAX6675\"", "name = \"MAX31855\"", r"\[\[preset\]\] MAX31855: found name MAX31855 twice"),
    ("presets", "length = 32", "length = 20", r"\[\[preset\]\] MAX31855: found lsb 18 and width 14, expected a field within the length of 20"),
    ("presets", "check_value = 0\n", "check_value = 1\n", r"\[\[preset\]\] MAX31855: found check_value 0x1, expected bits of check_mask 0x30008"),
    ("presets", "offset = -16384", "offset = -40000", r"\[\[preset\]\] MAX31865: found offset -40000, expected a whole number from -32768"),
    ("presets", "highest_degc = 1350.0", "highest_degc = inf", r"\[\[preset\]\] MAX31855: found highest_degc inf, expected a number"),
    ("presets", "highest_degc = 1350.0", "highest_degrees = 1350.0", r"\[\[preset\]\] MAX31855: found highest_degrees, which nothing reads"),
    ("presets", "[[preset]]", "[preset]", r"found .*, expected a TOML file"),
    ("presets", None, "preset = 3\n", r"found preset that is no list of entries, expected one or more \[\[preset\]\]"),
    ("presets", None, "preset = []\n", r"found preset that is no list of entries"),
    ("presets", None, "", r"found no \[\[preset\]\], expected one or more with name"),
    ("presets", None, "[[preset]]\n[[preset]]\n", r"\[\[preset\]\] number 1: found no name"),
    ("registers", "[[input]]", "[[inputs]]", r"found inputs, which nothing reads, expected \[\[input\]\] and \[\[holding\]\]"),
]


class Generator:
    """generate.py upon a copy of spec/, in this process."""

    def __init__(self, root: pathlib.Path, folder: pathlib.Path) -> None:
        sys.path.insert(0, str(root / "spec"))
        self.generate = importlib.import_module("generate")
        self.generate.SPEC = folder / "spec"
        shutil.copytree(root / "spec", folder / "spec")
        self.folder = folder
        self.texts = {name: (root / f"spec/{name}.toml").read_text(encoding="utf-8") for name in ("chip", "presets", "registers")}

    def run(self, name: str, text: str) -> tuple[int, str]:
        """Exit status and what is told."""
        for file, sound in self.texts.items():
            data = text if file == name else sound
            (self.folder / f"spec/{file}.toml").write_bytes(data.encode("latin-1" if "\xff" in data else "utf-8", "replace"))
        sys.argv = ["generate.py", "--out", str(self.folder / "out")]
        said = io.StringIO()
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
            status = self.generate.main()
        return status, said.getvalue()


def mutated(draw: random.Random, text: str) -> str:
    """A line left out, doubled or moved, or its value another one."""
    lines = text.splitlines()
    at = draw.choice([i for i, line in enumerate(lines) if line.strip() and not line.startswith("#")])
    kind = draw.randrange(4)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(draw.randrange(len(lines)), lines[at])
    elif kind == 2:
        lines.insert(draw.randrange(len(lines)), lines.pop(at))
    else:
        value = draw.choice(['""', '"x"', "-1", "0", "1e9", "true", "[]", '["PV"]', "{}", "[[1]]", "nan", "70000", "'\\\\'", "07:32:00"])
        lines[at] = lines[at].split("=")[0] + "= " + value
    return "\n".join(lines) + "\n"


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        generator = Generator(root, pathlib.Path(name))
        status, said = generator.run("chip", generator.texts["chip"])
        assert status == 0, said
        for file, old, new, told in CASES:
            text = generator.texts[file]
            assert old is None or old in text, f"{file}.toml: no {old}"
            status, said = generator.run(file, new if old is None else text.replace(old, new, 1))
            if status != 2 or not LINE.fullmatch(said) or not re.match(rf"generate\.py: {file}\.toml: {told}", said):
                bad += 1
                print(f"{file}.toml with {new[:60]!r} for {str(old)[:60]!r}: status {status}, {said}expected {told}", file=sys.stderr)
        draw = random.Random(1)
        for _ in range(100):
            file = draw.choice(["chip", "presets", "registers"])
            text = mutated(draw, generator.texts[file])
            status, said = generator.run(file, text)
            if status not in (0, 2) or status == 2 and not LINE.fullmatch(said):
                bad += 1
                print(f"said {said!r} of a mutated {file}.toml", file=sys.stderr)
    print(f"{len(CASES)} defects, {bad} told otherwise than in one line")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
