// SPDX-License-Identifier: Apache-2.0
// Words behind clock gates, one gate behind the other; test ports and the bypass of the reset are here already.
module gated(input clk_i, input rst_ni, input test_mode_i, input scan_en_i, input [1:0] scan_i, output [1:0] scan_o,
             input load_i, input add_i, input [3:0] d_i, output [3:0] sum_o, output full_o);
  reg [1:0] rst_q;
  always @(posedge clk_i or negedge rst_ni)
    if (!rst_ni) rst_q <= 2'b00; else rst_q <= {rst_q[0], 1'b1};
  wire rst_n = test_mode_i ? rst_ni : rst_q[1];
  reg load_q, add_q;
  always @(posedge clk_i or negedge rst_n)
    if (!rst_n) {load_q, add_q} <= 2'b00; else {load_q, add_q} <= {load_i, add_i};
  wire word_clk, sum_clk;
  CKG u_word (.CK(clk_i), .E(load_q | add_q), .GCK(word_clk));
  CKG u_sum (.CK(word_clk), .E(add_q), .GCK(sum_clk));
  reg [3:0] word_q, sum_q;
  always @(posedge word_clk or negedge rst_n)
    if (!rst_n) word_q <= 4'd5; else word_q <= d_i ^ {4{add_q}};
  always @(posedge sum_clk or negedge rst_n)
    if (!rst_n) sum_q <= 4'd0; else sum_q <= sum_q + word_q;
  assign sum_o = sum_q;
  assign full_o = &sum_q;
  assign scan_o = 2'b00;
endmodule
