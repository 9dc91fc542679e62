#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""summary.py FOLDER TOP PERIOD_NS CORNER...: what the flow has found, from the files of FOLDER/TOP and FOLDER/*.

Writes summary.txt, summary.json and summary.html into FOLDER/TOP. A step that has not been run is left out; of one that has, a check that is missing
is told. Exits with 1 when a check is missing, a layout has errors or misses its timing.
"""
import json
import pathlib
import re
import sys

import jinja2

PAPER_DIE_UM2 = 740 * 740  # Xie et al. 2023, fig. 13: the whole die in a 0.13 um process

PAGE = jinja2.Template("""<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>{{ top }} in {{ tech }}</title>
<style>
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 60rem; margin: 2rem auto; padding: 0 1rem }
table { border-collapse: collapse; margin: 0.5rem 0 1.5rem } th, td { padding: 0.2rem 1rem 0.2rem 0; text-align: left; border-bottom: 1px solid #ddd }
td.figure { text-align: right; font-variant-numeric: tabular-nums } img { max-width: 100%; border: 1px solid #ddd }
</style>
<h1>{{ top }} in {{ tech }}</h1>
{% for table in tables %}<h2>{{ table.title }}</h2>
<table>{% for row in table.rows %}<tr><td>{{ row.what }}</td><td class="figure">{{ row.value }}</td><td>{{ row.unit }}</td></tr>
{% endfor %}</table>
{% endfor %}{% if picture %}<h2>Layout</h2>
<p>Metal layers as routed, over the cells.</p><img src="{{ picture }}" alt="Layout of {{ top }}">
{% endif %}</html>
""", autoescape=True)

RUNS = {"busy": "a busy recorded run", "heat-up": "0.1 s of a job's heat-up", "print": "0.1 s of its printing"}  # as the Makefile calls them

VARIED = "on-chip variation of 5 %"  # told, not asked for

MISSING = "not there"

NONE_ALLOWED = re.compile(r"nets not routed|open nets|nets in conflict|antenna rules broken|pins without access|cells with crowded pins|(DRC|LVS) errors|mismatches in Icarus|placement errors")


def text_of(path):
    return path.read_text(encoding="utf-8") if path.exists() else ""


def is_newer(path, source):
    return path.exists() and source.exists() and path.stat().st_mtime >= source.stat().st_mtime


def text_if_newer(path, source):
    """What is told of an earlier netlist is not told of this one."""
    return text_of(path) if is_newer(path, source) else ""


def cells(path):
    """Cell counts and area of a Yosys report."""
    text = text_of(path)
    counts = {kind: int(number) for kind, number in re.findall(r"^ +(\w+) +(\d+)$", text, re.M)}
    area = re.search(r"Chip area for module .*: ([\d.]+)", text)
    return counts, float(area.group(1)) if area else None


def slacks(path):
    """Setup and hold slack of an OpenSTA report, in its order; None where it found no path."""
    found = {}
    for part in re.split(r"^== ", text_of(path), flags=re.M)[1:]:
        slack = re.search(r"(-?[\d.]+) +slack", part)
        found[part.split()[0]] = float(slack.group(1)) if slack else None
    return found


def row(what, value, unit="", **limits):
    """`limits`: the `least` or the `most` that is good."""
    return {"what": what, "value": value, "unit": unit, **limits}


def is_bad(r):
    if r["value"] != MISSING and ("least" in r or "most" in r):
        return r["value"] < r.get("least", r["value"]) or r["value"] > r.get("most", r["value"])
    return r["value"] == MISSING or NONE_ALLOWED.match(r["what"]) and r["value"] not in (0, "0")


def proof_row(what, proof, of):
    """What `of` was made to be, against what it is made from."""
    return row(what, "proved" if "Networks are equivalent" in text_if_newer(proof, of) else MISSING)


def corner_rows(folder, of, period_ns, corners):
    """Setup and hold of each corner; a corner without them is told."""
    for corner in corners:
        path = folder / f"timing_{corner}.txt"
        rows = timing_rows(corner, path, period_ns, least=0) if is_newer(path, of) else []
        yield from rows or [row(f"setup slack, {corner}", MISSING)]


def timing_rows(name, path, period_ns, **limits):
    found = slacks(path)
    if found.get("setup") is None:
        return []
    rows = [row(f"setup slack, {name}", found["setup"], f"ns of {period_ns:g}", **limits),
            row(f"highest clock, {name}", round(1000 / (period_ns - found["setup"]), 1), "MHz")]
    if found.get("hold") is not None:
        rows.append(row(f"hold slack, {name}", found["hold"], "ns", **limits))
    rows += [row(f"{check} slack, {name}, {VARIED}", found[f"{check}_varied"], "ns") for check in ("setup", "hold") if found.get(f"{check}_varied") is not None]
    edge = re.search(r"^max_transition\n.*?^\S+ +([\d.]+) +([\d.]+) +-?[\d.]+ \(", text_of(path), re.M | re.S)
    if edge:
        allowed, slowest = map(float, edge.groups())
        rows.append(row(f"slowest edge, {name}", slowest, f"ns of {allowed:g} allowed", most=allowed))
    return rows


def netlist_rows(folder):
    counts, area = cells(folder / "area.txt")
    flops = sum(number for kind, number in counts.items() if re.search(r"df[a-z]*r|DFF", kind))
    gates = sum(number for kind, number in counts.items() if re.search(r"lgcp", kind))
    rows = [row("cells", sum(counts.values())), row("of them flops", flops)]
    if gates:
        rows.append(row("of them clock gates", gates))
    rows += [row("area of the cells", round(area), "um2"),
             row("of the paper's whole die (547,600 um2)", round(100 * area / PAPER_DIE_UM2, 1), "%")]
    return rows + [proof_row("RTL's gates = netlist", folder / "equivalence.txt", folder / "netlist.v")]


def run_rows(text):
    """A netlist over recorded pins."""
    replay = re.search(r"(\d+) clocks, (\d+) mismatches", text)
    return [row(f"mismatches with the model's pins, {replay.group(1)} clocks", int(replay.group(2)))] if replay else []


def power_rows(text):
    """What the routed chip drew in such a run (power.py), with its wires."""
    power = {name: float(total) for name, total in
             re.findall(r"^(logic|flops|clock tree|clock gates|clock pin|leakage|Total) .*?(\S+)(?: +\S+ mA.*)?$", text, re.M)}
    rows = [row(f"{name.lower()} power at 12 MHz", round(1e3 * watts, 4), "mW") for name, watts in power.items()]
    return rows + [row(f"current at 12 MHz and {volts} V, no glitches", float(current), "mA") for current, volts in re.findall(r"(\S+) mA at (\S+) V", text)]


def placement_rows(folder, period_ns, corners):
    """What the placer wrote (what, value and unit, parted by tabs), the proof, and timing with the clock through its tree."""
    placed = folder / "placed"
    told = [line.split("\t") for line in text_of(placed / "place.txt").splitlines()]
    rows = [row(what, json.loads(value) if re.fullmatch(r"\d+(\.\d+)?", value) else value, unit) for what, value, unit in told]
    if folder.name == "tc_top":
        rows += [row("the core of the paper's whole die", round(100 * float(value) / PAPER_DIE_UM2, 1), "%") for what, value, _ in told if what == "area of the core (rows)"]
    if not told:
        return []
    place = placed / "place.txt"
    checks = [proof_row("RTL's gates = what is placed", placed / "equivalence.txt", place), *corner_rows(placed, place, period_ns, corners)]
    is_routed = is_newer(folder / "routed/route.txt", place)  # then what stands there counts
    return rows + [r for r in checks if r["value"] != MISSING or not is_routed]


def layout_rows(folder, period_ns):
    layout = folder / "layout"
    if not (layout / "route.txt").exists():
        return []
    area = re.search(r"DIEAREA \( (-?\d+) (-?\d+) \) \( (-?\d+) (-?\d+) \)", text_of(layout / "place.txt"))
    x0, y0, x1, y1 = (int(v) / 100 for v in area.groups())
    rows = [row("laid out", f"{x1 - x0:.0f} x {y1 - y0:.0f}", "um"),
            row("utilisation", round(100 * cells(folder / "area.txt")[1] / ((x1 - x0) * (y1 - y0)), 1), "%"),
            row("nets not routed", 0 if "No failed routes" in text_of(layout / "route.txt") else "some"),
            row("DRC errors", int(re.search(r"drc *= *(\d+)", text_of(layout / "drc.txt")).group(1))),
            row("LVS errors", int(re.search(r"Total errors = (\d+)", text_of(layout / "lvs.txt")).group(1)))]
    routed = layout / "routed.v"
    rows += [proof_row("RTL's gates = what is routed", layout / "equivalence.txt", routed),
             *(timing_rows("routed", layout / "timing.txt", period_ns, least=0) or [row("setup slack, routed", MISSING)])]
    return rows + replay_rows(layout, routed)


def replay_rows(folder, of):
    replay = re.search(r"(\d+) clocks of ([\d.]+) ns, (\d+) mismatches", text_if_newer(folder / "sdf.txt", of))
    if not replay:
        return [row("mismatches in Icarus with SDF", MISSING)]
    return [row(f"mismatches in Icarus with SDF, {replay.group(1)} clocks of {replay.group(2)} ns", int(replay.group(3)))]


def routing_rows(folder, period_ns, corners):
    """What the router wrote (what: value), rules and connectivity as KLayout found them, the proof, timing with the wires as drawn."""
    routed = folder / "routed"
    told = dict(re.findall(r"^([a-z ]+): (.*)$", text_of(routed / "route.txt"), re.M))
    if not told:
        return []
    rows = [row(what, int(told[what])) for what in ("nets", "pins without access", "cells with crowded pins", "open nets", "nets in conflict",
                                            "antenna rules broken", "antenna diodes", "vias") if what in told]
    rows += [row("wires", told["wires"].split(" mm")[0], "mm"), row("time of the router", told["time"].split()[0], "s")]
    for name, what in (("drc", "DRC errors"), ("lvs", "LVS errors")):
        errors = re.search(r"(\d+) errors$", text_if_newer(routed / f"{name}.txt", routed / "routed.def").strip())
        rows.append(row(what, int(errors.group(1)) if errors else MISSING))
    factory = re.search(r"(\d+) rules, (\d+) errors; of density: \d+$", text_if_newer(routed / "factory.txt", routed / "route.txt").strip())
    if factory:
        rows.append(row(f"DRC errors by the factory's {factory.group(1)} rules, density apart", int(factory.group(2))))
    rows += [proof_row("RTL's gates = what the metal connects", routed / "equivalence.txt", routed / "route.txt"),
             *corner_rows(routed, routed / "route.txt", period_ns, corners)]
    return rows + replay_rows(routed, routed / "routed.v")


def power_tables(folder):
    """A table for each run that the routed chip was replayed over."""
    routed = folder / "routed"
    runs = [(run, text_if_newer(routed / f"power/{run}.replay", routed / "route.txt"), text_if_newer(routed / f"power/{run}.txt", routed / "route.txt")) for run in RUNS]
    return [(f"The routed chip over {RUNS[run]}", run_rows(replay) + power_rows(power)) for run, replay, power in runs]


def block_rows(folder):
    areas = {path.parent.name: cells(path)[1] for path in folder.glob("*/area.txt") if path.parent.name != "tc_top"}
    return [row(block, round(area), "um2") for block, area in sorted(areas.items(), key=lambda item: -item[1])]


def feature_rows(folder):
    path = folder / "features.json"
    if not path.exists():
        return []
    features = json.loads(text_of(path))["features"]
    return [row(f"{f['feature']} ({f['block']})", round(f["area_um2"]), "um2") for f in sorted(features, key=lambda f: -f["area_um2"])]


def main(folder, top, period_ns, corners):
    own = folder / top
    tables = [("Netlist", netlist_rows(own)),
              ("Timing as mapped: weakest drivers, ideal clock, no wires", [r for c in corners for r in timing_rows(f"{c}, as mapped", own / f"timing_{c}.txt", period_ns)]),
              ("A recorded run", run_rows(text_if_newer(own / "replay.txt", own / "netlist.v"))),
              ("Placement, the clock through its tree, wires estimated", placement_rows(own, period_ns, corners)),
              ("Routing, wires as drawn", routing_rows(own, period_ns, corners)),
              ("Layout", layout_rows(own, period_ns)), *power_tables(own)]
    if top == "tc_top":
        tables += [("Area by block, each by itself", block_rows(folder)), ("What safety features cost", feature_rows(folder))]
    tables = [{"title": title, "rows": rows} for title, rows in tables if rows]
    picture = next((name for name in ("routed/layout.png", "layout/layout.png") if (own / name).exists()), None)
    lines = [f"{top} in {folder.name}"]
    for table in tables:
        lines += ["", table["title"]] + [f"  {r['what']:<58} {r['value']:>12} {r['unit']}".rstrip() for r in table["rows"]]
    outputs = {"summary.txt": "\n".join(lines) + "\n", "summary.json": json.dumps({"top": top, "tech": folder.name, "tables": tables}, indent=1),
               "summary.html": PAGE.render(top=top, tech=folder.name, tables=tables, picture=picture)}
    for name, text in outputs.items():
        part = own / (name + ".part")
        part.write_text(text, encoding="utf-8")
        part.rename(own / name)
    print(outputs["summary.txt"], end="")
    bad = [r["what"] for table in tables for r in table["rows"] if is_bad(r)]
    if bad:
        print(f"{top}: not good: {', '.join(bad)}", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]), sys.argv[2], float(sys.argv[3]), sys.argv[4:]))
