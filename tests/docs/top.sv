// SPDX-License-Identifier: Apache-2.0
// A reader's own design, for the block of docs/make/test-vectors.md that takes one: four bits that turn round.
module top (input logic clk_i, input logic rst_ni, input logic data_i, output logic [3:0] ring_o);
  always_ff @(posedge clk_i or negedge rst_ni)
    if (!rst_ni) ring_o <= 4'd0;
    else ring_o <= {ring_o[2:0], ring_o[3] ^ data_i};
endmodule
