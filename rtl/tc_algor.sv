// SPDX-License-Identifier: Apache-2.0
// ALGOR: segmented fixed-point PID.
//
// Eq. (2) of Xie et al. 2023, u(n) = (Kp + Kd) e(n) + Ki sum e(k) - Kd e(n-1), computed as Kp e + I + Kd (d(n) -
// d(n-1)); with d = e, unfiltered, and constant gains the two are the same to the bit (the sum is narrowed once, at its
// end). d is the error or the negated temperature (CTRL.D_ON_PV) behind a first-order low-pass. Segments: full power
// while the error is above BAND_FULL (fig. 7), or, with CTRL.SEG_MODEL, while P + D + feed-forward alone exceed the
// duty limit. Anti-windup: I is clamped to 0..DUTY_MAX and integrates only where that does not drive the output further
// into its limit.
//
// Droplets (rising edges of drop_i) since the last computation add FF_DROP each to the external feed-forward. While
// tuning_i the duty is ATUNE's, and the integral waits at its hold duty.
//
// start_i begins eighteen steps, one a clock; done_o follows. One multiplier does the three products of the law and,
// before them, the conversions of register units. Its result waits a clock in work_q and is used in the step after: no
// clock sees a multiplication and a sum in a row. A refused sample (sample_ok_i low) keeps the duty as it is. While
// run_i is low duty and integral are zero.
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
  input  logic              hold_test_i,   // GUARD tests the reading: less duty, and the integral waits
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
  output logic [1:0]        segment_o,     // tc_pkg::Seg*
  output logic              i_held_o,      // integral did not move in the last step
  output logic [17:0]       hold_limit_o,  // largest plausible hold duty, UQ2.16
  output logic signed [15:0] target_o,     // SETPOINT, Q9.6
  output logic signed [15:0] amb_o,        // T_AMB, Q9.6
  output logic [16:0]       duty_max_o,    // UQ1.16
  output logic signed [17:0] term_p_o,     // Q1.16, saturated
  output logic signed [17:0] term_i_o,
  output logic signed [17:0] term_d_o
);

  // Bits of a product or a sum below the LSB of what it becomes: 1/64 degC of a temperature, 2^-16 of a duty.
  localparam int unsigned ConvertFraction = 12;  // conversions, and KFF times a temperature: UQ4.12
  localparam int unsigned ShareFraction   = 6;   // HOLD_MULT, UQ8.8, or PRESET, UQ0.8, times a duty as UQ1.14
  localparam int unsigned DropFraction    = 4;   // FF_DROP, 2^-20, times droplets
  localparam int unsigned PFraction       = 6;   // KP, UQ10.6, times the error
  localparam int unsigned PdFraction      = 7;   // KD, UQ13.3, times what d moved by, 1/1024 degC; pd_q
  localparam int unsigned IFraction       = 14;  // KI, UQ2.14, times the error; i_q and u_sum

  // Unit conversions: 0.1 degC -> 1/64 degC and 0.01 % -> 2^-16.
  localparam logic [15:0] TenthsToTemp  = 16'd26214;
  localparam logic [15:0] PercentToDuty = 16'd26844;
  // A ramp of r x 0.01 degC/s moves 1/64 degC each 3125 / (2 r) ms.
  localparam logic [12:0] RampModulus = 13'd3125;

`include "tc_algor_steps.svh"

  step_e              step_q;
  logic               done_q;           // a result is there
  logic               fresh_q;          // the loop has no past: d has not moved
  // Register values in the loop's units, converted anew in each computation.
  logic signed [15:0] target_q;         // SETPOINT, Q9.6
  logic signed [15:0] amb_q;            // T_AMB, Q9.6
  logic [16:0]        duty_max_q;       // DUTY_MAX, UQ1.16
  logic [16:0]        slew_q;           // SLEW, UQ1.16; 0: no limit
  logic [16:0]        ext_q;            // MANUAL_DUTY, or FF_EXT and the droplets' share; UQ1.16
  logic [16:0]        ff_q;             // KFF times the rise above ambient, then PRESET of it; UQ1.16
  logic [17:0]        hold_q;           // largest plausible hold duty, UQ2.16
  // The working set-point.
  logic signed [15:0] sp_work_q;        // Q9.6
  logic [12:0]        ramp_q;           // how far its next step has come, below RampModulus
  // The law.
  logic signed [15:0] e_q;              // error, Q9.6
  logic signed [15:0] delta_q;          // rise above ambient, Q9.6; then what the filtered d moved by, 1/1024 degC
  logic signed [21:0] filt_q;           // low-pass state, 1/1024 degC
  // From step to step: a product; the integral to come, UQ17.14; the output, UQ1.16.
  logic signed [31:0] work_q;
  logic signed [33:0] pd_q;             // P + D + external feed-forward, PdFraction
  logic [31:0]        i_q;              // the integral, UQ17.14 duty LSB
  logic               i_held_q;         // it did not move in the last computation
  logic               full_q, off_q;    // segment of this computation: full power, none
  logic [1:0]         segment_q;        // of the last one, tc_pkg::Seg*
  logic signed [17:0] term_p_q, term_d_q;  // P and D for the host, Q1.16, saturated
  logic [16:0]        duty_q;           // UQ1.16
  // Droplets.
  logic               drop_q;           // drop_i one clock ago
  logic [7:0]         drops_q;          // since the last computation; stops at its top

  logic seg_model, d_on_pv, ff_en, err_integer, i_zero, manual;
  assign seg_model   = params_i.ctrl[tc_pkg::CtrlSegModel];
  assign d_on_pv     = params_i.ctrl[tc_pkg::CtrlDOnPv];
  assign ff_en       = params_i.ctrl[tc_pkg::CtrlFfEn];
  assign err_integer = params_i.ctrl[tc_pkg::CtrlErrInteger];
  assign i_zero      = params_i.ctrl[tc_pkg::CtrlIZero];
  assign manual      = params_i.mode[tc_pkg::ModeManual];

  // ---- The multiplier -----------------------------------------------------------------------------------------------

  logic [15:0]        gain, ki;
  logic signed [15:0] term;
  assign ki = at_temp_i ? params_i.ki_hold : params_i.ki_approach;
  always_comb begin
    gain = ki;
    term = e_q;
    unique case (step_q)
      StepAmbient:      begin gain = TenthsToTemp;       term = params_i.t_amb; end
      StepSetpoint:     begin gain = TenthsToTemp;       term = params_i.setpoint; end
      StepDutyMax:      begin gain = PercentToDuty;      term = params_i.duty_max; end
      StepFeedForward:  begin gain = params_i.kff;       term = delta_q; end
      StepHoldAdd:      begin gain = PercentToDuty;      term = params_i.hold_add; end
      StepHold:         begin gain = params_i.hold_mult; term = {1'b0, ff_q[16:2]}; end
      StepPreset:       begin gain = params_i.preset;    term = {1'b0, ff_q[16:2]}; end
      StepExternal:     begin gain = PercentToDuty;      term = manual ? params_i.manual_duty : params_i.ff_ext; end
      StepDrops:        begin gain = params_i.ff_drop;   term = {8'd0, drops_q}; end
      StepSlew:         begin gain = PercentToDuty;      term = params_i.slew; end
      StepDerivative:   begin gain = params_i.kd;        term = delta_q; end
      StepProportional: gain = params_i.kp;
      default: ;
    endcase
  end

  logic signed [32:0] product;
  assign product = $signed({1'b0, gain}) * term;

  // ---- Scaling: the product of the step before in the units of a flop -----------------------------------------------

  logic signed [28:0] whole, scaled;
  logic [16:0]        addend;
  logic               round_up;
  logic signed [15:0] scaled_temp;       // Q9.6
  logic [16:0]        scaled_duty;       // UQ1.16
  always_comb begin
    addend   = 17'd0;
    round_up = 1'b0;
    unique case (step_q)
      // Feed-forward; not rounded.
      StepHoldAdd: whole = 29'(work_q >>> ConvertFraction);
      // Shares of the feed-forward; above 100 % there is nothing left to tell apart.
      StepPreset, StepExternal: whole = 29'(work_q >>> ShareFraction);
      // The droplets' share, on top of the external feed-forward.
      StepSlew: begin
        whole  = 29'(work_q >>> DropFraction);
        addend = ext_q;
      end
      // Conversions.
      default: begin
        whole    = 29'(work_q >>> ConvertFraction);
        round_up = work_q[ConvertFraction-1];
      end
    endcase
  end
  assign scaled      = whole + $signed({12'd0, addend}) + $signed({28'd0, round_up});
  assign scaled_temp = tc_math_pkg::sat_s16(40'(scaled));
  assign scaled_duty = tc_math_pkg::sat_duty(40'(scaled));

  // What adds to the largest plausible hold duty.
  logic [16:0] hold_part;
  assign hold_part = step_q == StepSlew && manual ? ext_q : scaled_duty;

  // ---- Error and filtered derivative --------------------------------------------------------------------------------

  // The rise above ambient, the error, the negated temperature: one difference, Q9.6.
  logic signed [15:0] minuend, subtrahend;
  logic signed [16:0] gap;
  logic signed [15:0] gap_fine, e_now;
  always_comb begin
    minuend    = 16'sd0;
    subtrahend = pv_i;
    unique case (step_q)
      StepDutyMax: begin
        minuend    = pv_i;
        subtrahend = amb_q;
      end
      StepExternal: minuend = sp_work_q;
      default: ;
    endcase
  end
  assign gap      = 17'(minuend) - 17'(subtrahend);
  assign gap_fine = tc_math_pkg::sat_s16(40'(gap));
  // Whole degrees, truncated toward zero, as the published controller computes.
  assign e_now    = err_integer ? {gap_fine[15:6] + 10'(gap_fine[15] && gap_fine[5:0] != 6'd0), 6'd0} : gap_fine;

  // d and its low-pass, 1/1024 degC.
  logic signed [22:0] d_source, filt_gap, filt_step;
  assign d_source  = (d_on_pv ? 23'(gap) : 23'(e_q)) <<< 4;
  assign filt_gap  = d_source - 23'(filt_q);
  assign filt_step = filt_gap >>> params_i.d_filter[2:0];

  // ---- P + D, segments: PdFraction ----------------------------------------------------------------------------------

  // A product of P or D without its fraction as Q1.16.
  function automatic logic signed [17:0] sat_term(input logic signed [25:0] x);
    if (x[25:17] == {9{x[25]}}) sat_term = x[17:0];
    else sat_term = {x[25], {17{!x[25]}}};
  endfunction

  // A duty beside pd_q.
  function automatic logic signed [34:0] pd_of(input logic [16:0] duty);
    pd_of = $signed({18'd0, duty}) <<< PdFraction;
  endfunction

  // External feed-forward + D, then with P, then with the feed-forward that judges the segment.
  logic signed [34:0] pd_sum;
  logic signed [34:0] pd_addend;
  always_comb begin
    unique case (step_q)
      StepProportional: pd_addend = pd_of(manual ? 17'd0 : ext_q);
      StepIntegral:     pd_addend = 35'(work_q) <<< (PdFraction - PFraction);
      default:          pd_addend = pd_of(ff_en ? ff_q : 17'd0);
    endcase
  end
  assign pd_sum = (step_q == StepProportional ? 35'(work_q) : 35'(pd_q)) + pd_addend;

  logic e_pos, e_neg, e_far;
  assign e_pos = !e_neg && e_q != 16'sd0;
  assign e_neg = e_q[15];
  // 1/320 degC on both sides: 5 x 1/64 and 32 x 0.1.
  logic signed [21:0] e_320, e_size, band;
  assign e_320  = (22'(e_q) <<< 2) + 22'(e_q);
  assign e_size = e_neg ? -e_320 : e_320;
  assign band   = $signed({1'b0, e_neg ? params_i.band_off : params_i.band_full, 5'd0});
  assign e_far  = e_size > band;
  logic model_full, model_off;
  assign model_full = pd_sum > pd_of(duty_max_q) && e_pos;
  // Without feed-forward this rule makes a limit cycle around the set-point.
  assign model_off  = ff_en && pd_sum[34] && e_neg;

  // ---- Integral, anti-windup, output: IFraction ---------------------------------------------------------------------

  logic [30:0] limit_i;                  // DUTY_MAX beside the integral
  assign limit_i = {duty_max_q, 14'd0};

  // The integral to come; P + I + D with it; its limit; P + I + D with what came of it. Compared with DUTY_MAX, the
  // last as the whole duty LSB that the output has.
  logic signed [41:0] u_base, u_addend, u_sum;
  logic               u_neg, u_over;
  always_comb begin
    u_base   = 42'(pd_q) <<< (IFraction - PdFraction);
    u_addend = $signed({10'd0, i_q});
    unique case (step_q)
      StepSegment:    u_base = 42'(work_q);
      StepAntiWindup: u_addend = 42'(work_q);
      StepClamp: begin
        u_base   = $signed({10'd0, work_q});
        u_addend = 42'sd0;
      end
      default: ;
    endcase
  end
  assign u_sum  = u_base + u_addend;
  assign u_neg  = u_sum[41];
  logic signed [27:0] u_whole;           // duty LSB
  logic               u_digits;          // and more than that
  assign u_whole  = u_sum[41:14];
  assign u_digits = step_q != StepOutput && u_sum[13:0] != 14'd0;
  assign u_over   = u_whole > $signed({11'd0, duty_max_q}) || (u_whole == $signed({11'd0, duty_max_q}) && u_digits);

  logic [31:0] i_limited;
  assign i_limited = u_neg ? 32'd0 : u_over ? {1'b0, limit_i} : u_sum[31:0];
  logic accept_i;
  assign accept_i  = !hold_test_i && !(u_over && !e_neg) && !(u_neg && !e_pos);

  logic [31:0] i_wanted;
  assign i_wanted = tuning_i ? {1'b0, tune_hold_i, 14'd0}
                 : full_q || off_q ? (i_zero ? 32'd0 : full_q && ff_en ? {1'b0, ff_q, 14'd0} : i_q)
                 : accept_i ? work_q : i_q;

  logic [16:0] u_limited, commanded, test_max, wanted, duty_next;
  logic [17:0] slewed;
  assign u_limited = full_q ? duty_max_q : off_q ? 17'd0
                   : u_over ? duty_max_q : tc_math_pkg::sat_duty(40'(u_whole));
  assign commanded = tuning_i ? tune_duty_i : manual ? ext_q : work_q[16:0];
  assign test_max  = hold_q[17:1];
  assign wanted    = hold_test_i && commanded > test_max && test_max < duty_max_q ? test_max
                   : commanded > duty_max_q ? duty_max_q : commanded;
  assign slewed    = {1'b0, duty_q} + {1'b0, slew_q};
  assign duty_next = slew_q != 17'd0 && slewed < {1'b0, wanted} ? slewed[16:0] : wanted;

  logic dropped;
  assign dropped = drop_i && !drop_q;

  // ---- Set-point ramp -----------------------------------------------------------------------------------------------

  logic        rising, will_rise, up_steps, down_steps;   // a rate of 0 is a step
  logic signed [15:0] ramp_from;
  logic [10:0] rate;
  logic [12:0] ramp_sum;
  assign rising     = sp_work_q < target_q;
  assign ramp_from  = run_i ? sp_work_q : pv_i;
  assign will_rise  = ramp_from < scaled_temp;
  assign up_steps   = params_i.ramp_up == 16'd0;
  assign down_steps = params_i.ramp_down == 16'd0;
  assign rate       = rising ? params_i.ramp_up[10:0] : params_i.ramp_down[10:0];
  assign ramp_sum   = ramp_q + {1'b0, rate, 1'b0};

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
      duty_q     <= 17'd0;
      hold_q     <= 18'd0;
      term_p_q   <= 18'sd0;
      term_d_q   <= 18'sd0;
      filt_q     <= 22'sd0;
      work_q     <= 32'sd0;
      pd_q       <= 34'sd0;
      i_q        <= 32'd0;
      full_q     <= 1'b0;
      off_q      <= 1'b0;
      segment_q  <= tc_pkg::SegNone;
      drop_q     <= 1'b0;
      drops_q    <= 8'd0;
    end else begin
      done_q <= 1'b0;
      drop_q <= drop_i;
      if (dropped && drops_q != 8'hFF) drops_q <= drops_q + 8'd1;

      if (ms_i && run_i && ramping_o && !(rising ? up_steps : down_steps)) begin
        if (ramp_sum >= RampModulus) begin
          ramp_q    <= ramp_sum - RampModulus;
          sp_work_q <= rising ? sp_work_q + 16'sd1 : sp_work_q - 16'sd1;
        end else begin
          ramp_q <= ramp_sum;
        end
      end

      if (step_q >= StepAmbient && step_q <= StepIntegral) work_q <= product[31:0];
      unique case (step_q)
        StepIdle: begin
          if (start_i) begin
            if (sample_ok_i) step_q <= StepAmbient;
            else done_q <= 1'b1;
          end
        end
        StepAmbient: step_q <= StepSetpoint;
        StepSetpoint: begin
          amb_q  <= scaled_temp;
          step_q <= StepDutyMax;
        end
        StepDutyMax: begin
          target_q <= scaled_temp;
          if (will_rise ? up_steps : down_steps) sp_work_q <= scaled_temp;
          else if (!run_i) sp_work_q <= pv_i;
          delta_q <= gap_fine;
          step_q  <= StepFeedForward;
        end
        StepFeedForward: begin
          duty_max_q <= scaled_duty;
          step_q     <= StepHoldAdd;
        end
        StepHoldAdd: begin
          ff_q   <= scaled_duty;
          step_q <= StepHold;
        end
        StepHold: begin
          hold_q <= {1'b0, hold_part};
          step_q <= StepPreset;
        end
        StepPreset: begin
          hold_q <= hold_q + {1'b0, hold_part};
          step_q <= StepExternal;
        end
        StepExternal: begin
          ff_q   <= scaled_duty;
          e_q    <= e_now;
          step_q <= StepDrops;
        end
        StepDrops: begin
          ext_q   <= scaled_duty;
          delta_q <= fresh_q ? 16'sd0 : tc_math_pkg::sat_s16(40'(filt_step));
          filt_q  <= fresh_q ? d_source[21:0] : filt_q + filt_step[21:0];
          drops_q <= {7'd0, dropped};
          step_q  <= StepSlew;
        end
        StepSlew: begin
          // A load that is announced needs power: no reason to trip.
          if (!manual) ext_q <= scaled_duty;
          hold_q <= hold_q + {1'b0, hold_part};
          step_q <= StepDerivative;
        end
        StepDerivative: begin
          slew_q <= scaled_duty;
          step_q <= StepProportional;
        end
        StepProportional: begin
          term_d_q <= sat_term(26'(work_q >>> PdFraction));
          pd_q     <= pd_sum[33:0];
          step_q   <= StepIntegral;
        end
        StepIntegral: begin
          term_p_q <= sat_term(26'(work_q >>> PFraction));
          pd_q     <= pd_sum[33:0];
          step_q   <= StepSegment;
        end
        StepSegment: begin
          full_q <= seg_model ? model_full : e_far && !e_neg;
          off_q  <= seg_model ? model_off : e_far && e_neg;
          work_q <= i_limited;
          step_q <= StepAntiWindup;
        end
        StepAntiWindup: begin
          work_q <= i_wanted;
          step_q <= StepClamp;
        end
        StepClamp: begin
          // A preset above DUTY_MAX, or a DUTY_MAX that has just been lowered, clamps the integral too.
          i_held_q <= i_limited == i_q;
          i_q      <= i_limited;
          step_q   <= StepOutput;
        end
        StepOutput: begin
          work_q    <= {15'd0, u_limited};
          segment_q <= manual || tuning_i ? tc_pkg::SegNone
                     : full_q ? tc_pkg::SegFull : off_q ? tc_pkg::SegOff : tc_pkg::SegPid;
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
        segment_q <= tc_pkg::SegNone;
      end
    end
  end

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
  assign term_p_o     = term_p_q;
  assign term_i_o     = $signed({1'b0, i_q[30:14]});
  assign term_d_o     = term_d_q;

  logic unused;
  assign unused = ^{product[32], filt_step[22], params_i};

`ifndef SYNTHESIS
  tc_algor_properties u_properties (
    .clk_i, .rst_ni,
    .params_i, .start_i, .run_i, .hold_test_i, .tuning_i, .tune_hold_i,
    .step_i(step_q), .done_i(done_q), .computing_o,
    .e_i(e_q), .e_320_i(e_320), .d_source_i(d_source), .filt_i(filt_q), .filt_gap_i(filt_gap),
    .product_i(product), .work_i(work_q), .pd_i(pd_q), .pd_sum_i(pd_sum), .u_sum_i(u_sum), .u_limited_i(u_limited),
    .i_i(i_q), .limit_i(limit_i), .full_i(full_q), .off_i(off_q),
    .duty_i(duty_q), .duty_max_i(duty_max_q), .slew_i(slew_q), .ext_i(ext_q), .ff_i(ff_q), .hold_i(hold_q)
  );
`endif

endmodule
