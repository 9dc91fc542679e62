// SPDX-License-Identifier: Apache-2.0
// Proof of tc_algor with every input free in every clock (parameters too, beyond their ranges) and reset at any time. The
// three multipliers are cut (TC_ALGOR_CUT, rtl/tc_algor.sv): whatever the products are, integral and duty stay in range.
// That the products fit their registers is arithmetic on the widths: |UQ16 x S16| <= 65535 x 32768 < 2^31; the unit test
// checks the corners.

`include "tc_assert.svh"

module formal_algor (
  input logic               clk_i,
  input logic               reset_i,
  input tc_pkg::params_t    params_i,
  input logic signed [32:0] cut_a_i,
  input logic signed [32:0] cut_b_i,
  input logic signed [32:0] cut_c_i,
  input logic               start_i,
  input logic               sample_ok_i,
  input logic               run_i,
  input logic               at_temp_i,
  input logic               ms_i,
  input logic signed [15:0] pv_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  logic        done, ramping, limited, i_held;
  logic [16:0] duty, duty_max;
  logic [1:0]  segment;
  logic [17:0] hold_limit;
  logic [31:0] integral;
  logic signed [15:0] sp_work;
  logic signed [17:0] term_p, term_i, term_d;

  tc_algor u_algor (
    .clk_i, .rst_ni, .cut_a_i, .cut_b_i, .cut_c_i, .cut_integral_o(integral), .cut_duty_max_o(duty_max),
    .params_i, .start_i, .sample_ok_i, .run_i, .at_temp_i, .ms_i, .pv_i,
    .done_o(done), .duty_o(duty), .sp_work_o(sp_work), .ramping_o(ramping), .limited_o(limited), .segment_o(segment),
    .i_held_o(i_held), .hold_limit_o(hold_limit), .term_p_o(term_p), .term_i_o(term_i), .term_d_o(term_d)
  );

  `TC_ASSERT_SETUP

  logic [16:0] duty_q;
  logic        start_q, ok_q;
  logic [3:0]  since_q;              // clocks since a start that was taken, 15: none in work
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      duty_q  <= 17'd0;
      start_q <= 1'b0;
      ok_q    <= 1'b0;
      since_q <= 4'd15;
    end else begin
      duty_q  <= duty;
      start_q <= start_i && since_q == 4'd15;
      ok_q    <= sample_ok_i;
      if (since_q == 4'd15) begin
        if (start_i && sample_ok_i) since_q <= 4'd0;
      end else begin
        since_q <= since_q == 4'd11 ? 4'd15 : since_q + 4'd1;
      end
    end
  end

  // P12: 0 <= integral <= DUTY_MAX after each computation, duty within 0 .. DUTY_MAX and 0 .. 65536 always.
  `TC_ASSERT_IF(FormalAlgorIntegralLimited_A, done && ok_q, integral <= {1'b0, duty_max, 14'd0} || !run_i)
  `TC_ASSERT_IF(FormalAlgorDutyLimited_A, done && duty > duty_q, duty <= duty_max)
  `TC_ASSERT(FormalAlgorHoldLimit_A, hold_limit <= 18'd131072)
  // The duty moves only with a result or a stop; a refused sample keeps it and answers at once.
  `TC_ASSERT_IF(FormalAlgorDutyHolds_A, !done && duty != 17'd0, duty == duty_q)
  `TC_ASSERT_IF(FormalAlgorRefused_A, start_q && !ok_q, done && (duty == duty_q || duty == 17'd0))
  // Every start is answered, twelve clocks later (liveness as a bound); nothing is answered that was not asked.
  `TC_ASSERT_IF(FormalAlgorAnswers_A, since_q == 4'd12, 1'b0)
  `TC_ASSERT_IF(FormalAlgorDoneHasStart_A, done, (start_q && !ok_q) || since_q == 4'd15)
  // A stopped loop shows no duty and no segment.
  `TC_ASSERT_NEXT(FormalAlgorStopped_A, !run_i, duty == 17'd0 && integral == 32'd0 && segment == 2'd0)
  `TC_ASSERT_NEXT(FormalAlgorManualNoIntegral_A, params_i.mode[0], integral == 32'd0)

endmodule
