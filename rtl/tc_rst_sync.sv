// SPDX-License-Identifier: Apache-2.0
// Reset synchroniser: rst_no falls with rst_ni at once and rises at the second clock edge after rst_ni has risen,
// so that every flop of the chip leaves reset in the same clock.

module tc_rst_sync (
  input  logic clk_i,
  input  logic rst_ni,
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

  assign rst_no = out_q;

endmodule
