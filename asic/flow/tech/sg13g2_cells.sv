// SPDX-License-Identifier: Apache-2.0
// What Liberty says in a state table: the clock gates, with a latch that is open while the clock is low. For
// simulation.
module sg13g2_lgcp_1 (input CLK, input GATE, output GCLK);
  logic enable;
  always_latch if (!CLK) enable = GATE;
  assign GCLK = CLK & enable;
endmodule

module sg13g2_slgcp_1 (input CLK, input GATE, input SCE, output GCLK);
  logic enable;
  always_latch if (!CLK) enable = GATE | SCE;
  assign GCLK = CLK & enable;
endmodule
