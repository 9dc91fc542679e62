// SPDX-License-Identifier: Apache-2.0
// Yosys techmap: the low 32 bits of a long sum in a DSP block, for the UP5K. A comparison is none of them: it stands behind
// such a sum, and the clock is too short for both blocks.
(* techmap_celltype = "$add" *)
module _80_long_sum (A, B, Y);
  parameter A_SIGNED = 0;
  parameter B_SIGNED = 0;
  parameter A_WIDTH = 1;
  parameter B_WIDTH = 1;
  parameter Y_WIDTH = 1;
  input [A_WIDTH-1:0] A;
  input [B_WIDTH-1:0] B;
  output [Y_WIDTH-1:0] Y;
  wire _TECHMAP_FAIL_ = Y_WIDTH < 30 || Y_WIDTH == 37 || A_SIGNED != B_SIGNED;
  localparam W = Y_WIDTH < 33 ? 33 : Y_WIDTH;
  wire [W-1:0] a, b;
  generate
    if (A_SIGNED) begin
      assign a = $signed(A);
      assign b = $signed(B);
    end else begin
      assign a = A;
      assign b = B;
    end
  endgenerate
  wire [31:0] low;
  SB_MAC16 #(
    .TOPADDSUB_UPPERINPUT(1'b1),
    .TOPADDSUB_CARRYSELECT(2'b11),
    .BOTADDSUB_UPPERINPUT(1'b1)
  ) adder (
    .A(a[31:16]),
    .B(a[15:0]),
    .C(b[31:16]),
    .D(b[15:0]),
    .O(low)
  );
  wire carry = (a[31] & b[31]) | ((a[31] | b[31]) & ~low[31]);
  wire [W-1:0] sum = {a[W-1:32] + b[W-1:32] + carry, low};
  assign Y = sum;
endmodule
