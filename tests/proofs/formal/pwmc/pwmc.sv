// SPDX-License-Identifier: Apache-2.0
// Proof of tc_pwmc with free inputs and reset at any time. The block's own assertions (FORMAL section of rtl/tc_pwmc.sv)
// are proved with these, which see its pins alone.
// engine: induction

`include "tc_assert.svh"

module pwmc (
  input logic        clk_i,
  input logic        reset_i,
  input logic [15:0] prescale_i,
  input logic [15:0] period_i,
  input logic [15:0] min_on_i,
  input logic        dither_i,
  input logic        enable_i,
  input logic [16:0] duty_i,
  input logic        load_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  logic pwm, period_start;
  tc_pwmc u_pwmc (
    .clk_i, .rst_ni, .prescale_i, .period_i, .min_on_i, .dither_i, .enable_i, .duty_i, .load_i,
    .pwm_o(pwm), .period_start_o(period_start)
  );

  `TC_ASSERT_SETUP

  // Emergency: low within a clock of enable low.
  `TC_ASSERT_NEXT(PwmcProofOff_A, !enable_i, !pwm)

  // One pulse a period, at its start: pwm rises only in a period's first clock.
  `TC_ASSERT_NEXT(PwmcProofOnePulse_A, !pwm, !pwm || period_start)

endmodule
