// SPDX-License-Identifier: Apache-2.0
// GUARD: accepts samples, watches for faults, and alone decides whether heater_o may be high.
//
// Every detector writes one bit of cause_q; a cause latches into fault_q (FaultRunOnly causes only while heating is
// on), and from the same clock edge on heater_q is low: a fault is at most two clocks behind its cause. fault_q stays
// until a keyed clear with the cause gone. The first fault since clear is kept. safe_en_o toggles only while heating is
// permitted, so a stopped clock opens the second switch as well. Faults and their meaning: docs/chip/registers.md.
//
// The permission stands in two flops of opposite level: a single upset can not turn the heater on.
`include "tc_assert.svh"

module tc_guard (
  input  logic               clk_i,
  input  logic               rst_ni,

  input  tc_pkg::params_t    params_i,
  input  logic               tenth_i,          // pulse each 0.1 s

  // Sensor.
  input  logic               sens_done_i,
  input  tc_types_pkg::reading_t sens_i,

  // Control loop.
  input  logic [16:0]        duty_i,           // UQ1.16
  input  logic [17:0]        hold_limit_i,     // hold power, UQ2.16
  input  logic               limited_i,
  input  logic [1:0]         segment_i,        // tc_pkg::Seg*
  input  logic signed [15:0] sp_work_i,        // Q9.6 degC
  input  logic               ramping_i,
  input  logic               pwm_i,

  // Commands and supervision.
  input  logic               run_i,            // pulses
  input  logic               stop_i,
  input  logic               clear_i,
  input  logic               good_frame_i,
  input  logic               mem_bad_i,
  input  logic               state_illegal_i,
  input  logic               overrun_i,
  // parity of flops that decide over the heater for longer than a control tick ...
  input  logic [1:0]         watch_parity_i,
  input  logic [1:0]         watch_still_i,    // ... and whether the next clock leaves them as they are
  input  logic               inhibit_i,        // synchronised
  input  logic               heater_fb_i,      // synchronised

  output logic               heater_o,         // to the pin's gate
  output logic               safe_en_o,
  output logic               run_o,
  output logic               run_allowed_o,
  output logic               at_temp_o,
  output logic               sensor_ok_o,
  output logic               sample_held_o,    // last sample refused, the one before is in use
  output logic               hold_test_o,      // less duty, please: does the reading follow?
  output logic               wd_armed_o,
  output logic               permitted_o,      // heating permitted: safe_en_o toggles
  output logic               pv_valid_o,
  output logic signed [15:0] pv_o,             // last accepted sample, Q9.6 degC
  output logic [15:0]        slope_o,          // signed: its distance from the one before, Q9.6 degC
  output logic [15:0]        samples_o,        // accepted; wraps
  output logic [15:0]        sensor_errors_o,  // frames refused; wraps
  output logic [15:0]        wd_left_o,        // till the host watchdog trips, 0.1 s
`ifndef SYNTHESIS
  output logic               accept_o,         // this clock's sample is accepted; for assertions
`endif
  output logic [tc_pkg::FaultCount-1:0] cause_o,
  output logic [tc_pkg::FaultCount-1:0] fault_o,
  output logic [3:0]         first_fault_o     // 1 + bit number, 0 none
);

  localparam logic [3:0] RateTenths = 4'd10;   // DTDT_MAX is a change within 1 s
  // 20 degC above ambient a head without heat must cool; 1/64 degC
  localparam logic signed [16:0] HotAbove = 17'sd1280;
  // Heat balance: the steps in which its two serial products are ready, and the largest differences, 2^-16 / 5 of
  // full duty. A supply that is higher than in commissioning heats faster, so more is allowed upwards.
  localparam logic [4:0]         HeatNeed = 5'd17;       // KFF, 16 bits
  localparam logic [4:0]         HeatMove = 5'd27;       // HEAT_RATE, 9 bits
  localparam logic signed [31:0] HeatLow = 32'sd20480;   // 1/16
  localparam logic signed [31:0] HeatHigh = 32'sd30720;  // 3/32

  // Heater permission.
  logic        run_q, run_nq;                  // heating is on; the same once more, inverted
  logic        heater_q, safe_en_q;            // to the pins
  logic [9:0]  safe_cnt_q;                     // clocks since safe_en_q has toggled
  logic [tc_pkg::FaultCount-1:0] cause_q, cause_d;  // what is wrong now
  logic [tc_pkg::FaultCount-1:0] fault_q;           // what has been wrong since the last clear
  logic [3:0]  first_q;                        // which of it came first: 1 + bit number, 0 none
  logic [1:0]  watch_parity_q, watch_still_q;  // of the watched flops, one clock ago
  // Samples.
  logic               pv_valid_q;              // a sample has been accepted since reset
  logic               bad_dev_q;               // the last refused one had a fault bit of the sensor
  logic               settled_q;               // two samples in a row have agreed since reset
  logic signed [15:0] pv_q;                    // the last accepted one, Q9.6
  logic signed [15:0] slope_q;                 // how far it is from the one before, 1/64 degC
  logic [15:0]        samples_q, sensor_errors_q;  // accepted and refused ones, modulo 65536
  logic [15:0]        stale_q;                 // 0.1 s since a sample was accepted
  logic [3:0]         bad_q;                   // refused samples in a row
  logic signed [15:0] rate_ref_q;              // temperature before the present second
  logic [3:0]         rate_cnt_q;              // its tenths, to RateTenths
  // Detectors. For how long something has been so, 0.1 s, and the temperature that a rise is measured from.
  logic signed [15:0] lba_ref_q, hold_ref_q, zero_ref_q;
  logic [15:0]        lba_q;                   // full duty without a rise
  logic [15:0]        hold_q;                  // more than the head can need to hold, without a rise; then in the test
  logic               hold_test_q;             // the duty is held down to see whether the reading falls
  logic [4:0]         hold_shown_q;            // below this duty it has fallen before, sixteenths
  logic [15:0]        exc_q;                   // above the set-point by more than EXC_LIMIT
  logic [15:0]        zero_q;                  // no duty
  logic [15:0]        frozen_q;                // no duty, hot, and no sample moved
  logic [15:0]        wd_q;                    // heating without a good frame
  logic [15:0]        at_q;                    // inside the window
  logic [19:0]        fb_q;                    // clocks: the heater's feedback differs from it
  logic signed [15:0] sp_past_q;               // set-point one clock ago
  logic               exc_armed_q;             // the temperature has been at or below the window's top
  logic               rate_q;                  // the accepted sample jumped
  logic               lba_trip_q;
  logic               at_temp_q;
  // Sums of 16 values that forget.
  logic signed [19:0] temp_sum_q;              // of the accepted temperatures, 1/64 degC
  logic [20:0]        duty_sum_q;              // of the duty at each of them
  // Heat balance. A temperature is the duty that would hold it, 2^-16 / 5.
  logic [4:0]         heat_step_q;             // 0: nothing to do
  logic signed [31:0] heat_x_q;                // what is multiplied
  logic signed [39:0] heat_acc_q;              // the product so far
  logic signed [39:0] heat_seen_q;             // the temperature to which the heat leads, 12 bits of fraction more
  logic [15:0]        heat_set_q;              // KFF and T_AMB in which it is told, folded
  logic               heat_known_q;            // it is told in these
  logic               heat_low_q, heat_high_q; // the reading is far below it, far above it

  // ---- Samples ------------------------------------------------------------------------------------------------------

  logic               far, jump, jump_stays, accept, refuse;
  logic signed [16:0] step, drift;             // change since the last accepted sample, since the second's reference
  assign step   = 17'(sens_i.pv) - 17'(pv_q);
  assign drift  = 17'(sens_i.pv) - 17'(rate_ref_q);
  // No head moves by DTDT_MAX in a second, or by half of that between two samples (and from the second's reference, so
  // that the way back from a single wrong sample is no jump): such a frame is refused as a bad one. The one that makes
  // BAD_MAX refused in a row is taken as it is, with the Rate cause: the jump stays, so it is no noise. A sensor's
  // first words after power-up may be anything: nothing is a jump until two samples have agreed.
  assign far        = params_i.dtdt_max != 16'd0 &&
                      (beyond(drift, {params_i.dtdt_max, 5'd0}) ||
                       (beyond(step, {1'b0, params_i.dtdt_max, 4'd0}) &&
                           beyond(drift, {1'b0, params_i.dtdt_max, 4'd0})));
  assign jump       = settled_q && far;
  assign jump_stays = jump && {1'b0, bad_q} + 5'd1 >= {1'b0, params_i.bad_max[3:0]};
  assign accept     = sens_done_i && sens_i.ok && (!jump || jump_stays);
  assign refuse     = sens_done_i && !accept;

  // 1/320 degC on both sides of a comparison: 5 x 1/64 degC, 32 x 0.1 degC.
  function automatic logic signed [23:0] of_temp(input logic signed [16:0] x);
    of_temp = (24'(x) <<< 2) + 24'(x);
  endfunction
  function automatic logic signed [23:0] of_tenths(input logic signed [16:0] x);
    of_tenths = 24'(x) <<< 5;
  endfunction
  function automatic logic above(input logic signed [16:0] x, input logic signed [16:0] tenths);
    above = of_temp(x) > of_tenths(tenths);
  endfunction
  function automatic logic at_or_above(input logic signed [16:0] x, input logic signed [16:0] tenths);
    at_or_above = of_temp(x) >= of_tenths(tenths);
  endfunction
  // The magnitude of x is above limit, 1/320 degC.
  function automatic logic beyond(input logic signed [16:0] x, input logic [20:0] limit);
    beyond = (x[16] ? -of_temp(x) : of_temp(x)) > $signed({3'd0, limit});
  endfunction
  function automatic logic elapsed(input logic [15:0] count, input logic [15:0] limit);
    elapsed = count >= limit;
  endfunction
  // Count of 0.1 s that stops at its top.
  function automatic logic [15:0] count_up(input logic [15:0] x, input logic tick);
    count_up = tick && x != 16'hFFFF ? x + 16'd1 : x;
  endfunction
  // A time, doubled as far as it goes.
  function automatic logic [15:0] twice(input logic [15:0] x);
    twice = {x[14:0], 1'b0} | {16{x[15]}};
  endfunction

  // ---- Detectors' comparisons, on the accepted temperature ----------------------------------------------------------

  logic auto_mode, heating, in_window, above_exc, over_hold, lba_rose, hold_rose, hold_fell, off_duty, zero_rose,
        fb_differs, fb_trip;
  assign auto_mode = !params_i.mode[tc_pkg::ModeManual];
  assign heating   = run_q && auto_mode;
  logic               above_window, below_window;
  logic signed [16:0] over_sp, over_lba, over_hold_ref, over_zero;   // the temperature above each, 1/64 degC
  logic signed [15:0] mean;                    // temperature over the last samples, in which noise is small
  assign mean          = temp_sum_q[19:4];
  assign over_sp       = 17'(pv_q) - 17'(sp_work_i);
  assign over_lba      = 17'(mean) - 17'(lba_ref_q);
  assign over_hold_ref = 17'(mean) - 17'(hold_ref_q);
  assign over_zero     = 17'(pv_q) - 17'(zero_ref_q);
  assign above_window = above(over_sp, $signed({1'b0, params_i.at_window}));
  assign below_window = of_temp(over_sp) < -of_tenths($signed({1'b0, params_i.at_window}));
  assign in_window = !above_window && !below_window;
  assign above_exc = above(over_sp, $signed({1'b0, params_i.exc_limit}));
  assign over_hold = {hold_limit_i, 4'd0} < {1'b0, duty_sum_q} && duty_sum_q[20:16] >= hold_shown_q;
  assign lba_rose  = at_or_above(over_lba, $signed({1'b0, params_i.lba_rise}));
  assign hold_rose = at_or_above(over_hold_ref, $signed({1'b0, params_i.lba_rise}));
  assign hold_fell = at_or_above(-over_hold_ref, $signed({1'b0, params_i.lba_rise}));
  assign off_duty  = duty_i == 17'd0 || !run_q;
  assign zero_rose = at_or_above(over_zero, $signed({1'b0, params_i.zero_rise}));
  assign fb_differs = heater_q != heater_fb_i;
  assign fb_trip    = elapsed(fb_q[19:4], params_i.fb_time);

  logic lba_active, lba_due, hold_on, hold_counts, hold_due, hold_asks, exc_active, exc_due, zero_due, frozen_active,
        frozen_lasts, frozen_due, bad_limit, settles, at_due;
  logic wd_expired, rails_broken, upset;
  logic [15:0] wd_left;
  assign lba_active  = heating && limited_i && params_i.lba_time != 16'd0;
  assign lba_due     = lba_active && !lba_rose && elapsed(lba_q, params_i.lba_time);
  // First HOLD_TIME above the hold power, then twice LBA_TIME with less heat. Self-tuning ends the test.
  assign hold_on     = heating && params_i.kff != 16'd0 && params_i.hold_time != 16'd0 &&
                       (hold_test_q ? segment_i != tc_pkg::SegNone && !hold_fell : over_hold && !hold_rose);
  assign hold_counts = hold_test_q || segment_i == tc_pkg::SegPid;
  assign hold_due    = hold_on && elapsed(hold_q, hold_test_q ? twice(params_i.lba_time) : params_i.hold_time);
  assign hold_asks   = hold_due && !hold_test_q;
  assign exc_active  = heating && exc_armed_q && above_exc;
  assign exc_due     = exc_active && elapsed(exc_q, params_i.exc_time);
  assign zero_due    = off_duty && elapsed(zero_q, params_i.zero_wait);
  assign frozen_active = run_q && duty_i == 17'd0 && params_i.lba_time != 16'd0 &&
                        above(17'(pv_q) - HotAbove, 17'($signed(params_i.t_amb)));
  assign frozen_lasts = frozen_active && !(accept && step != 17'sd0);
  assign frozen_due  = frozen_active && elapsed(frozen_q, params_i.lba_time);
  assign settles     = heating && pv_valid_q && !ramping_i && in_window;
  assign at_due      = settles && elapsed(at_q, params_i.at_dwell);
  assign rails_broken = run_q == run_nq;
  assign upset       = (watch_still_q & (watch_parity_q ^ watch_parity_i)) != 2'd0;
  assign bad_limit   = bad_q >= params_i.bad_max[3:0];
  assign wd_left     = wd_q < params_i.host_wd ? params_i.host_wd - wd_q : 16'd0;
  assign wd_expired  = wd_left == 16'd0;

  // ---- Heat balance -------------------------------------------------------------------------------------------------

  // Each 0.1 s the temperature to which the heat of the duty leads moves on, and is drawn to the reading with an eighth
  // of the head's time constant:
  //   seen += HEAT_RATE (duty + 7 need - 8 seen), need = KFF (temperature - T_AMB).
  // A reading that is not where the heat went is no head's.
  logic [8:0]         heat_rate;
  logic               heat_judged;             // otherwise seen follows the reading
  logic [15:0]        heat_set;
  logic               heat_bit;                // of the factor, highest first
  logic [31:0]        heat_row;                // the factors' bits by step
  logic signed [23:0] over_amb;                // 1/320 degC
  logic signed [31:0] heat_need, heat_seen, heat_excess;
  assign heat_rate   = params_i.ctrl[tc_pkg::CtrlHeatRate +: tc_pkg::CtrlHeatRateWidth];
  always_comb begin
    heat_row = 32'd0;
    for (int i = 0; i < 16; i++) heat_row[1 + i] = params_i.kff[15 - i];
    for (int i = 0; i < 9; i++) heat_row[18 + i] = heat_rate[8 - i];
  end
  // A new KFF or T_AMB tells seen anew. It may come in the middle of a product.
  assign heat_set    = params_i.kff ^ params_i.t_amb;
  assign heat_judged = run_q && heat_rate != 9'd0 && heat_known_q && heat_set == heat_set_q;
  assign over_amb    = of_temp(17'(pv_q)) - of_tenths(17'($signed(params_i.t_amb)));
  assign heat_bit    = heat_row[heat_step_q];
  assign heat_need   = 32'($signed(heat_acc_q[39:12]));
  assign heat_seen   = 32'($signed(heat_seen_q[39:12]));
  assign heat_excess = heat_seen - heat_need;

  always_comb begin
    cause_d = '0;
    // Over-temperature acts on the sample itself, unfiltered.
    cause_d[tc_pkg::FaultOverTemp]  = accept ? at_or_above(17'(sens_i.pv), 17'($signed(params_i.t_max)))
                                    : cause_q[tc_pkg::FaultOverTemp];
    cause_d[tc_pkg::FaultUnderTemp] = accept ? !at_or_above(17'(sens_i.pv), 17'($signed(params_i.t_min)))
                                    : cause_q[tc_pkg::FaultUnderTemp];
    cause_d[tc_pkg::FaultSensorFault]  = bad_limit && bad_dev_q;
    cause_d[tc_pkg::FaultSensorFrame]  = bad_limit && !bad_dev_q;
    cause_d[tc_pkg::FaultSensorStale]  = elapsed(stale_q, params_i.sample_timeout) || frozen_due;
    cause_d[tc_pkg::FaultRate]         = rate_q;
    cause_d[tc_pkg::FaultNotHeating]   = lba_trip_q || heat_low_q;
    cause_d[tc_pkg::FaultHoldPower]    = hold_due && hold_test_q;
    cause_d[tc_pkg::FaultExcursion]    = exc_due;
    cause_d[tc_pkg::FaultZeroRise]     = (zero_due && params_i.zero_rise != 16'd0 && zero_rose) || heat_high_q;
    cause_d[tc_pkg::FaultHeaterFb]     = params_i.ctrl[tc_pkg::CtrlFbEn] && fb_trip;
    cause_d[tc_pkg::FaultHostWatchdog] = wd_armed_o && wd_expired;
    cause_d[tc_pkg::FaultParam]        = mem_bad_i;
    cause_d[tc_pkg::FaultState]        = state_illegal_i || overrun_i || rails_broken || upset;
    cause_d[tc_pkg::FaultInhibit]      = inhibit_i;
  end

  logic [tc_pkg::FaultCount-1:0] latching;     // causes that stop the heater now
  logic        stop;
  assign latching = cause_q & ~(run_q ? '0 : tc_pkg::FaultRunOnly);
  assign stop     = stop_i || latching != '0 || fault_q != '0 || rails_broken;
  logic run_d;
  assign run_d    = !stop && (run_q || (run_i && run_allowed_o));

  function automatic logic [3:0] first_of(input logic [tc_pkg::FaultCount-1:0] causes);
    first_of = 4'd0;
    for (int unsigned i = tc_pkg::FaultCount; i > 0; i--) if (causes[i - 1]) first_of = 4'(i);
  endfunction

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      run_q           <= 1'b0;
      run_nq          <= 1'b1;
      heater_q        <= 1'b0;
      safe_en_q       <= 1'b0;
      safe_cnt_q      <= 10'd0;
      cause_q         <= '0;
      fault_q         <= '0;
      first_q         <= 4'd0;
      watch_parity_q  <= 2'd0;
      watch_still_q   <= 2'd0;
      pv_valid_q      <= 1'b0;
      settled_q       <= 1'b0;
      bad_dev_q       <= 1'b0;
      pv_q            <= 16'sd0;
      slope_q         <= 16'sd0;
      samples_q       <= 16'd0;
      sensor_errors_q <= 16'd0;
      stale_q         <= 16'd0;
      bad_q           <= 4'd0;
      rate_ref_q      <= 16'sd0;
      rate_cnt_q      <= 4'd0;
      lba_ref_q       <= 16'sd0;
      hold_ref_q      <= 16'sd0;
      zero_ref_q      <= 16'sd0;
      sp_past_q       <= 16'sd0;
      lba_q           <= 16'd0;
      hold_q          <= 16'd0;
      hold_test_q     <= 1'b0;
      hold_shown_q    <= 5'd0;
      exc_q           <= 16'd0;
      zero_q          <= 16'd0;
      frozen_q        <= 16'd0;
      wd_q            <= 16'd0;
      at_q            <= 16'd0;
      fb_q            <= 20'd0;
      exc_armed_q     <= 1'b0;
      rate_q          <= 1'b0;
      lba_trip_q      <= 1'b0;
      at_temp_q       <= 1'b0;
      temp_sum_q      <= 20'sd0;
      duty_sum_q      <= 21'd0;
      heat_step_q     <= 5'd0;
      heat_x_q        <= 32'sd0;
      heat_acc_q      <= 40'sd0;
      heat_seen_q     <= 40'sd0;
      heat_set_q      <= 16'd0;
      heat_known_q    <= 1'b0;
      heat_low_q      <= 1'b0;
      heat_high_q     <= 1'b0;
    end else begin
      // Heater permission: a fault, a stop or the emergency stop beats everything.
      run_q    <= run_d;
      run_nq   <= !run_d;
      heater_q <= pwm_i && run_q && !stop && !inhibit_i;
      if (run_q && !stop) begin
        safe_cnt_q <= safe_cnt_q + 10'd1;
        if (safe_cnt_q == 10'h3FF) safe_en_q <= !safe_en_q;
      end else begin
        safe_cnt_q <= 10'd0;
        safe_en_q  <= 1'b0;
      end
      cause_q <= cause_d;
      watch_parity_q <= watch_parity_i;
      watch_still_q  <= watch_still_i;
      fault_q <= (clear_i ? '0 : fault_q) | latching;
      if (clear_i) first_q <= first_of(latching);
      else if (fault_q == '0) first_q <= first_of(latching);

      // Samples.
      if (accept) begin
        pv_valid_q <= 1'b1;
        if (pv_valid_q && !far) settled_q <= 1'b1;
        pv_q       <= sens_i.pv;
        slope_q    <= pv_valid_q ? tc_math_pkg::sat_s16(40'(step)) : 16'sd0;
        samples_q  <= samples_q + 16'd1;
        bad_q      <= 4'd0;
        stale_q    <= 16'd0;
        rate_q     <= jump;
        temp_sum_q <= pv_valid_q ? temp_sum_q + 20'(sens_i.pv) - 20'(mean) : 20'(sens_i.pv) <<< 4;
      end else begin
        stale_q <= count_up(stale_q, tenth_i);
      end
      if (!run_q) duty_sum_q <= 21'd0;
      else if (accept) duty_sum_q <= duty_sum_q + 21'(duty_i) - 21'(duty_sum_q[20:4]);
      if (accept && (!settled_q || jump || rate_cnt_q >= RateTenths)) begin
        rate_ref_q <= settled_q && !jump ? pv_q : sens_i.pv;   // not the present sample, which may be a wrong one
        rate_cnt_q <= 4'd0;
      end else if (tenth_i && rate_cnt_q < RateTenths) begin
        rate_cnt_q <= rate_cnt_q + 4'd1;
      end
      if (refuse) begin
        sensor_errors_q <= sensor_errors_q + 16'd1;
        bad_dev_q       <= sens_i.dev_fault;
        if (bad_q != 4'hF) bad_q <= bad_q + 4'd1;
      end

      // Loop break: at full duty the temperature must rise by LBA_RISE above its lowest within each LBA_TIME. From the
      // lowest: a head that was cooling falls on for a while.
      lba_q <= (lba_active && !lba_rose) ? count_up(lba_q, tenth_i) : 16'd0;
      if (!lba_active || lba_rose || over_lba[16]) lba_ref_q <= mean;
      lba_trip_q <= lba_due;

      // Hold power: more than the head can need, and no rise to show for it, as above. Noise may leave the segment for
      // a tick. It may be a fan, a low supply, or a dead sensor: with less heat a live one falls, from its highest on.
      // What it has shown so is not asked again.
      hold_q <= hold_on && !hold_asks ? count_up(hold_q, tenth_i && hold_counts) : 16'd0;
      if (!hold_on || hold_asks || over_hold_ref[16] != hold_test_q) hold_ref_q <= mean;
      hold_test_q <= hold_asks || (hold_on && hold_test_q);
      if (!heating || sp_work_i != sp_past_q) hold_shown_q <= 5'd0;
      else if (hold_asks) hold_shown_q <= duty_sum_q[20:16] + 5'd1;

      // Excursion: armed once the temperature is at or below the window's top, disarmed when the set-point falls away.
      sp_past_q <= sp_work_i;
      if (!heating || sp_work_i < sp_past_q) exc_armed_q <= 1'b0;
      else if (!above_window) exc_armed_q <= 1'b1;
      exc_q <= exc_active ? count_up(exc_q, tenth_i) : 16'd0;

      // Rise at zero duty, against the lowest temperature seen since the heat stored in the head has spread.
      if (!off_duty) zero_q <= 16'd0;
      else if (!zero_due) zero_q <= count_up(zero_q, tenth_i);
      // The first sample is no rise.
      if (accept && !pv_valid_q) zero_ref_q <= sens_i.pv;
      else if (!zero_due || over_zero[16]) zero_ref_q <= pv_q;

      // Frozen: a hot head without heat cools, so its samples move.
      frozen_q <= frozen_lasts ? count_up(frozen_q, tenth_i) : 16'd0;

      // Heat balance.
      if (heat_step_q == 5'd0) begin
        if (tenth_i) begin
          heat_x_q    <= 32'(over_amb);
          heat_acc_q  <= 40'sd0;
          heat_step_q <= 5'd1;
          heat_set_q  <= heat_set;
          if (heat_set != heat_set_q) heat_known_q <= 1'b0;
        end
      end else if (heat_step_q == HeatNeed) begin
        heat_known_q <= heat_set == heat_set_q;
        heat_set_q  <= heat_set;
        heat_low_q  <= heat_judged && heat_excess > HeatLow;
        heat_high_q <= heat_judged && -heat_excess > HeatHigh;
        if (!heat_judged) heat_seen_q <= {heat_acc_q[39:12], 12'd0};
        heat_x_q    <= (heat_need <<< 3) - heat_need - (heat_seen <<< 3) + 32'(duty_i) * 32'sd5;
        heat_acc_q  <= 40'sd0;
        heat_step_q <= heat_judged ? HeatNeed + 5'd1 : 5'd0;
      end else if (heat_step_q >= HeatMove) begin
        heat_seen_q <= heat_seen_q + 40'($signed(heat_acc_q[39:5]));
        heat_step_q <= 5'd0;
      end else begin
        heat_acc_q  <= (heat_acc_q <<< 1) + (heat_bit ? 40'(heat_x_q) : 40'sd0);
        heat_step_q <= heat_step_q + 5'd1;
      end

      if (!fb_differs) fb_q <= 20'd0;
      else if (!fb_trip) fb_q <= fb_q + 20'd1;

      // Time since the last frame, so that a changed HOST_WD is in force at once.
      wd_q <= !run_q || good_frame_i ? 16'd0 : count_up(wd_q, tenth_i);

      // At temperature.
      at_q      <= settles ? count_up(at_q, tenth_i) : 16'd0;
      at_temp_q <= at_due;
    end
  end

  assign heater_o        = heater_q;
  assign safe_en_o       = safe_en_q;
  assign run_o           = run_q;
  assign run_allowed_o   = fault_q == '0 && cause_q == '0 && pv_valid_q;
  assign at_temp_o       = at_temp_q;
  assign sensor_ok_o     = pv_valid_q && !bad_limit && !cause_q[tc_pkg::FaultSensorStale];
  assign sample_held_o   = bad_q != 4'd0;
  assign hold_test_o     = hold_test_q;
  assign wd_armed_o      = run_q && params_i.host_wd != 16'd0;
  assign permitted_o     = run_q && fault_q == '0;
  assign pv_valid_o      = pv_valid_q;
  assign pv_o            = pv_q;
  assign slope_o         = slope_q;
  assign samples_o       = samples_q;
  assign sensor_errors_o = sensor_errors_q;
  assign wd_left_o       = wd_left;
  assign cause_o         = cause_q;
  assign fault_o         = fault_q;
  assign first_fault_o   = first_q;

  logic unused;
  assign unused = ^{params_i, sens_i};

`ifndef SYNTHESIS
  assign accept_o = accept;
  `TC_ASSERT_SETUP
  // P2: a fault flag means the heater is off, now and until cleared.
  `TC_ASSERT_IF(GuardFaultMeansOff_A, fault_q != '0, !heater_q)
  `TC_ASSERT_NEXT(GuardCauseTurnsOff_A, latching != '0, !heater_q && fault_q != '0)
  `TC_ASSERT_NEXT(GuardFaultStays_A, fault_q != '0 && !clear_i, fault_q != '0)
  // P5: an accepted sample at or above T_MAX is a cause in the next clock.
  `TC_ASSERT_NEXT(GuardHotSampleIsCause_A,
                  accept && !(of_temp(17'(sens_i.pv)) < of_tenths(17'($signed(params_i.t_max)))),
                  cause_q[tc_pkg::FaultOverTemp])
  // A reading that does not fall with less heat is a cause.
  `TC_ASSERT_NEXT(GuardDeadReadingIsCause_A, hold_due && hold_test_q, cause_q[tc_pkg::FaultHoldPower])
  `TC_ASSERT_NEXT(GuardHoldTestNeedsHeating_A, !heating, !hold_test_q)
  // A reading can't be far from where the heat leads on both sides; each product ends.
  `TC_ASSERT(GuardHeatBalanceOneSide_A, !heat_low_q || !heat_high_q)
  `TC_ASSERT(GuardHeatBalanceEnds_A, heat_step_q <= HeatMove)
  // P3: heat only while running, with a sample, without fault.
  `TC_ASSERT_NEXT(GuardHeatNeedsRun_A, !run_q, !heater_q)
  `TC_ASSERT_IF(GuardHeatNeedsSample_A, heater_q, pv_valid_q)
  // RUN, and a reading that has settled, come behind the first sample.
  `TC_ASSERT_IF(GuardRunNeedsSample_A, run_q, pv_valid_q)
  `TC_ASSERT_IF(GuardSettledNeedsSample_A, settled_q, pv_valid_q)
  // P9, P6: stop and inhibit act in the next clock.
  `TC_ASSERT_NEXT(GuardStopTurnsOff_A, stop_i, !heater_q && !run_q)
  `TC_ASSERT_NEXT(GuardInhibitTurnsOff_A, inhibit_i, !heater_q)
  // P17: the first cause is never overwritten.
  logic [3:0] first_past;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) first_past <= 4'd0;
    else first_past <= first_q;
  end
  `TC_ASSERT_NEXT(GuardFirstFaultKept_A, fault_q != '0 && !clear_i, first_q == first_past)
  `TC_ASSERT_IF(GuardFaultNamesFirst_A, fault_q != '0, first_q != 4'd0)
  `TC_ASSERT_NEXT(GuardNoPermissionNoToggle_A, !run_q || stop, !safe_en_q)
`ifdef FORMAL
  // The time of each detector (those of P4, P6 and P18: tc_properties).
  tc_guard_times u_lba_time (
    .clk_i, .rst_ni, .tick_i(tenth_i), .lasts_i(lba_active && !lba_rose), .judged_i(lba_active && !lba_rose),
    .limit_i(params_i.lba_time), .count_i(lba_q), .due_i(lba_due)
  );
  tc_guard_times u_hold_time (
    .clk_i, .rst_ni, .tick_i(tenth_i && hold_counts), .lasts_i(hold_on && !hold_asks), .judged_i(hold_on),
    .limit_i(!hold_test_q ? params_i.hold_time : params_i.lba_time[15] ? 16'hFFFF : {params_i.lba_time[14:0], 1'b0}),
    .count_i(hold_q), .due_i(hold_due)
  );
  tc_guard_times u_exc_time (
    .clk_i, .rst_ni, .tick_i(tenth_i), .lasts_i(exc_active), .judged_i(exc_active), .limit_i(params_i.exc_time),
    .count_i(exc_q), .due_i(exc_due)
  );
  tc_guard_times u_frozen_time (
    .clk_i, .rst_ni, .tick_i(tenth_i), .lasts_i(frozen_lasts), .judged_i(frozen_active), .limit_i(params_i.lba_time),
    .count_i(frozen_q), .due_i(frozen_due)
  );
  tc_guard_times u_at_time (
    .clk_i, .rst_ni, .tick_i(tenth_i), .lasts_i(settles), .judged_i(settles), .limit_i(params_i.at_dwell),
    .count_i(at_q), .due_i(at_due)
  );
  // The feedback's time is of clocks, sixteen a count of FB_TIME, which may be set anew at any of them: late is later
  // than that with FB_TIME as it is, early is before it since the feedback was last right.
  logic [20:0] fb_still_q, fb_ever_q;   // clocks for which it has been wrong: with this FB_TIME, with any
  logic [15:0] fb_time_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      fb_still_q <= 21'd0;
      fb_ever_q  <= 21'd0;
      fb_time_q  <= 16'd0;
    end else begin
      fb_time_q  <= params_i.fb_time;
      fb_ever_q  <= !fb_differs ? 21'd0 : fb_ever_q + 21'(!fb_ever_q[20]);
      fb_still_q <= !fb_differs ? 21'd0 : params_i.fb_time != fb_time_q ? 21'd1 : fb_still_q + 21'(!fb_still_q[20]);
    end
  end
  `TC_ASSERT_IF(GuardFeedbackInTime_A, params_i.fb_time == fb_time_q && fb_still_q >= {1'b0, params_i.fb_time, 4'd0},
                fb_trip)
  `TC_ASSERT_IF(GuardFeedbackNotBefore_A, fb_ever_q < {1'b0, params_i.fb_time, 4'd0}, !fb_trip)
  `TC_ASSERT(GuardFeedbackCounts_A, {1'b0, fb_q} <= fb_ever_q && fb_still_q <= fb_ever_q &&
             ({1'b0, fb_q} >= fb_still_q || fb_q[19:4] >= fb_time_q))
  // BAD_MAX refused samples in a row.
  logic [4:0] refused_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) refused_q <= 5'd0;
    else if (accept) refused_q <= 5'd0;
    else if (refuse && !refused_q[4]) refused_q <= refused_q + 5'd1;
  end
  `TC_ASSERT(GuardRefusedInARow_A, bad_limit == (refused_q >= {1'b0, params_i.bad_max[3:0]}))
  `TC_ASSERT(GuardRefusedCounts_A, {1'b0, bad_q} == (refused_q[4] ? 5'h0F : refused_q))
`endif
`endif

endmodule
