// SPDX-License-Identifier: Apache-2.0
// ALGOR keeps 32 of a product's 33 bits: that is enough for every gain (unsigned) and every term (signed). The products
// of tc_algor have these widths (AlgorProductsFit_A there watches them in simulation).

`include "tc_assert.svh"

module formal_algor_products (
  input logic               clk_i,
  input logic [15:0]        gain_i,
  input logic signed [15:0] term_i
);

  logic rst_ni = 1'b0;
  always_ff @(posedge clk_i) rst_ni <= 1'b1;

  logic signed [32:0] product;
  assign product = $signed({1'b0, gain_i}) * term_i;

  `TC_ASSERT_SETUP
  `TC_ASSERT(FormalAlgorProductFits_A, product[32] == product[31])

endmodule
