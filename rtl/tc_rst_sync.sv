// SPDX-License-Identifier: Apache-2.0
// Reset synchroniser: rst_no falls with rst_ni at once and rises at the second clock edge after rst_ni has risen,
// so that every flop of the chip leaves reset in the same clock. In test mode rst_no is rst_ni, whatever the two flops
// hold: they are in a chain.

module tc_rst_sync (
  input  logic clk_i,
  input  logic rst_ni,
  input  logic test_mode_i,
  output logic rst_no
);

  logic stage_q, out_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      stage_q <= 1'b0;
      out_q <= 1'b0;
    end else begin
      stage_q <= 1'b1;
      out_q <= stage_q;
    end
  end

  assign rst_no = test_mode_i ? rst_ni : out_q;

endmodule
