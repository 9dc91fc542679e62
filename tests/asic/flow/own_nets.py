#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Icarus finds the delays of a net at two inputs of a cell, once each has a net of its own: own_nets.py FOLDER_OF_SDF_REPLAY."""
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, sys.argv[1])
import sdf_replay  # noqa: E402

CELLS = """module BOTH (Y, A, B);
  input  A, B;
  output Y;
  assign Y = A & B;
  specify
    (A => Y) = 0;
    (B => Y) = 0;
  endspecify
endmodule
"""
NETLIST = """module routed(x, y);
  input x;
  output y;
  BOTH gate (.Y(y), .B(x), .A(x));
endmodule
"""
SDF = """(DELAYFILE (SDFVERSION "3.0") (TIMESCALE 1ns)
 (CELL (CELLTYPE "BOTH") (INSTANCE gate)
  (DELAY (ABSOLUTE (IOPATH A Y (1::1) (1::1)) (IOPATH B Y (1::1) (1::1))))))
"""
BENCH = """`timescale 1ns / 1ps
module bench;
  reg x = 0;
  wire y;
  routed dut (x, y);
  initial begin
    $sdf_annotate("delays.sdf", dut);
    #5 x = 1;
    #0.9 if (y !== 0) $display("too early");
    #0.2 if (y !== 1) $display("too late");
  end
endmodule
"""

for netlist, expected in ((NETLIST, ["SDF WARNING"]), (sdf_replay.own_nets(NETLIST, CELLS), [])):
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "delays.sdf").write_text(SDF, encoding="utf-8")
        pathlib.Path(folder, "bench.v").write_text(BENCH + CELLS + netlist, encoding="utf-8")
        subprocess.run(["iverilog", "-g2012", "-gspecify", "-Tmax", "-s", "bench", "-o", "bench.vvp", "bench.v"], cwd=folder, check=True)
        told = subprocess.run(["vvp", "-n", "bench.vvp"], cwd=folder, check=True, capture_output=True, text=True).stdout
    found = [word for word in ("SDF WARNING", "SDF ERROR", "too early", "too late") if word in told]
    if found != expected:
        sys.exit(f"own_nets.py: found {found}, expected {expected}; Icarus says: {told}")
