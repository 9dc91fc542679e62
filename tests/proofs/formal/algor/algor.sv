// SPDX-License-Identifier: Apache-2.0
// Proof of tc_algor with every input free in every clock (parameters too, beyond their ranges) and reset at any time. The
// multiplier is cut (algor.map): whatever its products are, integral and duty stay in range. products.sv proves what was
// left out here, that every product fits its register.
// engine: induction

`include "tc_assert.svh"

module formal_algor (
  input logic               clk_i,
  input logic               reset_i,
  input tc_pkg::params_t    params_i,
  input logic               start_i,
  input logic               sample_ok_i,
  input logic               run_i,
  input logic               at_temp_i,
  input logic               ms_i,
  input logic signed [15:0] pv_i,
  input logic               drop_i,
  input logic               hold_test_i,
  input logic               tuning_i,
  input logic [16:0]        tune_duty_i,
  input logic [16:0]        tune_hold_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  logic        done, ramping, limited, i_held;
  logic [4:0]  computing;
  logic [16:0] duty;
  logic [1:0]  segment;
  logic [17:0] hold_limit;
  logic signed [15:0] sp_work;
  logic signed [17:0] term_p, term_i, term_d;

  tc_algor u_algor (
    .clk_i, .rst_ni, .params_i, .start_i, .sample_ok_i, .run_i, .at_temp_i, .ms_i, .pv_i, .drop_i, .hold_test_i, .tuning_i, .tune_duty_i, .tune_hold_i,
    .done_o(done), .duty_o(duty), .sp_work_o(sp_work), .ramping_o(ramping), .limited_o(limited), .segment_o(segment),
    .i_held_o(i_held), .hold_limit_o(hold_limit), .target_o(), .amb_o(), .duty_max_o(), .term_p_o(term_p), .term_i_o(term_i), .term_d_o(term_d), .computing_o(computing)
  );

  `TC_ASSERT_SETUP

  logic [16:0] duty_q;
  logic        start_q, ok_q;
  logic [4:0]  since_q;              // clocks since a start was taken, 31: none in work
  logic        idle;
  assign idle = since_q == 5'd31 || since_q == 5'd18;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      duty_q  <= 17'd0;
      start_q <= 1'b0;
      ok_q    <= 1'b0;
      since_q <= 5'd31;
    end else begin
      duty_q  <= duty;
      start_q <= start_i && idle;
      ok_q    <= sample_ok_i;
      since_q <= idle ? (start_i && sample_ok_i ? 5'd0 : 5'd31) : since_q + 5'd1;
    end
  end

  // Its steps beside the clocks since the start, for the induction.
  `TC_ASSERT(FormalAlgorInStep_A, since_q < 5'd18 ? computing == since_q + 5'd1 && !done
             : since_q == 5'd18 ? done && computing == 5'd19 : since_q == 5'd31 && computing == {4'd0, done} && (!done || (start_q && !ok_q)))
  `TC_ASSERT(FormalAlgorDutyKept_A, done || duty == duty_q || duty == 17'd0)
  `TC_ASSERT(FormalAlgorHoldLimit_A, hold_limit <= 18'd196608)
  // P12 (0 <= integral <= DUTY_MAX, duty <= DUTY_MAX after each computation) stands in the RTL.
  `TC_ASSERT(FormalAlgorTermIInRange_A, term_i >= 18'sd0 && term_i <= 18'sd65536)
  // The duty moves only with a result or a stop; a refused sample keeps it and answers at once.
  `TC_ASSERT_IF(FormalAlgorDutyHolds_A, !done && duty != 17'd0, duty == duty_q)
  `TC_ASSERT_IF(FormalAlgorRefused_A, start_q && !ok_q, done && (duty == duty_q || duty == 17'd0))
  // Every start is answered, nineteen clocks later (liveness as a bound); nothing is answered that was not asked.
  `TC_ASSERT_IF(FormalAlgorAnswers_A, since_q == 5'd18, done)
  `TC_ASSERT_IF(FormalAlgorDoneHasStart_A, done, (start_q && !ok_q) || since_q == 5'd18)
  // A stopped loop shows no duty and no segment.
  `TC_ASSERT_NEXT(FormalAlgorStopped_A, !run_i, duty == 17'd0 && term_i == 18'sd0 && segment == 2'd0)
  `TC_ASSERT_NEXT(FormalAlgorManualNoIntegral_A, params_i.mode[0], term_i == 18'sd0)

endmodule
