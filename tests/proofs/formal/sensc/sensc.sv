// SPDX-License-Identifier: Apache-2.0
// Proof of tc_sensc with free inputs (the description may change in any clock) and reset at any time. The block's own
// assertions (FORMAL section of rtl/tc_sensc.sv: every read ends, clock and chip select) are proved with these.
// prove: SenscProof* SenscDeselected* SenscDoneIsIdle_A SenscSelect_A SenscClock* SenscGap* SenscEdges* SenscNoSetUpLeft_A
// prove: SenscLeadIdles_A SenscStateLegal_A SenscReadEnds_A SenscReadBounded_A SenscSetUp SenscBadFrame P05_SampleIsPrompt_A

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
  tc_types_pkg::reading_t reading;
  assign {ok, dev_fault, frame_bad, pv, raw} = reading;
  tc_sensc u_sensc (
    .clk_i, .rst_ni, .start_i, .reconfig_i, .type_i, .custom_i, .spi_div_i, .trim_i, .miso_i,
    .sclk_o(sclk), .cs_no(cs_n), .mosi_o(mosi), .busy_o(busy), .done_o(done), .reading_o(reading)
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

  // Around the pins' changes: chip select waits half a period (3 clocks at least) behind the clock's last edge, the clock's first
  // edge as long behind it; between two frames it is high for four half periods.
  logic [1:0] sclk_age_q, select_age_q;   // clocks since the last change, 3 and more as 3
  logic [3:0] high_age_q;                 // clocks of chip select high, 12 and more as 12
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      sclk_age_q <= 2'd3;
      select_age_q <= 2'd3;
      high_age_q <= 4'd0;
    end else begin
      sclk_age_q <= (sclk != sclk_q) ? 2'd1 : (sclk_age_q == 2'd3) ? 2'd3 : sclk_age_q + 2'd1;
      select_age_q <= (cs_n != cs_n_q) ? 2'd1 : (select_age_q == 2'd3) ? 2'd3 : select_age_q + 2'd1;
      high_age_q <= !cs_n ? 4'd0 : (high_age_q == 4'd12) ? 4'd12 : high_age_q + 4'd1;
    end
  end
  `TC_ASSERT_IF(SenscProofSelectWaits_A, cs_n != cs_n_q, sclk_age_q == 2'd3)
  `TC_ASSERT_IF(SenscProofClockWaits_A, !cs_n && sclk != sclk_q, select_age_q == 2'd3)
  `TC_ASSERT_IF(SenscProofSelectHigh_A, !cs_n && cs_n_q, high_age_q == 4'd12)

  // The judgement: bits that the description of that clock checks, its fault bits, and a second frame of zeros in a row.
  tc_pkg::sensor_t sens_q;
  logic            zero_q;                // the last frame was all zeros
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      sens_q <= 160'd0;
      zero_q <= 1'b0;
    end else begin
      sens_q <= (type_i == 3'd0) ? custom_i : tc_pkg::sensor_preset(type_i);
      if (done) zero_q <= raw == 32'd0;
    end
  end
  `TC_ASSERT_IF(SenscProofCheck_A, done && ((raw ^ sens_q.check_value) & sens_q.check_mask) != 32'd0, frame_bad)
  `TC_ASSERT_IF(SenscProofFault_A, done, dev_fault == ((raw[15:0] & sens_q.fault_mask) != 16'd0))
  `TC_ASSERT_IF(SenscProofStuckLow_A, done && raw == 32'd0 && zero_q, frame_bad)

  // ok says what the flags say; a frame of ones is never ok.
  `TC_ASSERT_IF(SenscProofOk_A, ok, !dev_fault && !frame_bad)
  `TC_ASSERT_IF(SenscProofStuckHigh_A, done && raw == 32'hFFFFFFFF, !ok)

endmodule
