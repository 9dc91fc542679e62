// SPDX-License-Identifier: Apache-2.0
// Yosys techmap: the sign of a difference with a constant as a comparison of the bits below it, which
// constant_comparison.v makes gates. The other bits of such a difference are for nobody, and go.
(* techmap_celltype = "$sub" *)
module _80_constant_sign (A, B, Y);
  parameter A_SIGNED = 0;
  parameter B_SIGNED = 0;
  parameter A_WIDTH = 1;
  parameter B_WIDTH = 1;
  parameter Y_WIDTH = 1;
  parameter [A_WIDTH-1:0] _TECHMAP_CONSTMSK_A_ = 0;
  parameter [B_WIDTH-1:0] _TECHMAP_CONSTMSK_B_ = 0;
  input [A_WIDTH-1:0] A;
  input [B_WIDTH-1:0] B;
  output [Y_WIDTH-1:0] Y;
  localparam SIGN = Y_WIDTH - 1;
  wire _TECHMAP_FAIL_ = Y_WIDTH <= A_WIDTH || Y_WIDTH <= B_WIDTH || A_SIGNED != B_SIGNED || !(&_TECHMAP_CONSTMSK_A_ || &_TECHMAP_CONSTMSK_B_);
  wire [Y_WIDTH-1:0] a, b;
  generate
    if (A_SIGNED) begin
      assign a = $signed(A);
      assign b = $signed(B);
    end else begin
      assign a = A;
      assign b = B;
    end
  endgenerate
  wire borrow = a[SIGN-1:0] < b[SIGN-1:0];
  assign Y[SIGN] = a[SIGN] ^ b[SIGN] ^ borrow;
  assign Y[SIGN-1:0] = a[SIGN-1:0] - b[SIGN-1:0];
endmodule
