#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""sdf_replay.py REFERENCE.il NETLIST.v DELAYS.sdf TOP CELLS.v PERIOD_NS [PORT=VALUE]...: a netlist with its delays beside RTL's gates in Icarus.

Both get the same random inputs just after each rising edge, at the sign-off period; outputs are compared just before the next. Delays of
wires are put into the paths behind them (fold_wires.py).
PORT=0 and PORT=1 hold an input, all bits of it; PORT=- leaves an output out. An unknown on an output is a mismatch. Prints the clocks and
mismatches; exits with 1 when there are mismatches, with 2 and one line on wrong use or files that don't fit.
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import fold_wires

CLOCKS = 2000

BENCH = """`timescale 1ns / 1ps
module bench;
  reg clk_i = 0;
{regs}
{wires}
  {top} routed ({routed});
  reference gates ({gates});
  integer clocks = 0, mismatches = 0, seed = {seed};
  initial begin
    $sdf_annotate("{sdf}", routed);
    rst_ni = 1;  // an edge: gates written as processes see no level
    #{period} rst_ni = 0;
    #(2 * {period});
    rst_ni = 1;
    while (clocks < {clocks}) begin
      #({period} * 0.1);
{drive}
      #({period} * 0.85);
      clocks = clocks + 1;
      if ({differs}) begin
        mismatches = mismatches + 1;
        if (mismatches <= 3) $display("clock %0d: an output differs", clocks);
      end
      #({period} * 0.05) clk_i = 1;
      #0.001;
      fork
        #({period} * 0.5) clk_i = 0;
      join_none
    end
    $display("%0d clocks of {period} ns, %0d mismatches", clocks, mismatches);
    $finish;
  end
endmodule
"""


def refuse(reason):
    print(f"sdf_replay.py: {reason}", file=sys.stderr)
    sys.exit(2)


def run(command, **options):
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if done.returncode:
        said = (done.stderr or done.stdout).strip() or f"exit status {done.returncode}"
        refuse(f"{command[0]} failed: {said.splitlines()[-1]}")
    return done.stdout


def main(reference, netlist, delays, top, cells, period, *ports_as, seed=1):
    for item in ports_as:
        if not re.fullmatch(r"[^=]+=[01-]", item):
            refuse(f"found {item}, expected PORT=0, PORT=1 or PORT=-")
    if not re.fullmatch(r"\d*\.?\d+", period) or float(period) == 0:
        refuse(f"PERIOD_NS: found {period}, expected a number above 0")
    for path in (reference, netlist, delays, cells):
        if not pathlib.Path(path).is_file():
            refuse(f"{path}: not there, expected a file")
    ports_as = dict(item.split("=") for item in ports_as)
    with tempfile.TemporaryDirectory() as folder:
        return replay(pathlib.Path(folder), reference, netlist, delays, top, cells, float(period), ports_as, seed)


def own_nets(netlist, cells):
    """The netlist with a net of its own for each further input of a cell at one net: Icarus keeps one delay path for a net at two inputs."""
    inputs = {module: {pin for pins in re.findall(r"^\s*input\s+([\w\s,]+);", body, re.M) for pin in re.findall(r"\w+", pins)}
              for module, body in re.findall(r"^\s*module (\w+)(.*?)^\s*endmodule", cells, re.M | re.S)}
    own = []

    def separated(instance):
        pins, seen, wires = [], set(), ""
        for pin, net in re.findall(r"\.(\w+)\(([^()]*)\)", instance[3]):
            if pin in inputs[instance[1]] and net.isidentifier():
                if net in seen:
                    own.append(f"own_{len(own)}_")
                    wires += f"  wire {own[-1]} = {net};\n"
                    net = own[-1]
                seen.add(net)
            pins.append(f".{pin}({net})")
        return f"{wires}  {instance[1]} {instance[2]} ({', '.join(pins)});\n"

    return re.sub(r"^ *(\w+) (\S+) \((\..*)\);\n", separated, netlist, flags=re.M)


def replay(work, reference, netlist, delays, top, cells, period, ports_as, seed):
    run(["yosys", "-q", "-p", f"read_rtlil {reference}; splitnets -ports -format _; write_json {work}/ports.json; "
         f"rename {top} reference; write_verilog -noattr {work}/reference.v"])
    with open(work / "ports.json", encoding="utf-8") as file:
        ports = json.load(file)["modules"][top]["ports"]

    def value(name):
        return ports_as.get(name, ports_as.get(re.sub(r"_\d+$", "", name)))

    inputs = [name for name, port in ports.items() if port["direction"] == "input" and name != "clk_i"]
    outputs = [name for name, port in ports.items() if port["direction"] == "output" and value(name) != "-"]
    stimuli = [name for name in inputs if name != "rst_ni" and value(name) is None]
    # test pins that scan insertion gave a block: the RTL's gates have none
    routed_text = pathlib.Path(netlist).read_text(encoding="utf-8")
    added = [name for name in re.findall(r"^\s*input (\w+);", routed_text, re.M) if name not in ports and value(name) in ("0", "1")]
    (work / "delays.sdf").write_text(fold_wires.folded(pathlib.Path(delays).read_text(encoding="utf-8"))[0], encoding="utf-8")
    (work / "bench.v").write_text(BENCH.format(
        top=top, period=period, clocks=CLOCKS, seed=seed, sdf=work / "delays.sdf",
        regs="\n".join(f"  reg {name} = {value(name) or 0};" for name in inputs),
        wires="\n".join(f"  wire routed_{name}, gates_{name};" for name in outputs),
        routed=", ".join([f".{n}({n})" for n in ["clk_i", *inputs]] + [f".{n}(1'b{value(n)})" for n in added]
                         + [f".{n}(routed_{n})" for n in outputs]),
        gates=", ".join([f".{n}({n})" for n in ["clk_i", *inputs]] + [f".{n}(gates_{n})" for n in outputs]),
        drive="\n".join(f"      {name} = $random(seed) >> 7;" for name in stimuli),
        differs=" || ".join(f"routed_{n} !== gates_{n}" for n in outputs)), encoding="utf-8")
    # Icarus looks for each cell of the SDF among all that stand beside it: without the fillers, which do nothing, these are a third.
    acting = re.sub(r"^\s*\w+ \S+ \(\s*\);\n", "", routed_text, flags=re.M)
    (work / "cells_that_act.v").write_text(own_nets(acting, pathlib.Path(cells).read_text(encoding="utf-8")), encoding="utf-8")
    # OpenSTA writes least and longest delays and leaves the typical ones out, which Icarus would take for none.
    run(["iverilog", "-g2012", "-gspecify", "-Tmax", "-s", "bench", "-o", str(work / "bench.vvp"), cells, str(work / "cells_that_act.v"),
         str(work / "reference.v"), str(work / "bench.v")])
    told = run(["vvp", "-n", str(work / "bench.vvp")])
    refused = re.search(r"^SDF (?:ERROR|WARNING).*$", told, re.M)
    if refused:
        refuse(f"{delays}: {refused.group(0)}")
    print("\n".join(line for line in told.splitlines() if "clock" in line))
    return 0 if ", 0 mismatches" in told else 1


if __name__ == "__main__":
    if len(sys.argv) < 7:
        refuse("expected REFERENCE.il NETLIST.v DELAYS.sdf TOP CELLS.v PERIOD_NS [PORT=VALUE]...")
    sys.exit(main(*sys.argv[1:]))
