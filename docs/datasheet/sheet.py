#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the chip's data sheet as one HTML file, which weasyprint prints.

Usage: sheet.py --runs DIR --out FILE [--spec DIR]
DIR of --runs: traces and waves of scenarios/*.txt by `meltstage chip play`; DIR of --spec: the specification, default spec/
Exit status: 0 written, 2 for an input that can't be used, in one line.
"""
import argparse
import html
import itertools
import pathlib
import re
import subprocess
import sys
import tomllib

import jinja2

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.dont_write_bytecode = True
sys.path[:0] = [str(HERE), str(ROOT / "spec")]

import generate  # the one reader of spec/
import figures
import tables
from waves import Waves

SECTIONS = ("pins", "ratings", "functions", "protection", "communication", "timing", "registers", "tasks", "curves", "application", "limits",
            "ordering")


def capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def unit_text(unit: str) -> str:
    return {"degC": "°C", "degC/s": "°C/s", "us": "µs"}.get(unit, unit)


class Sheet:
    """What the templates ask for."""

    def __init__(self, spec: dict, runs: pathlib.Path) -> None:
        self.spec = spec
        self.notes = tomllib.loads((HERE / "notes.toml").read_text(encoding="utf-8"))
        self.registers = {reg["name"]: reg for reg in spec["input"] + spec["holding"]}
        self.timing = figures.Timing(Waves(runs / "timing.vcd", spec["chip"]["clk_hz"]), spec, self.registers)
        self.curves = figures.Curves(runs, spec["fault"])

    def amount(self, name: str, key: str) -> str:
        """A register's value in its unit: 12.5 °C."""
        reg = self.registers[name]
        value = reg[key] * reg["scale_value"]
        return f"{value:,.4g} {unit_text(reg['unit'])}".strip() if abs(value) < 10000 else f"{value:,.0f} {unit_text(reg['unit'])}"

    def register_ref(self, name: str) -> str:
        return f'<a href="#register-{self.registers[name]["name"]}">{name}</a>'

    def pin_ref(self, name: str) -> str:
        return f'<a href="#pin-{name}"><code>{name}</code></a>'

    def us(self, clocks: float) -> str:
        return f"{clocks / self.spec['chip']['clk_hz'] * 1e6:,.2f}"

    def parts(self, reg: dict) -> dict:
        """A register with its bits, highest first."""
        rows = [{"bits": str(i), "name": name, "doc": "", "reset": ""} for i, name in enumerate(reg.get("bits", []))]
        notes = self.notes["fields"].get(reg["name"], {})
        if unknown := set(notes) - {field["name"] for field in reg["fields"]}:
            raise ValueError(f"docs/datasheet/notes.toml: found {reg['name']}.{unknown.pop()}, expected a field of spec/registers.toml")
        for field in reg["fields"]:
            low, high = field["bit"], field["bit"] + field["width"] - 1
            rows.append({"bits": str(low) if low == high else f"{high}..{low}", "name": field["name"], "doc": capital(notes.get(field["name"], field.get("doc", ""))),
                         "reset": reg["reset_word"] >> low & (1 << field["width"]) - 1 if "reset" in reg else ""})
        rows.sort(key=lambda row: -int(row["bits"].split("..")[-1]))
        return reg | {"parts": rows, "documented": any(row["doc"] for row in rows)}

    def spi_hz(self) -> dict[str, str]:
        def khz(divider: int) -> str:
            return f"{self.spec['chip']['clk_hz'] / (2 * (divider + 1)) / 1000:,.5g}"
        reg = self.registers["SPI_DIV"]
        return {"least": khz(reg["max"]), "reset": khz(reg["reset"]), "most": khz(reg["min"])}

    def pwm_hz(self) -> str:
        clocks = self.registers["PWM_PERIOD"]["reset"] * (self.registers["PWM_PRESCALE"]["reset"] + 1)
        return f"{self.spec['chip']['clk_hz'] / clocks:,.5g}"

    def tasks(self) -> list[dict]:
        """Of tasks.toml; each register of the map stands in one at least, and no other name."""
        tasks = tomllib.loads((HERE / "tasks.toml").read_text(encoding="utf-8"))["task"]
        named = {name for task in tasks for step in task["steps"] for name in step["registers"]}
        if wrong := named ^ set(self.registers):
            raise ValueError(f"docs/datasheet/tasks.toml: found {', '.join(sorted(wrong))} in a task or in spec/registers.toml alone, "
                             "expected each register in both")
        commands = {command["name"] for command in self.spec["command"]}
        if wrong := {step.get("command") for task in tasks for step in task["steps"]} - commands - {None}:
            raise ValueError(f"docs/datasheet/tasks.toml: found the command {', '.join(wrong)}, expected one of spec/chip.toml")
        return tasks

    def context(self) -> dict:
        spec, notes = self.spec, self.notes
        counts = {"max_read": spec["modbus"]["max_read"], "write_words": spec["chip"]["write_words"]}
        frames = {name: [text.format(**counts) for text in texts] for name, texts in notes["frames"].items()}
        clock_hz = spec["chip"]["clk_hz"]
        version = spec["chip"]["version"]
        power = tables.table("make/silicon.md", "|printing")
        return spec | self.timing.context() | {
            "amount": self.amount, "register_ref": self.register_ref, "pin_ref": self.pin_ref, "us": self.us, "register": self.registers,
            "style": (HERE / "print.css").read_text(encoding="utf-8"),
            "spec_date": spec_date(), "map_version": f"{version >> 8}.{version & 255}",
            "two_clocks": f"{2 / clock_hz * 1e6:.2f}", "clock_ns": f"{1e9 / clock_hz:.2f}", "enable_hz": f"{clock_hz / 2 / self.timing.pulses.enable:,.0f}",
            "pwm_hz": self.pwm_hz(), "spi_hz": self.spi_hz(),
            "bus_tolerance": tables.value("host/bus.md", "rate", "115 200 Bd"),
            "sta": {row[0]: row for row in tables.table("make/silicon.md", "timing for a clock of 20 ns")},
            "power": {row[0]: row[1:] for row in power},
            "acts_after": {row[0]: row[3] for row in tables.table("chip/protection.md", "fault")},
            "plant": next(row for row in tables.table("chip/control.md", "plant") if row[0].startswith("PH-1")),
            "frames": frames, "limitations": notes["limitation"], "tasks": self.tasks(),
            "with_fields": [self.parts(reg) for reg in spec["input"] + spec["holding"] if reg["fields"] or "bits" in reg],
            "curve": self.curves.numbers(), "figures": self.timing.drawn() | self.curves.drawn() | figures.still(spec),
        }


def spec_date() -> str:
    """Of the last change of spec/, as git knows it."""
    call = ["git", "-C", str(ROOT), "log", "-1", "--format=%cd", "--date=format:%d %B %Y", "--", "spec"]
    try:
        date = subprocess.run(call, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        date = ""
    return date or "date unknown: built outside of a checkout"


def numbered(body: str) -> tuple[str, str]:
    """The body with numbers before its headings, and the list of contents."""
    section = [0, 0]
    entries = []

    def heading(found: re.Match) -> str:
        level, name, title = int(found[1]), found[2], found[3]
        section[:] = [section[0] + 1, 0] if level == 2 else [section[0], section[1] + 1]
        number = str(section[0]) if level == 2 else f"{section[0]}.{section[1]}"
        entries.append(f'<li class="level{level}"><a href="#{name}">{number} {title}</a></li>')
        return f'<h{level} id="{name}">{number} {title}</h{level}>'

    body = re.sub(r'<h([23]) id="([\w-]+)">(.*?)</h\1>', heading, body)
    return body, "<ol>" + "".join(entries) + "</ol>"


def counted(page: str) -> str:
    """With numbers before the titles of figures and tables."""
    for tag, word in (("figcaption", "Figure"), ("caption", "Table")):
        counter = itertools.count(1)
        page = re.sub(f"<{tag}>", lambda _: f"<{tag}><b>{word} {next(counter)}.</b> ", page)
    return page


def typeset(body: str) -> str:
    """Units and powers as print has them."""
    body = body.replace("degC", "°C").replace(" ohm", " Ω")
    return re.sub(r"2\^(-?\d+)", lambda found: f"2<sup>{found[1].replace('-', '−')}</sup>", body)


def render(context: dict) -> str:
    # The specification's texts are plain; what is markup in a template is marked there.
    env = jinja2.Environment(loader=jinja2.FileSystemLoader(HERE / "templates"), undefined=jinja2.StrictUndefined, trim_blocks=True,
                             lstrip_blocks=True)
    env.filters["register_ref"] = context["register_ref"]
    body = "".join(f'<section class="main">{env.get_template(name + ".html.j2").render(context)}</section>\n' for name in SECTIONS)
    body, contents = numbered(body)
    page = env.get_template("sheet.html.j2").render(context | {"body": body, "contents": contents})
    return typeset(counted(page))


def escaped(value: object) -> object:
    """The texts of the specification as HTML has them."""
    if isinstance(value, str):
        return html.escape(value, quote=False)
    if isinstance(value, list):
        return [escaped(entry) for entry in value]
    if isinstance(value, dict):
        return {key: escaped(entry) for key, entry in value.items()}
    return value


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=pathlib.Path, required=True, help="folder of the traces and waves")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="HTML file to write")
    parser.add_argument("--spec", type=pathlib.Path, default=ROOT / "spec", help="folder of the specification")
    args = parser.parse_args()
    generate.SPEC = args.spec.resolve()
    try:
        text = render(Sheet(escaped(generate.load()), args.runs).context())
        args.out.parent.mkdir(parents=True, exist_ok=True)
        args.out.write_text(text, encoding="utf-8")
    except OSError as error:
        print(f"sheet.py: {error.filename}: found {error.strerror}, expected a file", file=sys.stderr)
        return 2
    except (generate.SpecError, ValueError, KeyError, jinja2.TemplateError) as error:
        print(f"sheet.py: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
