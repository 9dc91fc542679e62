#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""print_windows.py MELTSTAGE JOB.toml FLOPS.json SCAN.json FOLDER SECONDS: recordings for replay.cpp from the middle of a print.

Prints the job, takes so many seconds from the middle of its heat-up and of its printing, and writes FOLDER/heat-up.mvec and FOLDER/print.mvec,
the pins; beside them .scan: the model's flops at the first clock, as bits to be shifted into the scan chains, and
after the last clock, as bits that come out of them. FLOPS.json is the chip's flops under the RTL's names (synth.tcl), SCAN.json the chains (`meltstage dft scan`).
"""
import json
import pathlib
import shutil
import subprocess
import sys
import tomllib

SPEC = pathlib.Path(__file__).resolve().parents[2] / "spec/chip.toml"
CLOCK_HZ = tomllib.loads(SPEC.read_text(encoding="utf-8"))["chip"]["clk_hz"]
PHASES = ("heat-up", "print")


def read_flops(path):
    """The model's flops at a border: name -> value."""
    fields = (line.split() for line in path.read_text(encoding="utf-8").splitlines())
    return {f[1]: int(f[2], 16) for f in fields if f[0] == "flop"}


def places_of(flops_json, flops):
    """Cell -> (the RTL's flop, its bit, whether the cell holds it inverted)."""
    module = json.loads(pathlib.Path(flops_json).read_text(encoding="utf-8"))["modules"]["tc_top"]
    of_bit = {bit: (name, i + net.get("offset", 0)) for name, net in module["netnames"].items() if name in flops for i, bit in enumerate(net["bits"])}
    inverse = {cell["connections"]["A"][0]: of_bit[cell["connections"]["Y"][0]] for cell in module["cells"].values()
               if cell["type"] == "$_NOT_" and cell["connections"]["Y"][0] in of_bit}
    places = {}
    for name, cell in module["cells"].items():
        if cell["type"].startswith("$_DFF"):
            bit = cell["connections"]["Q"][0]
            places[name] = (*of_bit[bit], False) if bit in of_bit else (*inverse[bit], True)
    return places


def bits_of(chains, places, flops):
    """Of each chain what its flops hold, from its input on."""
    def held(cell):
        name, bit, inverted = places[cell]
        return (flops[name] >> bit & 1) ^ inverted
    return [[held(cell) for cell in chain] for chain in chains]


def columns(rows):
    """A line a clock: a character each chain, the last chain first."""
    return ["".join(str(bit) for bit in reversed(column)) for column in zip(*rows)]


def load_lines(held):
    longest = max(map(len, held))
    return [f"load {line}" for line in columns([[0] * (longest - len(bits)) + bits[::-1] for bits in held])]


def unload_lines(held):
    longest = max(map(len, held))
    return [f"unload {line}" for line in columns([bits[::-1] + ["-"] * (longest - len(bits)) for bits in held])]


def borders(job, phases, seconds):
    """First cycle and the one behind the last, of each phase's window."""
    at = []
    for name in PHASES:
        begin, end = next(((p["begin_s"], p["end_s"]) for p in phases if p["name"] == name), (0, 0))
        if end - begin <= seconds:
            print(f"{job}: found {end - begin:.3f} s of {name}, expected more than {seconds} s; take a longer job", file=sys.stderr)
            sys.exit(2)
        at += [round(((begin + end) / 2 + side * seconds / 2) * CLOCK_HZ) for side in (-1, 1)]
    return at


def run(*command):
    """Its own line says what was wrong."""
    if status := subprocess.run(command, stdout=subprocess.DEVNULL).returncode:
        sys.exit(status)


def main(meltstage, job, flops_json, scan_json, folder, seconds):
    folder = pathlib.Path(folder)
    windows = folder / "windows"
    run(meltstage, "print", job, "--rtl", "none", "--out", folder / "job")
    shutil.rmtree(windows, ignore_errors=True)  # of another build
    phases = json.loads((folder / "job/summary.json").read_text(encoding="utf-8"))["phases"]
    at = borders(job, phases, float(seconds))
    run(meltstage, "windows", "plan", folder / "job/pins.mvec", windows, "--borders", ",".join(map(str, at)))
    chains = [chain["cells"] for chain in json.loads(pathlib.Path(scan_json).read_text(encoding="utf-8"))["chains"]]
    for phase, window in zip(PHASES, (1, 3)):
        before, after = (read_flops(windows / f"states/{n:06}.state") for n in (window, window + 1))
        places = places_of(flops_json, before)
        shutil.copyfile(windows / f"stimulus/{window:06}.mvec", folder / f"{phase}.mvec")
        scan_lines = [*load_lines(bits_of(chains, places, before)), *unload_lines(bits_of(chains, places, after))]
        (folder / f"{phase}.scan").write_text("\n".join(scan_lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
