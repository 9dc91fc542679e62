// SPDX-License-Identifier: Apache-2.0
// What Yosys can't take from the library's Liberty: the clock gate, a latch that is open while the clock is low.
module sg13g2_lgcp_1 (input CLK, input GATE, output GCLK);
  reg enable;
  always @* if (!CLK) enable = GATE;
  assign GCLK = CLK & enable;
endmodule
