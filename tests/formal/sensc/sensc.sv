// SPDX-License-Identifier: Apache-2.0
// Proof of tc_sensc with free inputs (the description may change in any clock) and reset at any time. The block's own
// assertions (FORMAL section of rtl/tc_sensc.sv: every read ends, clock and chip select) are proved with these.

`include "tc_assert.svh"

module sensc (
  input logic             clk_i,
  input logic             reset_i,
  input logic             start_i,
  input logic             reconfig_i,
  input logic [2:0]       type_i,
  input tc_pkg::sensor_t  custom_i,
  input logic [7:0]       spi_div_i,
  input logic [15:0]      trim_i,
  input logic             miso_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  logic        sclk, cs_n, mosi, busy, done, ok, dev_fault, frame_bad;
  logic [15:0] pv;
  logic [31:0] raw;
  tc_sensc u_sensc (
    .clk_i, .rst_ni, .start_i, .reconfig_i, .type_i, .custom_i, .spi_div_i, .trim_i, .miso_i,
    .sclk_o(sclk), .cs_no(cs_n), .mosi_o(mosi), .busy_o(busy), .done_o(done), .ok_o(ok), .dev_fault_o(dev_fault),
    .frame_bad_o(frame_bad), .pv_o(pv), .raw_o(raw)
  );

  `TC_ASSERT_SETUP

  logic        sclk_q, cs_n_q, dev_fault_q, frame_bad_q;
  logic [15:0] pv_q;
  logic [31:0] raw_q;
  logic        pending_q;          // a start was taken and its done has not come
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      sclk_q <= 1'b0;
      cs_n_q <= 1'b1;
      dev_fault_q <= 1'b0;
      frame_bad_q <= 1'b0;
      pv_q <= 16'd0;
      raw_q <= 32'd0;
      pending_q <= 1'b0;
    end else begin
      sclk_q <= sclk;
      cs_n_q <= cs_n;
      dev_fault_q <= dev_fault;
      frame_bad_q <= frame_bad;
      pv_q <= pv;
      raw_q <= raw;
      if (start_i && !busy) pending_q <= 1'b1;
      else if (done) pending_q <= 1'b0;
    end
  end

  // A start is answered by exactly one done: none without a start, busy till then, and every read ends (SenscReadEnds_A).
  `TC_ASSERT_IF(SenscProofDoneOnce_A, done, pending_q)
  `TC_ASSERT(SenscProofBusyTillDone_A, pending_q == (busy || done))

  // Chip select never moves together with the clock.
  `TC_ASSERT_IF(SenscProofSelectAlone_A, cs_n != cs_n_q, sclk == sclk_q)

  // Results change only with done.
  `TC_ASSERT_IF(SenscProofResultsHold_A, !done,
                pv == pv_q && raw == raw_q && dev_fault == dev_fault_q && frame_bad == frame_bad_q)

  // ok says what the flags say; a frame of ones is never ok.
  `TC_ASSERT_IF(SenscProofOk_A, ok, !dev_fault && !frame_bad)
  `TC_ASSERT_IF(SenscProofStuckHigh_A, done && raw == 32'hFFFFFFFF, !ok)

endmodule
