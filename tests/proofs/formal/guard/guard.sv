// SPDX-License-Identifier: Apache-2.0
// Proof of tc_guard with every input free in every clock (parameters too) and reset at any time: how many clocks after a
// cause the heater is off. The block's own assertions (rtl/tc_guard.sv) are proved with these.
// engine: cadical-induction

`include "tc_assert.svh"

module formal_guard (
  input logic               clk_i,
  input logic               reset_i,
  input tc_pkg::params_t    params_i,
  input logic               tenth_i,
  input logic               sens_done_i,
  input logic               sens_ok_i,
  input logic               sens_dev_fault_i,
  input logic signed [15:0] sens_pv_i,
  input logic [16:0]        duty_i,
  input logic [17:0]        hold_limit_i,
  input logic               limited_i,
  input logic [1:0]         segment_i,
  input logic signed [15:0] sp_work_i,
  input logic               ramping_i,
  input logic               pwm_i,
  input logic               run_i,
  input logic               stop_i,
  input logic               clear_i,
  input logic               good_frame_i,
  input logic               mem_bad_i,
  input logic               state_illegal_i,
  input logic               overrun_i,
  input logic [1:0]         watch_parity_i,
  input logic [1:0]         watch_still_i,
  input logic               inhibit_i,
  input logic               heater_fb_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  logic        heater, safe_en, run, run_allowed, at_temp, sensor_ok, sample_held, hold_test, wd_armed, permitted, pv_valid;
  logic signed [15:0] pv;
  logic [15:0] slope, samples, sensor_errors, wd_left;
  logic [14:0] cause, fault;
  logic [3:0]  first_fault;

  tc_guard u_guard (
    .clk_i, .rst_ni, .params_i, .tenth_i, .sens_done_i, .sens_i({sens_ok_i, sens_dev_fault_i, 1'b0, sens_pv_i, 32'd0}), .duty_i, .hold_limit_i,
    .limited_i, .segment_i, .sp_work_i, .ramping_i, .pwm_i, .run_i, .stop_i, .clear_i, .good_frame_i, .mem_bad_i,
    .state_illegal_i, .overrun_i, .watch_parity_i, .watch_still_i, .inhibit_i, .heater_fb_i,
    .heater_o(heater), .safe_en_o(safe_en), .run_o(run), .run_allowed_o(run_allowed), .at_temp_o(at_temp),
    .sensor_ok_o(sensor_ok), .sample_held_o(sample_held), .hold_test_o(hold_test), .wd_armed_o(wd_armed), .permitted_o(permitted),
    .pv_valid_o(pv_valid), .pv_o(pv), .slope_o(slope), .samples_o(samples), .sensor_errors_o(sensor_errors),
    .wd_left_o(wd_left), .cause_o(cause), .fault_o(fault), .first_fault_o(first_fault)
  );

  `TC_ASSERT_SETUP

  // What stops the heater whatever the state: two clocks from the input to the flop of the pin (P2, P5, P16).
  logic too_hot, trips;
  // Samples that are accepted whatever came before; of the others tc_guard's own assertion speaks (GuardHotSampleIsCause_A).
  assign too_hot = sens_done_i && sens_ok_i && (!pv_valid || params_i.dtdt_max == 16'd0 || params_i.bad_max[3:0] <= 4'd1) && 24'(sens_pv_i) * 24'sd5 >= 24'($signed(params_i.t_max)) * 24'sd32;
  assign trips   = too_hot || mem_bad_i || state_illegal_i || overrun_i || inhibit_i;

  logic [1:0] trips_q;                   // 1 and 2 clocks ago
  logic       clear_q, run_q;
  logic [1:0] expired_past_q;
  logic       expired;                   // armed host watchdog has run out (P6)
  assign expired = wd_armed && wd_left == 16'd0;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      trips_q        <= 2'd0;
      expired_past_q <= 2'd0;
      clear_q        <= 1'b0;
      run_q          <= 1'b0;
    end else begin
      trips_q        <= {trips_q[0], trips};
      expired_past_q <= {expired_past_q[0], expired};
      clear_q        <= clear_i;
      run_q          <= run;
    end
  end

  `TC_ASSERT_IF(FormalGuardTripsInTwo_A, trips_q[1], !heater && !run && fault != 15'd0)
  `TC_ASSERT_IF(FormalGuardWatchdogInTwo_A, expired_past_q[1], !heater && !run)
  // Inhibit and stop need one clock only (P6, P9).
  `TC_ASSERT_NEXT(FormalGuardInhibitInOne_A, inhibit_i, !heater)
  `TC_ASSERT_NEXT(FormalGuardStopInOne_A, stop_i, !heater && !run)
  // Heat only while running and without a fault; once off by a fault only a clear and a new run command heat again (P2, P3).
  `TC_ASSERT_IF(FormalGuardHeatsOnlyRunning_A, heater, run && pv_valid && fault == 15'd0)
  `TC_ASSERT_NEXT(FormalGuardFaultNeedsClear_A, fault != 15'd0 && !clear_i, fault != 15'd0 && !run)
  `TC_ASSERT_NEXT(FormalGuardRunNeedsCommand_A, !run && !run_i, !run)
  `TC_ASSERT_NEXT(FormalGuardRunNeedsAllowance_A, !run && !run_allowed, !run)
  // Every latched fault had its cause in the clock before, and none is lost (P17).
  logic [14:0] cause_q, fault_past_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      cause_q      <= 15'd0;
      fault_past_q <= 15'd0;
    end else begin
      cause_q      <= cause;
      fault_past_q <= fault;
    end
  end
  `TC_ASSERT(FormalGuardFaultHasCause_A, (fault & ~fault_past_q & ~cause_q) == 15'd0)
  `TC_ASSERT_IF(FormalGuardNoFaultLost_A, !clear_q, (fault_past_q & ~fault) == 15'd0)
  // Watched flops: a parity that changes where nothing may change it stops the heater in two clocks.
  logic [1:0] parity_past_q, still_past_q, upset_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      parity_past_q <= 2'd0;
      still_past_q  <= 2'd0;
      upset_q       <= 2'd0;
    end else begin
      parity_past_q <= watch_parity_i;
      still_past_q  <= watch_still_i;
      upset_q       <= {upset_q[0], (still_past_q & (parity_past_q ^ watch_parity_i)) != 2'd0};
    end
  end
  `TC_ASSERT_IF(FormalGuardUpsetInTwo_A, upset_q[1], !heater && !run && fault[tc_pkg::FaultState])
  // A jump is no reason to refuse BAD_MAX sound samples in a row (here BAD_MAX 1).
  logic [15:0] samples_past_q;
  logic        sound_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      samples_past_q <= 16'd0;
      sound_q        <= 1'b0;
    end else begin
      samples_past_q <= samples;
      sound_q        <= sens_done_i && sens_ok_i && params_i.bad_max[3:0] <= 4'd1;
    end
  end
  `TC_ASSERT_IF(FormalGuardJumpIsTaken_A, sound_q, samples != samples_past_q)
  // safe_en moves only while heating is on.
  `TC_ASSERT_IF(FormalGuardSafeEnStill_A, !run && !run_q, !safe_en)
  // The reading is tested only while heating.
  `TC_ASSERT_NEXT(FormalGuardHoldTestNeedsRun_A, !run, !hold_test)
  // At temperature only while running.
  `TC_ASSERT_NEXT(FormalGuardAtTempNeedsRun_A, !run, !at_temp)

endmodule
