#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""sdf_replay.py REFERENCE.il NETLIST.v DELAYS.sdf TOP CELLS.v PERIOD_NS [--clock PORT] [--reset PORT=LEVEL|none] [PORT=VALUE]...

A netlist with its delays beside RTL's gates in Icarus. Both begin with the same random bit in each flop, as flops without a reset do on a die, go
through a reset of some clocks (LEVEL is what asserts it) and get the same random inputs just after each rising edge, at the sign-off
period; outputs are compared just before the next. Delays of wires are put into the paths behind them (fold_wires.py).
PORT=0 and PORT=1 hold an input, all bits of it; PORT=- leaves an output out. An unknown on an output is a mismatch. Prints the clocks and
mismatches; exits with 1 when there are mismatches, with 2 and one line on wrong use or files that don't fit.
"""
import argparse
import json
import pathlib
import random
import re
import subprocess
import sys
import tempfile

import fold_wires

CLOCKS = 2000
RESET_CLOCKS = 8
MOST_TOLD = 5  # outputs that differ

TELL = """        if (told < {most} && (routed_{output} !== gates_{output} || gates_{output} === 1'bx)) begin
          told = told + 1;
          $display("clock %0d: {output} is %b, expected %b", clocks, routed_{output}, gates_{output});
        end"""

# From inactive to asserted is an edge: gates written as processes see no level.
RESET = """    {port} = {asserted};
    repeat ({clocks}) begin
      #({period} * 0.5) {clock} = 1;
      #({period} * 0.5) {clock} = 0;
    end
    #({period} * 0.5) {port} = !{asserted};
    #({period} * 0.5);"""

BENCH = """`timescale 1ns / 1ps
module bench;
  reg {clock} = 0;
{regs}
{wires}
  {top} routed ({routed});
  reference gates ({gates});
  integer clocks = 0, mismatches = 0, told = 0, seed = {seed};
  initial begin
    $sdf_annotate("{sdf}", routed);
    #({period} * 0.5);
{state}
    #({period} * 0.5);
{reset}
    while (clocks < {clocks}) begin
      #({period} * 0.1);
{drive}
      #({period} * 0.85);
      clocks = clocks + 1;
      if ({differs}) begin
        mismatches = mismatches + 1;
{tell}
      end
      #({period} * 0.05) {clock} = 1;
      #0.001;
      fork
        #({period} * 0.5) {clock} = 0;
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


class Arguments(argparse.ArgumentParser):
    def error(self, message):
        refuse(f"{message}; expected REFERENCE.il NETLIST.v DELAYS.sdf TOP CELLS.v PERIOD_NS [--clock PORT] [--reset PORT=LEVEL|none] [PORT=VALUE]...")


def arguments(words):
    parser = Arguments(add_help=False)
    for name in ("reference", "netlist", "delays", "top", "cells", "period"):
        parser.add_argument(name)
    parser.add_argument("--clock", default="clk_i")
    parser.add_argument("--reset", default="rst_ni=0")
    parser.add_argument("held", nargs="*")
    given = parser.parse_intermixed_args(words)
    if not re.fullmatch(r"\d*\.?\d+", given.period) or float(given.period) == 0:
        refuse(f"PERIOD_NS: found {given.period}, expected a number above 0")
    for item in given.held:
        if not re.fullmatch(r"[^=]+=[01-]", item):
            refuse(f"found {item}, expected PORT=0, PORT=1 or PORT=-")
    if not re.fullmatch(r"[^=]+=[01]|none", given.reset):
        refuse(f"--reset: found {given.reset}, expected PORT=0, PORT=1 or none")
    for path in (given.reference, given.netlist, given.delays, given.cells):
        if not pathlib.Path(path).is_file():
            refuse(f"{path}: not there, expected a file")
    given.period = float(given.period)
    given.held = dict(item.split("=") for item in given.held)
    given.reset = dict([given.reset.split("=")] if "=" in given.reset else [])
    return given


def main(words):
    given = arguments(words)
    with tempfile.TemporaryDirectory() as folder:
        return replay(pathlib.Path(folder), given)


def in_verilog(name):
    return name if name.isidentifier() else f"\\{name} "


def flop_nets(module):
    """Names of each flop's output, those that are alike together."""
    names = {}
    for name, net in module["netnames"].items():
        for bit in net["bits"]:
            names.setdefault(bit, []).append(name)
    return [names[bit] for cell in module["cells"].values() if re.match(r"\$_(DFF|SDFF|ALDFF)", cell["type"]) for bit in cell["connections"]["Q"]]


def first_state(module, routed_text):
    """The same random bit on the output of each flop, until the first clock edge takes it in."""
    wires = {name.strip("\\") for name in re.findall(r"\.\w+\(\s*(\S+?)\s*\)", routed_text)}
    draw = random.Random(1)
    lines = []
    for names in flop_nets(module):
        of_routed = [name for name in names if name in wires]
        if not of_routed:
            refuse(f"found no net {names[0]} in the netlist, expected each flop's output under the name that the RTL has for it")
        value = draw.randrange(2)
        # under each name: all but one may be aliases, which take no value of their own
        lines += [f"    $deposit({side}.{in_verilog(name)}, 1'b{value});" for side, own in (("gates", names), ("routed", of_routed)) for name in own]
    return "\n".join(lines)


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


def replay(work, given):
    top, period, clock, held, reset = given.top, given.period, given.clock, given.held, given.reset
    run(["yosys", "-q", "-p", f"read_rtlil {given.reference}; splitnets -ports -format _; write_json {work}/ports.json; "
         f"rename {top} reference; write_verilog -noattr {work}/reference.v"])
    with open(work / "ports.json", encoding="utf-8") as file:
        module = json.load(file)["modules"][top]
    ports = module["ports"]
    for name in (clock, *reset):
        if ports.get(name, {}).get("direction") != "input":
            refuse(f"found no input {name}, expected the clock's and the reset's port; --clock PORT and --reset PORT=LEVEL|none name them")

    def value(name):
        return held.get(name, held.get(re.sub(r"_\d+$", "", name)))

    inputs = [name for name, port in ports.items() if port["direction"] == "input" and name != clock]
    outputs = [name for name, port in ports.items() if port["direction"] == "output" and value(name) != "-"]
    stimuli = [name for name in inputs if name not in reset and value(name) is None]
    # test pins that scan insertion gave a block: the RTL's gates have none
    routed_text = pathlib.Path(given.netlist).read_text(encoding="utf-8")
    added = [name for name in re.findall(r"^\s*input (\w+);", routed_text, re.M) if name not in ports and value(name) in ("0", "1")]
    (work / "delays.sdf").write_text(fold_wires.folded(pathlib.Path(given.delays).read_text(encoding="utf-8"))[0], encoding="utf-8")
    inactive = {port: 1 - int(level) for port, level in reset.items()}
    (work / "bench.v").write_text(BENCH.format(
        top=top, period=period, clock=clock, clocks=CLOCKS, seed=1, sdf=work / "delays.sdf", state=first_state(module, routed_text),
        reset="\n".join(RESET.format(port=port, asserted=f"1'b{level}", period=period, clock=clock, clocks=RESET_CLOCKS) for port, level in reset.items()),
        regs="\n".join(f"  reg {name} = {inactive.get(name, value(name) or 0)};" for name in inputs),
        wires="\n".join(f"  wire routed_{name}, gates_{name};" for name in outputs),
        routed=", ".join([f".{n}({n})" for n in [clock, *inputs]] + [f".{n}(1'b{value(n)})" for n in added]
                         + [f".{n}(routed_{n})" for n in outputs]),
        gates=", ".join([f".{n}({n})" for n in [clock, *inputs]] + [f".{n}(gates_{n})" for n in outputs]),
        drive="\n".join(f"      {name} = $random(seed) >> 7;" for name in stimuli),
        tell="\n".join(TELL.format(output=name, most=MOST_TOLD) for name in outputs),
        differs=" || ".join(f"routed_{n} !== gates_{n} || gates_{n} === 1'bx" for n in outputs)), encoding="utf-8")
    # Icarus looks for each cell of the SDF among all that stand beside it: without the fillers, which do nothing, these are a third.
    acting = re.sub(r"^\s*\w+ \S+ \(\s*\);\n", "", routed_text, flags=re.M)
    (work / "cells_that_act.v").write_text(own_nets(acting, pathlib.Path(given.cells).read_text(encoding="utf-8")), encoding="utf-8")
    # OpenSTA writes least and longest delays and leaves the typical ones out, which Icarus would take for none.
    run(["iverilog", "-g2012", "-gspecify", "-Tmax", "-s", "bench", "-o", str(work / "bench.vvp"), given.cells, str(work / "cells_that_act.v"),
         str(work / "reference.v"), str(work / "bench.v")])
    told = run(["vvp", "-n", str(work / "bench.vvp")])
    refused = re.search(r"^SDF (?:ERROR|WARNING).*$", told, re.M)
    if refused:
        refuse(f"{given.delays}: {refused.group(0)}")
    print("\n".join(line for line in told.splitlines() if "clock" in line))
    return 0 if ", 0 mismatches" in told else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
