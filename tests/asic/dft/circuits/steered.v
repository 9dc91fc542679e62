// SPDX-License-Identifier: Apache-2.0
// Registers that shift without multiplexers of their own: a copy that the scan enable steers, a ring, a row with two ends and an inverse.
module steered(input clk_i, input rst_ni, input scan_en_i, input [3:0] data_i, input load_i, input commit_i,
               output [3:0] copy_o, output ring_o, output [2:0] row_o);
  reg [3:0] staged_q, copy_q;
  reg [1:0] ring_q;
  reg first_q, second_q, other_q, inverse_q;
  always @(posedge clk_i or negedge rst_ni)
    if (!rst_ni) begin
      staged_q <= 4'd0;
      copy_q <= 4'd0;
      ring_q <= 2'b01;
      first_q <= 1'b0;
      second_q <= 1'b0;
      other_q <= 1'b1;
      inverse_q <= 1'b0;
    end else begin
      if (load_i) staged_q <= data_i ^ copy_q;
      if (commit_i || scan_en_i) copy_q <= staged_q;
      ring_q <= {ring_q[0], ring_q[1]};
      first_q <= ^data_i;
      second_q <= first_q;
      other_q <= first_q;
      inverse_q <= !second_q;
    end
  assign copy_o = copy_q;
  assign ring_o = ring_q[1];
  assign row_o = {second_q, other_q, inverse_q};
endmodule
