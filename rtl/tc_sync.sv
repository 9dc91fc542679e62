// SPDX-License-Identifier: Apache-2.0
// Two-flop synchroniser: the only way by which an asynchronous input enters the chip.
// Contract: q_o shows d_i two clocks later; each bit on its own (no coherence across the bits of a bus).

module tc_sync #(
  parameter int unsigned Width = 1,                  // bits synchronised side by side
  parameter logic [Width-1:0] ResetValue = '0        // idle level of the pins, so that reset gives no edge
) (
  input  logic             clk_i,
  input  logic             rst_ni,
  input  logic [Width-1:0] d_i,
  output logic [Width-1:0] q_o
);

  logic [Width-1:0] stage_q, out_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      stage_q <= ResetValue;
      out_q <= ResetValue;
    end else begin
      stage_q <= d_i;
      out_q <= stage_q;
    end
  end

  assign q_o = out_q;

endmodule
