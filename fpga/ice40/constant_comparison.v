// SPDX-License-Identifier: Apache-2.0
// Yosys techmap: comparisons with a constant as gates. A look-up table takes three of their bits, a carry chain a
// cell for each.
(* techmap_celltype = "$lt $le $gt $ge" *)
module _80_compare_constant (A, B, Y);
  parameter A_SIGNED = 0;
  parameter B_SIGNED = 0;
  parameter A_WIDTH = 1;
  parameter B_WIDTH = 1;
  parameter Y_WIDTH = 1;
  parameter _TECHMAP_CELLTYPE_ = "";
  parameter [A_WIDTH-1:0] _TECHMAP_CONSTMSK_A_ = 0;
  parameter [B_WIDTH-1:0] _TECHMAP_CONSTMSK_B_ = 0;
  input [A_WIDTH-1:0] A;
  input [B_WIDTH-1:0] B;
  output [Y_WIDTH-1:0] Y;
  localparam W = A_WIDTH > B_WIDTH ? A_WIDTH : B_WIDTH;
  localparam S = A_SIGNED && B_SIGNED;
  localparam LE = _TECHMAP_CELLTYPE_ == "$le" || _TECHMAP_CELLTYPE_ == "$ge";
  localparam SWAP = _TECHMAP_CELLTYPE_ == "$gt" || _TECHMAP_CELLTYPE_ == "$ge";
  wire _TECHMAP_FAIL_ = !(&_TECHMAP_CONSTMSK_A_ || &_TECHMAP_CONSTMSK_B_);
  wire [W-1:0] a, b;
  generate
    if (S) begin
      assign a = $signed(A);
      assign b = $signed(B);
    end else begin
      assign a = A;
      assign b = B;
    end
  endgenerate
  wire [W-1:0] top = S ? 1 << (W - 1) : 0;
  wire [W-1:0] x = (SWAP ? b : a) ^ top;
  wire [W-1:0] y = (SWAP ? a : b) ^ top;
  wire [W:0] lt;                      // x < y in the bits below, or x <= y
  assign lt[0] = LE;
  genvar i;
  generate
    for (i = 0; i < W; i = i + 1) begin
      assign lt[i+1] = (~x[i] & y[i]) | (~(x[i] ^ y[i]) & lt[i]);
    end
  endgenerate
  assign Y = lt[W];
endmodule
