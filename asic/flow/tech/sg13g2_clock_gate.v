// SPDX-License-Identifier: Apache-2.0
// A word of flops with an enable becomes plain flops behind one clock gate, from four bits on: below that the gate
// costs more area than the multiplexers it saves. Equal as long as EN has settled before the clock rises: the gate's
// latch is open while the clock is low.
(* techmap_celltype = "$adffe" *)
module clock_gated_word (CLK, EN, ARST, D, Q);
  parameter WIDTH = 1;
  parameter CLK_POLARITY = 1;
  parameter EN_POLARITY = 1;
  parameter ARST_POLARITY = 0;
  parameter ARST_VALUE = 0;
  input CLK, EN, ARST;
  input [WIDTH-1:0] D;
  output [WIDTH-1:0] Q;
  wire _TECHMAP_FAIL_ = WIDTH < 4 || !CLK_POLARITY;
  wire gclk;
  sg13g2_lgcp_1 gate (.CLK(CLK), .GATE(EN_POLARITY ? EN : !EN), .GCLK(gclk));
  \$adff #(.WIDTH(WIDTH), .CLK_POLARITY(1'b1), .ARST_POLARITY(ARST_POLARITY), .ARST_VALUE(ARST_VALUE))
    word (.CLK(gclk), .ARST(ARST), .D(D), .Q(Q));
endmodule
