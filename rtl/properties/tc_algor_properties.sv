// SPDX-License-Identifier: Apache-2.0
// Properties of ALGOR: its flops stay in range, no sum wraps, integral and duty stay within DUTY_MAX (P12), a
// computation ends in time (P15), and with the same integral and derivative a larger error never gives a smaller output
// (P12, by a shadow of the computation). The ports are inputs and flops of tc_algor, under their names there.
`include "tc_assert.svh"

`ifndef SYNTHESIS
module tc_algor_properties (
  input  logic               clk_i,
  input  logic               rst_ni,

  input  tc_pkg::params_t    params_i,
  input  logic               start_i,
  input  logic               run_i,
  input  logic               hold_test_i,
  input  logic               tuning_i,
  input  logic [16:0]        tune_hold_i,

  input  logic [4:0]         step_i,
  input  logic               done_i,
  output logic [4:0]         computing_o,   // clocks since the computation began, 0: none
  input  logic signed [15:0] e_i,
  input  logic signed [21:0] e_320_i,
  input  logic signed [22:0] d_source_i,
  input  logic signed [21:0] filt_i,
  input  logic signed [22:0] filt_gap_i,
  input  logic signed [32:0] product_i,
  input  logic signed [31:0] work_i,
  input  logic signed [33:0] pd_i,
  input  logic signed [34:0] pd_sum_i,
  input  logic signed [41:0] u_sum_i,
  input  logic [16:0]        u_limited_i,
  input  logic [31:0]        i_i,
  input  logic [30:0]        limit_i,       // DUTY_MAX as the integral counts
  input  logic               full_i,
  input  logic               off_i,
  input  logic [16:0]        duty_i,
  input  logic [16:0]        duty_max_i,
  input  logic [16:0]        slew_i,
  input  logic [16:0]        ext_i,
  input  logic [16:0]        ff_i,
  input  logic [17:0]        hold_i
);

`include "tc_algor_steps.svh"

  logic seg_model, ff_en, i_zero;
  assign seg_model = params_i.ctrl[tc_pkg::CtrlSegModel];
  assign ff_en     = params_i.ctrl[tc_pkg::CtrlFfEn];
  assign i_zero    = params_i.ctrl[tc_pkg::CtrlIZero];

  `TC_ASSERT_SETUP
  `TC_ASSERT(AlgorIntegralInRange_A, i_i <= {1'b0, 17'd65536, 14'd0})
  `TC_ASSERT(AlgorDutyInRange_A, duty_i <= 17'd65536)
  `TC_ASSERT(AlgorOperandsInRange_A, duty_max_i <= 17'd65536 && slew_i <= 17'd65536 && ext_i <= 17'd65536 &&
      ff_i <= 17'd65536)
  `TC_ASSERT_IF(AlgorNextIntegralInRange_A, step_i == StepAntiWindup, $unsigned(work_i) <= {1'b0, limit_i})
  `TC_ASSERT_IF(AlgorWantedLimited_A, step_i == StepLimit, $unsigned(work_i) <= {15'd0, duty_max_i})
  `TC_ASSERT_IF(AlgorHoldFirstPart_A, step_i == StepPreset, hold_i <= 18'd65536)
  `TC_ASSERT_IF(AlgorHoldBothParts_A, step_i >= StepExternal && step_i <= StepSlew, hold_i <= 18'd131072)
  `TC_ASSERT(AlgorStepLegal_A, step_i <= StepLimit)
  // In GUARD's test the duty is at most half of the hold power.
  `TC_ASSERT_NEXT(AlgorTestHoldsDown_A, step_i == StepLimit && hold_test_i, duty_i <= hold_i[17:1])
  `TC_ASSERT_NEXT(AlgorStoppedIsZero_A, !run_i, duty_i == 17'd0 && i_i == 32'd0)
  // P15: a computation ends within nineteen clocks.
  logic [4:0] computing;
  logic       resumed_q;                   // set by a bench that loads flops
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      resumed_q <= 1'b0;
      computing <= 5'd0;
    end else begin
      resumed_q <= 1'b0;
      computing <= start_i && step_i == StepIdle ? 5'd1
                 : done_i || resumed_q || computing == 5'd0 ? 5'd0 : computing + 5'(computing != 5'h1F);
    end
  end
  assign computing_o = computing;
  `TC_ASSERT_IF(P15_AlgorAnswers_A, computing != 5'd0, computing <= 5'd19)
`ifdef FORMAL
  `TC_ASSERT(AlgorComputing_A, step_i != StepIdle ? computing == step_i && !done_i
             : done_i ? computing == 5'd1 || computing == 5'd19 : computing == 5'd0)
`endif
  // P12: no sum wraps: each is its exact value, computed with bits to spare.
  logic signed [31:0] p_now, d_now;              // products of P and D of this computation,
  logic               followed;                  // which has been watched from its beginning on
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      p_now    <= 32'sd0;
      d_now    <= 32'sd0;
      followed <= 1'b0;
    end else begin
      followed <= (followed || step_i == StepAmbient) && !resumed_q;
      if (step_i == StepProportional) d_now <= work_i;
      if (step_i == StepIntegral) p_now <= work_i;
    end
  end
  logic signed [47:0] pd_least;                  // pd_i without the external feed-forward
  assign pd_least = 48'(d_now) + (step_i == StepIntegral ? 48'sd0 : 48'(p_now) <<< 1);
  `TC_ASSERT_IF(P12_SumsExact_A, followed && step_i >= StepIntegral && step_i <= StepOutput,
                48'(pd_i) >= pd_least && 48'(pd_i) <= pd_least + 48'sd8388608)
  `TC_ASSERT(P12_SumsFit_A,
             (step_i != StepSegment || (48'(pd_sum_i) == 48'(pd_i) + (ff_en ? $signed({24'd0, ff_i, 7'd0}) : 48'sd0) &&
                                        48'(u_sum_i) == $signed({16'd0, i_i}) + 48'(work_i))) &&
             (step_i != StepAntiWindup || 48'(u_sum_i) == (48'(pd_i) <<< 7) + 48'(work_i)) &&
             (step_i != StepOutput || 48'(u_sum_i) == (48'(pd_i) <<< 7) + $signed({16'd0, i_i})))
  `TC_ASSERT(P12_ErrorExact_A, 24'(e_320_i) == 24'(e_i) * 24'sd5 && 24'(filt_gap_i) == 24'(d_source_i) - 24'(filt_i))
`ifdef FORMAL
  `TC_ASSERT(P12_FilterFits_A, filt_i >= -22'sd524288 && filt_i <= 22'sd524288)
`endif
  // P12: the integral stays between 0 and DUTY_MAX after each computation,
  `TC_ASSERT_IF(P12_IntegralLimited_A, step_i == StepOutput || step_i == StepLimit, i_i <= {1'b0, limit_i})
  // and so does the duty.
  `TC_ASSERT_NEXT(P12_DutyLimited_A, step_i == StepLimit, duty_i <= duty_max_i)
  // P12: with the same integral and derivative a larger error never gives a smaller output. The sum is computed once
  // more, step by step beside the true one, for a smaller error, that of the computation before; its product is
  // smaller because no gain is negative.
  logic signed [15:0] e_less;
  logic signed [31:0] p_less;
  logic signed [33:0] pd_less;
  logic [31:0]        i_less;                    // the integral that comes of it
  logic               ordered, full_less, off_less;
  logic signed [34:0] pd_less_now, pd_ff_less, limit_pd;   // DUTY_MAX as pd_i counts
  assign limit_pd    = $signed({11'd0, duty_max_i, 7'd0});
  assign pd_less_now = 35'(pd_i) + (35'(p_less) <<< 1);
  assign pd_ff_less  = 35'(pd_less) + (ff_en ? $signed({11'd0, ff_i, 7'd0}) : 35'sd0);
  logic signed [21:0] e_320_less;
  assign e_320_less = 22'(e_less) * 22'sd5;
  logic signed [41:0] u_try_less, u_less;
  logic               accept_less;
  logic [16:0]        u_limited_less;
  assign u_try_less     = (42'(pd_less) <<< 7) + 42'(work_i);
  assign accept_less    = !hold_test_i && !(u_try_less > $signed({11'd0, limit_i}) && e_less >= 16'sd0) &&
                          !(u_try_less < 42'sd0 && e_less <= 16'sd0);
  assign u_less         = ((42'(pd_less) <<< 7) + $signed({10'd0, i_i})) >>> 14;
  assign u_limited_less = full_less ? duty_max_i : off_less || u_less < 42'sd0 ? 17'd0
                        : u_less > $signed({25'd0, duty_max_i}) ? duty_max_i : u_less[16:0];
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      e_less    <= 16'sd0;
      p_less    <= 32'sd0;
      pd_less   <= 34'sd0;
      i_less    <= 32'd0;
      ordered   <= 1'b0;
      full_less <= 1'b0;
      off_less  <= 1'b0;
    end else begin
      case (step_i)
        StepIntegral: begin
          ordered <= followed && e_less <= e_i && p_less <= work_i;
          pd_less <= pd_less_now[33:0];
        end
        StepSegment: begin
          full_less <= seg_model ? pd_ff_less > limit_pd && e_less > 16'sd0
                                 : e_320_less > $signed({1'b0, params_i.band_full, 5'd0});
          off_less  <= seg_model ? ff_en && pd_ff_less < 35'sd0 && e_less < 16'sd0
                                 : -e_320_less > $signed({1'b0, params_i.band_off, 5'd0});
        end
        StepAntiWindup: i_less <= tuning_i ? {1'b0, tune_hold_i, 14'd0}
                                : full_less || off_less ? (i_zero ? 32'd0 : full_less &&
                                    ff_en ? {1'b0, ff_i, 14'd0} : i_i)
                                : accept_less ? work_i : i_i;
        StepClamp: i_less <= i_less > {1'b0, limit_i} ? {1'b0, limit_i} : i_less;
        StepOutput: begin
          e_less <= e_i;
          p_less <= p_now;
        end
        default: ;
      endcase
      if (resumed_q) ordered <= 1'b0;
    end
  end
`ifdef FORMAL
  `TC_ASSERT_IF(P12_MonotoneSum_A, step_i >= StepSegment && step_i <= StepOutput && ordered, pd_less <= pd_i &&
      e_less <= e_i)
  `TC_ASSERT_IF(P12_MonotoneSegments_A, step_i >= StepAntiWindup && step_i <= StepOutput && ordered,
                (!full_less || full_i) && (!off_i || off_less))
`endif
  `TC_ASSERT_IF(P12_Monotone_A, step_i == StepOutput && ordered && i_less == i_i, u_limited_less <= u_limited_i)
  logic unused_less;
  assign unused_less = ^{u_less, pd_less_now, params_i, product_i, full_i, off_i};
`ifndef TC_ALGOR_CUT
  // P12: the products fit.
  `TC_ASSERT(AlgorProductsFit_A, product_i[32] == product_i[31])
`endif

endmodule
`endif
