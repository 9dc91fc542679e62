#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""harness.py PORTS.json BLOCK OUT.v: a block behind two shift registers, so that one of any number of ports fits a package.

Each clock shifts one bit in; with latch_i high the word shifted in becomes the block's inputs, and its outputs are taken to be shifted
out. The block runs on every clock. PORTS.json is Yosys' netlist of the block.
"""
import json
import sys

TEMPLATE = """// Made by fpga/ice40/harness.py for {block}.
module harness (input clk_i, input rst_ni, input serial_i, input latch_i, output serial_o);
  reg [{last_in}:0] in_shift, in_word;
  reg [{last_out}:0] out_shift;
  wire [{last_out}:0] out_word;
  always @(posedge clk_i or negedge rst_ni)
    if (!rst_ni) begin
      in_shift <= 0;
      in_word <= 0;
      out_shift <= 0;
    end else begin
      in_shift <= {{in_shift, serial_i}};
      out_shift <= latch_i ? out_word : out_shift >> 1;
      if (latch_i) in_word <= in_shift;
    end
  assign serial_o = out_shift[0];
  {block} block ({pins});
endmodule
"""


def main(source, block, target):
    with open(source, encoding="utf-8") as file:
        ports = json.load(file)["modules"][block]["ports"]
    pins, used = [".clk_i(clk_i)", ".rst_ni(rst_ni)"], {"input": 0, "output": 0}
    for name, port in ports.items():
        if name in ("clk_i", "rst_ni"):
            continue
        way, width = port["direction"], len(port["bits"])
        word = "in_word" if way == "input" else "out_word"
        pins.append(f".{name}({word}[{used[way] + width - 1}:{used[way]}])")
        used[way] += width
    with open(target, "w", encoding="utf-8") as file:
        file.write(TEMPLATE.format(block=block, pins=", ".join(pins), last_in=used["input"] - 1, last_out=used["output"] - 1))


if __name__ == "__main__":
    main(*sys.argv[1:])
