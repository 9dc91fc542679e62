// SPDX-License-Identifier: Apache-2.0
// Proof of tc_atune with free inputs. That its duty stays below DUTY_MAX is ALGOR's part (AlgorDutyLimited_A).
`include "tc_assert.svh"
// engine: induction

module formal_atune (
  input logic               clk_i,
  input logic               reset_i,
  input logic               tune_i,
  input logic               run_i,
  input logic               sample_i,
  input logic               tenth_i,
  input logic               commit_i,
  input logic signed [15:0] pv_i,
  input logic signed [15:0] sp_work_i,
  input logic signed [15:0] amb_i,
  input logic               ramping_i,
  input logic [16:0]        duty_max_i,
  input logic [15:0]        window_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  logic        tuning, stop, parity, still, wr;
  logic [16:0] duty, hold;
  logic [5:0]  wr_index;
  logic [15:0] wr_data;
  tc_types_pkg::tuned_t tuned;

  // A short limit brings its end within reach; nothing proved depends on its length.
  tc_atune #(.Limit(14'd3)) u_atune (
    .clk_i, .rst_ni, .tune_i, .run_i, .sample_i, .tenth_i, .commit_i, .pv_i, .sp_work_i, .amb_i, .ramping_i, .duty_max_i,
    .window_i,
    .tuning_o(tuning), .duty_o(duty), .stop_o(stop), .parity_o(parity), .still_o(still), .wr_o(wr), .wr_index_o(wr_index), .wr_data_o(wr_data),
    .hold_o(hold), .tuned_o(tuned)
  );

  `TC_ASSERT_SETUP

  logic        tuning_q, tune_q, run_q, commit_q, parity_q, still_q;
  logic [16:0] duty_q, hold_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      tuning_q <= 1'b0;
      tune_q   <= 1'b0;
      run_q    <= 1'b0;
      commit_q <= 1'b0;
      parity_q <= 1'b0;
      still_q  <= 1'b0;
      duty_q   <= 17'd0;
      hold_q   <= 17'd0;
    end else begin
      tuning_q <= tuning;
      tune_q   <= tune_i;
      run_q    <= run_i;
      commit_q <= commit_i;
      parity_q <= parity;
      still_q  <= still;
      duty_q   <= duty;
      hold_q   <= hold;
    end
  end
  // It begins by its command only, and not without heating; it ends by itself, by a stop, or with the commit of its gains.
  `TC_ASSERT_IF(FormalAtuneBegins_A, tuning && !tuning_q, tune_q && run_q)
  `TC_ASSERT_IF(FormalAtuneEnds_A, !tuning && tuning_q, !run_q || stop || commit_q)
  `TC_ASSERT_IF(FormalAtuneNeverWithoutRun_A, !run_q, !tuning && !wr)
  // What GUARD watches stays where it is said to.
  `TC_ASSERT_IF(FormalAtuneStill_A, still_q, parity == parity_q && tuning == tuning_q && duty == duty_q && hold == hold_q)
  `TC_COVER(FormalAtuneStops_C, stop)
  `TC_COVER(FormalAtuneStill_C, tuning && still && still_q)

endmodule
