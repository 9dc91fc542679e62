// SPDX-License-Identifier: Apache-2.0
// ALGOR: segmented fixed-point PID.
//
// Eq. (2) of Xie et al. 2023, u(n) = (Kp + Kd) e(n) + Ki sum e(k) - Kd e(n-1), computed as Kp e + I + Kd (d(n) - d(n-1)) with
// three parallel multipliers; with d = e, unfiltered, and constant gains the two are the same to the bit (the sum is
// narrowed once, at its end). d is the error or the negated temperature (CTRL.D_ON_PV) behind a first-order low-pass.
// Segments: full power while the error is above BAND_FULL (fig. 7), or, with CTRL.SEG_MODEL, while P + D + feed-forward
// alone exceed the duty limit. Anti-windup: I is clamped to 0..DUTY_MAX and integrates only where that does not drive
// the output further into its limit.
//
// Droplets (rising edges of drop_i) since the last computation add FF_DROP each to the external feed-forward. While tuning_i
// the duty is ATUNE's, and the integral waits at its hold duty.
//
// start_i begins fourteen steps, one a clock; multiplier A also converts register units on the way. done_o follows.
// A refused sample (sample_ok_i low) keeps the duty as it is. While run_i is low duty and integral are zero.
`include "tc_assert.svh"

module tc_algor (
  input  logic              clk_i,
  input  logic              rst_ni,

  input  tc_pkg::params_t   params_i,
  input  logic              start_i,
  input  logic              sample_ok_i,
  input  logic              run_i,
  input  logic              at_temp_i,     // chooses KI_HOLD instead of KI_APPROACH
  input  logic              ms_i,
  input  logic signed [15:0] pv_i,         // Q9.6
  input  logic              drop_i,        // synchronised droplet trigger
  input  logic              tuning_i,
  input  logic [16:0]       tune_duty_i,   // UQ1.16
  input  logic [16:0]       tune_hold_i,

  output logic              done_o,
  output logic [16:0]       duty_o,        // UQ1.16
  output logic signed [15:0] sp_work_o,    // Q9.6
  output logic              ramping_o,
  output logic [31:0]       i_o,           // what one computation hands to the next, with sp_work_o ...
  output logic [21:0]       filt_o,
  output logic              still_o,       // ... and whether the next clock leaves it as it is
  output logic              limited_o,     // duty within 1/16 of DUTY_MAX
`ifndef SYNTHESIS
  output logic [4:0]        computing_o,   // clocks since the computation began, 0: none; for assertions
`endif
  output logic [1:0]        segment_o,     // 0 none, 1 full, 2 PID, 3 off
  output logic              i_held_o,      // integral did not move in the last step
  output logic [17:0]       hold_limit_o,  // largest plausible hold duty, UQ2.16
  output logic signed [15:0] target_o,     // SETPOINT, Q9.6
  output logic signed [15:0] amb_o,        // T_AMB, Q9.6
  output logic [16:0]       duty_max_o,    // UQ1.16
  output logic signed [17:0] term_p_o,     // Q1.16, saturated
  output logic signed [17:0] term_i_o,
  output logic signed [17:0] term_d_o
);

  localparam logic [1:0] SegNone = 2'd0;
  localparam logic [1:0] SegFull = 2'd1;
  localparam logic [1:0] SegPid  = 2'd2;
  localparam logic [1:0] SegOff  = 2'd3;
  // Unit conversions, UQ4.12: 0.1 degC -> 1/64 degC and 0.01 % -> 2^-16.
  localparam logic [15:0] TenthsToTemp  = 16'd26214;
  localparam logic [15:0] PercentToDuty = 16'd26844;
  // A ramp of r x 0.01 degC/s moves 1/64 degC each 3125 / (2 r) ms.
  localparam logic [12:0] RampModulus = 13'd3125;

  localparam logic [3:0] StepIdle = 4'd0;
  localparam logic [3:0] StepSetpoint = 4'd1;
  localparam logic [3:0] StepDutyMax = 4'd2;
  localparam logic [3:0] StepSlew = 4'd3;
  localparam logic [3:0] StepAmbient = 4'd4;
  localparam logic [3:0] StepExternal = 4'd5;
  localparam logic [3:0] StepFeedForward = 4'd6;
  localparam logic [3:0] StepHold = 4'd7;
  localparam logic [3:0] StepHoldAdd = 4'd8;
  localparam logic [3:0] StepDrops = 4'd9;
  localparam logic [3:0] StepPreset = 4'd10;
  localparam logic [3:0] StepError = 4'd11;
  localparam logic [3:0] StepProducts = 4'd12;
  localparam logic [3:0] StepSum = 4'd13;
  localparam logic [3:0] StepLimit = 4'd14;

  logic [3:0]         step_q;
  logic               done_q, fresh_q, i_held_q;
  logic signed [15:0] target_q, sp_work_q, amb_q, e_q, delta_q;
  logic [12:0]        ramp_q;
  logic [16:0]        duty_max_q, slew_q, ext_q, ff_q, u_q, duty_q;
  logic [17:0]        hold_q;
  logic signed [21:0] filt_q;           // low-pass state, 1/1024 degC
  logic signed [31:0] p_q, ie_q, d_q;   // products: 2^-6, 2^-14, 2^-7 duty LSB
  logic [31:0]        i_q;              // UQ17.14 duty LSB
  logic [1:0]         segment_q;
  logic               drop_q;           // drop_i one clock ago
  logic [7:0]         drops_q;          // droplets since the last computation

  logic seg_model, d_on_pv, ff_en, err_integer, i_zero, manual;
  assign seg_model   = params_i.ctrl[0];
  assign d_on_pv     = params_i.ctrl[1];
  assign ff_en       = params_i.ctrl[2];
  assign err_integer = params_i.ctrl[3];
  assign i_zero      = params_i.ctrl[6];
  assign manual      = params_i.mode[0];

  // ---- Multipliers: A is shared with the conversions --------------------------------------------------------------------

  logic [15:0]        a_gain;
  logic signed [15:0] a_term, ambient_rise;
  assign ambient_rise = tc_math_pkg::sat_s16(40'(pv_i) - 40'(amb_q));
  always_comb begin
    a_gain = params_i.kp;
    a_term = e_q;
    case (step_q)
      StepSetpoint:    begin a_gain = TenthsToTemp;       a_term = params_i.setpoint; end
      StepDutyMax:     begin a_gain = PercentToDuty;      a_term = params_i.duty_max; end
      StepSlew:        begin a_gain = PercentToDuty;      a_term = params_i.slew; end
      StepAmbient:     begin a_gain = TenthsToTemp;       a_term = params_i.t_amb; end
      StepExternal:    begin a_gain = PercentToDuty;      a_term = manual ? params_i.manual_duty : params_i.ff_ext; end
      StepFeedForward: begin a_gain = params_i.kff;       a_term = ambient_rise; end
      StepHold:        begin a_gain = params_i.hold_mult; a_term = {1'b0, ff_q[16:2]}; end
      StepHoldAdd:     begin a_gain = PercentToDuty;      a_term = params_i.hold_add; end
      StepDrops:       begin a_gain = params_i.ff_drop;   a_term = {8'd0, drops_q}; end
      StepPreset:      begin a_gain = params_i.preset;    a_term = {1'b0, ff_q[16:2]}; end
      default: ;
    endcase
  end

  logic [15:0] ki;
  assign ki = at_temp_i ? params_i.ki_hold : params_i.ki_approach;

  logic signed [32:0] product_a, product_b, product_c;
  assign product_a = $signed({1'b0, a_gain}) * a_term;
  assign product_b = $signed({1'b0, ki}) * e_q;
  assign product_c = $signed({1'b0, params_i.kd}) * delta_q;

  // UQ4.12 scaled result of a conversion, rounded.
  logic signed [39:0] converted;
  assign converted = (40'(product_a) + 40'sd2048) >>> 12;

  // External feed-forward with that of the droplets.
  logic [16:0] ext_drops;
  assign ext_drops = manual ? ext_q : tc_math_pkg::sat_duty((40'(product_a) >>> 4) + $signed({23'd0, ext_q}));

  // ---- Error and filtered derivative -------------------------------------------------------------------------------------

  logic signed [15:0] e_fine, e_now;
  assign e_fine = tc_math_pkg::sat_s16(40'(sp_work_q) - 40'(pv_i));
  // Whole degrees, truncated toward zero, as the published controller computes.
  assign e_now  = !err_integer ? e_fine
                : e_fine < 16'sd0 ? ((e_fine + 16'sd63) & 16'shFFC0) : (e_fine & 16'shFFC0);

  logic signed [21:0] d_source, filt_now;
  logic signed [22:0] filt_gap;
  assign d_source = (d_on_pv ? 22'sd0 - 22'(pv_i) : 22'(e_now)) <<< 4;
  assign filt_gap = 23'(d_source) - 23'(filt_q);
  assign filt_now = fresh_q ? d_source : filt_q + 22'(filt_gap >>> params_i.d_filter[2:0]);

  // ---- Sum, segments, anti-windup: everything in 2^-14 duty LSB ---------------------------------------------------------

  logic signed [41:0] pd, i_limit, i_sum, i_next, u_try, u_now;
  assign pd      = (42'(p_q) <<< 8) + (42'(d_q) <<< 7) + (manual ? 42'sd0 : $signed({11'd0, ext_q, 14'd0}));
  assign i_limit = $signed({11'd0, duty_max_q, 14'd0});
  assign i_sum   = $signed({10'd0, i_q}) + 42'(ie_q);
  assign i_next  = i_sum < 42'sd0 ? 42'sd0 : i_sum > i_limit ? i_limit : i_sum;
  assign u_try   = pd + i_next;

  logic e_pos, e_neg, accept_i, band_full, band_off, model_full, model_off, full, off;
  assign e_pos    = e_q > 16'sd0;
  assign e_neg    = e_q < 16'sd0;
  assign accept_i = !(u_try > i_limit && !e_neg) && !(u_try < 42'sd0 && !e_pos);
  // 1/320 degC on both sides: 5 x 1/64 and 32 x 0.1.
  logic signed [21:0] e_320;
  assign e_320     = 22'(e_q) * 22'sd5;
  assign band_full = e_320 > $signed({1'b0, params_i.band_full, 5'd0});
  assign band_off  = -e_320 > $signed({1'b0, params_i.band_off, 5'd0});
  logic signed [41:0] pd_ff;
  assign pd_ff      = pd + (ff_en ? $signed({11'd0, ff_q, 14'd0}) : 42'sd0);
  assign model_full = pd_ff > i_limit && e_pos;
  // Without feed-forward this rule makes a limit cycle around the set-point.
  assign model_off  = ff_en && pd_ff < 42'sd0 && e_neg;
  assign full = seg_model ? model_full : band_full;
  assign off  = seg_model ? model_off : band_off;

  // A preset above DUTY_MAX, or a DUTY_MAX that has just been lowered, clamps the integral too.
  logic [31:0] i_wanted, i_after;
  assign i_after  = $signed({10'd0, i_wanted}) > i_limit ? i_limit[31:0] : i_wanted;
  assign i_wanted = tuning_i ? {1'b0, tune_hold_i, 14'd0}
                 : full || off ? (i_zero ? 32'd0 : full && ff_en ? {1'b0, ff_q, 14'd0} : i_q)
                 : accept_i ? i_next[31:0] : i_q;
  assign u_now   = (pd + $signed({10'd0, i_after})) >>> 14;

  logic [16:0] u_limited, commanded, wanted, duty_next;
  assign u_limited = full ? duty_max_q : off ? 17'd0
                   : u_now > $signed({25'd0, duty_max_q}) ? duty_max_q : tc_math_pkg::sat_duty(40'(u_now));
  assign commanded = tuning_i ? tune_duty_i : manual ? ext_q : u_q;
  assign wanted    = commanded > duty_max_q ? duty_max_q : commanded;
  assign duty_next = slew_q != 17'd0 && {1'b0, wanted} > {1'b0, duty_q} + {1'b0, slew_q} ? duty_q + slew_q : wanted;

  logic dropped;
  assign dropped = drop_i && !drop_q;

  // ---- Set-point ramp ----------------------------------------------------------------------------------------------------

  logic        rising;
  logic [15:0] rate, target_rate;
  logic [12:0] ramp_sum;
  logic signed [15:0] target_now;
  assign rising   = target_q > sp_work_q;
  assign rate     = rising ? params_i.ramp_up : params_i.ramp_down;
  assign ramp_sum = ramp_q + {1'b0, rate[10:0], 1'b0};
  assign target_now  = tc_math_pkg::sat_s16(converted);
  assign target_rate = target_now > (run_i ? sp_work_q : pv_i) ? params_i.ramp_up : params_i.ramp_down;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      step_q     <= StepIdle;
      done_q     <= 1'b0;
      fresh_q    <= 1'b1;
      i_held_q   <= 1'b0;
      target_q   <= 16'sd0;
      sp_work_q  <= 16'sd0;
      amb_q      <= 16'sd0;
      e_q        <= 16'sd0;
      delta_q    <= 16'sd0;
      ramp_q     <= 13'd0;
      duty_max_q <= 17'd0;
      slew_q     <= 17'd0;
      ext_q      <= 17'd0;
      ff_q       <= 17'd0;
      u_q        <= 17'd0;
      duty_q     <= 17'd0;
      hold_q     <= 18'd0;
      filt_q     <= 22'sd0;
      p_q        <= 32'sd0;
      ie_q       <= 32'sd0;
      d_q        <= 32'sd0;
      i_q        <= 32'd0;
      segment_q  <= SegNone;
      drop_q     <= 1'b0;
      drops_q    <= 8'd0;
    end else begin
      done_q <= 1'b0;
      drop_q <= drop_i;
      if (dropped && drops_q != 8'hFF) drops_q <= drops_q + 8'd1;

      if (ms_i && run_i && target_q != sp_work_q && rate != 16'd0) begin
        if (ramp_sum >= RampModulus) begin
          ramp_q    <= ramp_sum - RampModulus;
          sp_work_q <= rising ? sp_work_q + 16'sd1 : sp_work_q - 16'sd1;
        end else begin
          ramp_q <= ramp_sum;
        end
      end

      case (step_q)
        StepIdle: begin
          if (start_i) begin
            if (sample_ok_i) step_q <= StepSetpoint;
            else done_q <= 1'b1;
          end
        end
        StepSetpoint: begin
          target_q <= target_now;
          if (target_rate == 16'd0) sp_work_q <= target_now;
          else if (!run_i) sp_work_q <= pv_i;
          step_q <= StepDutyMax;
        end
        StepDutyMax: begin
          duty_max_q <= tc_math_pkg::sat_duty(converted);
          step_q     <= StepSlew;
        end
        StepSlew: begin
          slew_q <= tc_math_pkg::sat_duty(converted);
          step_q <= StepAmbient;
        end
        StepAmbient: begin
          amb_q  <= tc_math_pkg::sat_s16(converted);
          step_q <= StepExternal;
        end
        StepExternal: begin
          ext_q  <= tc_math_pkg::sat_duty(converted);
          step_q <= StepFeedForward;
        end
        StepFeedForward: begin
          ff_q   <= tc_math_pkg::sat_duty(40'(product_a) >>> 12);
          step_q <= StepHold;
        end
        StepHold: begin
          // ff went in divided by four; HOLD_MULT is UQ8.8. Above 100 % there is nothing left to tell apart.
          hold_q <= {1'b0, tc_math_pkg::sat_duty(40'(product_a) >>> 6)};
          step_q <= StepHoldAdd;
        end
        StepHoldAdd: begin
          hold_q <= hold_q + {1'b0, tc_math_pkg::sat_duty(converted)};
          step_q <= StepDrops;
        end
        StepDrops: begin
          // A load that is announced needs power: no reason to trip.
          ext_q   <= ext_drops;
          hold_q  <= hold_q + {1'b0, ext_drops};
          drops_q <= {7'd0, dropped};
          step_q  <= StepPreset;
        end
        StepPreset: begin
          ff_q   <= tc_math_pkg::sat_duty(40'(product_a) >>> 6);
          step_q <= StepError;
        end
        StepError: begin
          e_q     <= e_now;
          delta_q <= fresh_q ? 16'sd0 : tc_math_pkg::sat_s16(40'(filt_now) - 40'(filt_q));
          filt_q  <= filt_now;
          step_q  <= StepProducts;
        end
        StepProducts: begin
          p_q    <= product_a[31:0];
          ie_q   <= product_b[31:0];
          d_q    <= product_c[31:0];
          step_q <= StepSum;
        end
        StepSum: begin
          u_q       <= u_limited;
          i_held_q  <= i_after == i_q;
          i_q       <= i_after;
          segment_q <= manual || tuning_i ? SegNone : full ? SegFull : off ? SegOff : SegPid;
          fresh_q   <= 1'b0;
          step_q    <= StepLimit;
        end
        StepLimit: begin
          duty_q <= duty_next;
          done_q <= 1'b1;
          step_q <= StepIdle;
        end
        default: step_q <= StepIdle;
      endcase

      // A stopped or manual loop keeps no history: the next automatic step starts without kick or windup.
      if (!run_i || manual) begin
        i_q     <= 32'd0;
        fresh_q <= 1'b1;
      end
      if (!run_i) begin
        drops_q   <= 8'd0;
        duty_q    <= 17'd0;
        segment_q <= SegNone;
      end
    end
  end

  // Narrowing of a term to Q1.16.
  function automatic logic signed [17:0] sat_term(input logic signed [39:0] x);
    if (x > 40'sd131071) sat_term = 18'sd131071;
    else if (x < -40'sd131072) sat_term = -18'sd131072;
    else sat_term = x[17:0];
  endfunction

  assign done_o       = done_q;
  assign duty_o       = duty_q;
  assign sp_work_o    = sp_work_q;
  assign ramping_o    = sp_work_q != target_q;
  assign i_o          = i_q;
  assign filt_o       = filt_q;
  assign still_o      = step_q == StepIdle && !start_i && !done_q && run_i && !manual && !(ramping_o && ms_i);
  // The integral may stop just short of the limit.
  assign limited_o    = {1'b0, duty_q} + {5'd0, duty_max_q[16:4]} >= {1'b0, duty_max_q} && duty_q != 17'd0;
  assign segment_o    = segment_q;
  assign i_held_o     = i_held_q;
  assign hold_limit_o = hold_q;
  assign target_o     = target_q;
  assign amb_o        = amb_q;
  assign duty_max_o   = duty_max_q;
  assign term_p_o     = sat_term(40'(p_q) >>> 6);
  assign term_i_o     = $signed({1'b0, i_q[30:14]});
  assign term_d_o     = sat_term(40'(d_q) >>> 7);

  logic unused;
  assign unused = ^{product_a[32], product_b[32], product_c[32], i_next[41:32], u_now[41:40], params_i};

`ifndef SYNTHESIS
  `TC_ASSERT_SETUP
  `TC_ASSERT(AlgorIntegralInRange_A, i_q <= {1'b0, 17'd65536, 14'd0})
  `TC_ASSERT(AlgorDutyInRange_A, duty_q <= 17'd65536)
  `TC_ASSERT(AlgorOperandsInRange_A, duty_max_q <= 17'd65536 && slew_q <= 17'd65536 && ext_q <= 17'd65536 &&
             ff_q <= 17'd65536 && u_q <= 17'd65536)
  `TC_ASSERT_IF(AlgorWantedLimited_A, step_q == StepLimit, u_q <= duty_max_q)
  `TC_ASSERT_IF(AlgorHoldFirstPart_A, step_q == StepHoldAdd, hold_q <= 18'd65536)
  `TC_ASSERT_IF(AlgorHoldBothParts_A, step_q == StepDrops, hold_q <= 18'd131072)
  `TC_ASSERT(AlgorStepLegal_A, step_q <= StepLimit)
  `TC_ASSERT_NEXT(AlgorStoppedIsZero_A, !run_i, duty_q == 17'd0 && i_q == 32'd0)
  // P15: a computation ends within fifteen clocks.
  logic [4:0] computing;
  logic       resumed_q;                   // set by a bench that loads flops
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      resumed_q <= 1'b0;
      computing <= 5'd0;
    end else begin
      resumed_q <= 1'b0;
      computing <= start_i && step_q == StepIdle ? 5'd1
                 : done_q || resumed_q || computing == 5'd0 ? 5'd0 : computing + 5'(computing != 5'h1F);
    end
  end
  assign computing_o = computing;
  `TC_ASSERT_IF(P15_AlgorAnswers_A, computing != 5'd0, computing <= 5'd15)
`ifdef FORMAL
  `TC_ASSERT(AlgorComputing_A, step_q != StepIdle ? computing == {1'b0, step_q} && !done_q
             : done_q ? computing == 5'd1 || computing == 5'd15 : computing == 5'd0)
`endif
  // P12: no sum wraps: each is its exact value, computed with bits to spare.
  logic signed [47:0] pd_exact;
  assign pd_exact = (48'(p_q) <<< 8) + (48'(d_q) <<< 7) + (manual ? 48'sd0 : $signed({17'd0, ext_q, 14'd0}));
  `TC_ASSERT(P12_SumsExact_A, 48'(pd) == pd_exact && 48'(i_sum) == $signed({16'd0, i_q}) + 48'(ie_q) &&
             48'(u_try) == pd_exact + 48'(i_next) &&
             48'(pd_ff) == pd_exact + (ff_en ? $signed({17'd0, ff_q, 14'd0}) : 48'sd0))
  `TC_ASSERT(P12_ErrorExact_A, 24'(e_320) == 24'(e_q) * 24'sd5 && 24'(filt_gap) == 24'(d_source) - 24'(filt_q))
  // P12: the integral stays between 0 and DUTY_MAX after each computation,
  `TC_ASSERT_IF(P12_IntegralLimited_A, step_q == StepLimit, i_q <= i_limit[31:0])
  // and so does the duty.
  `TC_ASSERT_NEXT(P12_DutyLimited_A, step_q == StepLimit, duty_q <= duty_max_q)
  // P12: with the same integral and derivative a larger error never gives a smaller output. The sum is computed once more for a
  // smaller error, that of the computation before; its product is smaller because no gain is negative.
  logic signed [15:0] e_less;
  logic signed [31:0] p_less;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      e_less <= 16'sd0;
      p_less <= 32'sd0;
    end else if (step_q == StepSum) begin
      e_less <= e_q;
      p_less <= p_q;
    end
  end
  logic signed [41:0] pd_less, pd_ff_less, u_try_less, u_less;
  logic               full_less, off_less, accept_less;
  logic [31:0]        i_less, i_after_less;
  logic [16:0]        u_limited_less;
  assign pd_less     = pd - (42'(p_q) <<< 8) + (42'(p_less) <<< 8);
  assign pd_ff_less  = pd_less + (pd_ff - pd);
  assign full_less   = seg_model ? pd_ff_less > i_limit && e_less > 16'sd0
                                 : 22'(e_less) * 22'sd5 > $signed({1'b0, params_i.band_full, 5'd0});
  assign off_less    = seg_model ? ff_en && pd_ff_less < 42'sd0 && e_less < 16'sd0
                                 : 22'(e_less) * -22'sd5 > $signed({1'b0, params_i.band_off, 5'd0});
  assign u_try_less  = pd_less + i_next;
  assign accept_less = !(u_try_less > i_limit && e_less >= 16'sd0) && !(u_try_less < 42'sd0 && e_less <= 16'sd0);
  assign i_less      = full_less || off_less ? (i_zero ? 32'd0 : full_less && ff_en ? {1'b0, ff_q, 14'd0} : i_q)
                     : accept_less ? i_next[31:0] : i_q;
  assign i_after_less   = $signed({10'd0, i_less}) > i_limit ? i_limit[31:0] : i_less;
  assign u_less         = (pd_less + $signed({10'd0, i_after_less})) >>> 14;
  assign u_limited_less = full_less ? duty_max_q : off_less || u_less < 42'sd0 ? 17'd0
                        : u_less > $signed({25'd0, duty_max_q}) ? duty_max_q : u_less[16:0];
  `TC_ASSERT_IF(P12_Monotone_A, step_q == StepSum && !tuning_i && e_less <= e_q && p_less <= p_q && i_after_less == i_after,
                u_limited_less <= u_limited)
  logic unused_less;
  assign unused_less = ^u_less;
`ifndef TC_ALGOR_CUT
  // P12: the products fit.
  `TC_ASSERT_IF(AlgorProductsFit_A, step_q == StepProducts,
                product_a[32] == product_a[31] && product_b[32] == product_b[31] && product_c[32] == product_c[31])
`endif
`endif

endmodule
