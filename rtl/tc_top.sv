// SPDX-License-Identifier: Apache-2.0
// Temperature controller for a print head: the seven blocks of Xie et al. 2023, fig. 4, and GUARD, the safety
// detectors.
//
//   uart_rx -> UARTC -> SYSCTRL/PARAMC -> MEM -> parameters of every block
//   sensor  -> SENSC -> GUARD -> ALGOR -> PWMC -> GUARD -> heater_o
//
// One clock. rst_ni asserts asynchronously and is released synchronously. heater_o is the only output with logic behind
// a flop: inhibit_i forces it low without a clock.
//
// Test pins are low in operation. scan_o is low here: scan insertion (asic/dft/scan/scan.hpp) puts the chains between
// scan_i and it.

module tc_top #(
  // Clocks of a millisecond; a parameter so that proofs can shorten the time base.
  parameter int unsigned MsClocks = tc_pkg::ClkHz / 1000
) (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic       uart_rx_i,
  output logic       uart_tx_o,
  output logic       uart_de_o,
  output logic       tlm_tx_o,
  input  logic [2:0] addr_strap_i,
  output logic       spi_sclk_o,
  output logic       spi_cs_no,
  output logic       spi_mosi_o,
  input  logic       spi_miso_i,
  output logic       heater_o,
  input  logic       heater_fb_i,
  output logic       safe_en_o,
  input  logic       inhibit_i,
  input  logic       drop_i,
  output logic       fault_no,
  output logic       at_temp_o,
  input  logic       test_mode_i,
  input  logic       scan_en_i,
  input  logic [tc_pkg::ScanChains-1:0] scan_i,
  output logic [tc_pkg::ScanChains-1:0] scan_o
);

  // ---- Reset and asynchronous inputs --------------------------------------------------------------------------------

  logic rst_n;
  tc_rst_sync u_rst_sync (.clk_i, .rst_ni, .test_mode_i, .rst_no(rst_n));

  // One synchroniser for all asynchronous pins; the serial line idles high.
  logic       rx, miso, heater_fb, inhibit, drop;
  logic [2:0] strap;
  tc_sync #(.Width(8), .ResetValue(8'b00000001)) u_sync (
    .clk_i, .rst_ni(rst_n),
    .d_i({drop_i, inhibit_i, heater_fb_i, spi_miso_i, addr_strap_i, uart_rx_i}),
    .q_o({drop, inhibit, heater_fb, miso, strap, rx})
  );

  // ---- Wires between blocks -----------------------------------------------------------------------------------------

  tc_pkg::params_t params;

  tc_types_pkg::command_t cmd;
  logic        cmd_valid, uart_stop, good_frame, rsp_busy, tlm_busy;
  logic [15:0] cmd_word, rd_addr, rd_data;
  tc_types_pkg::line_counters_t line_counters;
  logic [3:0]  cmd_word_index;

  logic [4:0]  state;
  logic        decode, extract, write, cmd_done, commit, tick, sens_start, display, tlm_start, algor_start, pwm_load;
  logic        illegal, overrun, ms, tenth;

  logic        decoded, writes, last, pending, store, discard, cmd_run, cmd_stop, cmd_clear, cmd_tune;
  logic [2:0]  rsp_kind;
  logic [7:0]  rsp_exc;
  logic [5:0]  index, mem_rd_index;
  logic [15:0] value, mem_rd_data;

  logic        mem_bad, scrub_busy, discarding, mem_rd, mem_rd_wait;
  logic [15:0] t_max_staged, mem_corrected;

  logic                   sens_busy, sens_done;
  tc_types_pkg::reading_t reading;
`ifndef SYNTHESIS
  logic        accept;
  logic [14:0] reading_clocks;
  logic [4:0]  computing;
`endif

  logic               algor_done, ramping, limited, i_held, algor_still;
  logic [31:0]        algor_i;
  logic [21:0]        algor_filt;
  logic [16:0]        duty, duty_max;
  logic signed [15:0] sp_work, pv, target, amb;
  logic [1:0]         segment;
  logic [17:0]        hold_limit, term_p, term_i, term_d;

  logic        sample;               // control computation with a new sample
  logic        tuning, tune_stop, tune_parity, tune_still, tune_wr;
  logic [16:0] tune_duty, tune_hold;
  logic [5:0]  tune_index;
  logic [15:0] tune_data;
  tc_types_pkg::tuned_t tuned;

  tc_types_pkg::quality_t quality;
  logic [31:0]            on_time;

  logic        pwm, period_start, pwmc_parity, pwmc_still;

  // the host or self-tuning stops heating; a state that is none, or Idle while heating
  logic        stop, state_bad;
  assign stop      = cmd_stop || uart_stop || tune_stop;
  assign state_bad = illegal || (run && state == tc_pkg::StIdle);

  logic        heater, run, run_allowed, at_temp, sensor_ok, sample_held, hold_test, wd_armed, permitted, pv_valid;
  logic [15:0] slope, samples, sensor_errors, wd_left;
  logic [tc_pkg::FaultCount-1:0] cause, fault;
  logic [3:0]  first_fault;

  tc_pkg::status_t status;
  always_comb begin
    status.run                 = run;
    status.at_temperature      = at_temp;
    status.full_segment        = segment == tc_pkg::SegFull;
    status.pid_segment         = segment == tc_pkg::SegPid;
    status.off_segment         = segment == tc_pkg::SegOff;
    status.ramp_active         = ramping;
    status.duty_near_its_limit = limited;
    status.writes_pending      = 1'b0;  // PARAMC's own
    status.hold                = 1'b0;
    status.locked              = params.lock != 16'd0;
    status.sensor_ok           = sensor_ok;
    status.integral_held       = i_held;
    status.watchdog_armed      = wd_armed;
    status.sample_held         = sample_held;
    status.safe_en_active      = permitted;
    status.fault               = fault != '0;
  end

  // ---- Blocks -------------------------------------------------------------------------------------------------------

  tc_uartc u_uartc (
    .clk_i, .rst_ni(rst_n),
    .rx_i(rx), .tx_o(uart_tx_o), .de_o(uart_de_o), .tlm_tx_o,
    .cfg_address_i(params.address[7:0]), .strap_i(strap),
    .cfg_baud_i(params.baud[12:0]),
    .cfg_format_i(params.format[tc_pkg::FormatCharacter +: tc_pkg::FormatCharacterWidth]),
    .cfg_pause_i(params.format[tc_pkg::FormatPause]),
    .cmd_valid_o(cmd_valid), .cmd_o(cmd), .cmd_word_index_i(cmd_word_index), .cmd_word_o(cmd_word),
    .stop_o(uart_stop), .good_o(good_frame),
    .cmd_done_i(cmd_done), .rsp_kind_i(rsp_kind), .rsp_exc_i(rsp_exc), .rsp_busy_o(rsp_busy),
    .rd_addr_o(rd_addr), .rd_rsp_o(mem_rd), .rd_wait_i(mem_rd_wait), .rd_data_i(rd_data),
    .tlm_start_i(tlm_start), .tlm_busy_o(tlm_busy),
    .counters_o(line_counters)
  );

  tc_sysctrl #(.MsClocks(MsClocks)) u_sysctrl (
    .clk_i, .rst_ni(rst_n), .test_mode_i,
    .ts_i(params.ts), .tlm_period_i(params.tlm_period),
    .cmd_valid_i(cmd_valid), .decoded_i(decoded), .writes_i(writes), .last_i(last), .pending_i(pending),
    .discarding_i(discarding), .sens_done_i(sens_done), .algor_done_i(algor_done),
    .state_o(state), .decode_o(decode), .extract_o(extract), .write_o(write), .cmd_done_o(cmd_done),
    .commit_o(commit), .tick_o(tick), .sens_start_o(sens_start), .display_o(display), .tlm_start_o(tlm_start),
    .algor_start_o(algor_start), .pwm_load_o(pwm_load), .illegal_o(illegal), .overrun_o(overrun),
    .ms_o(ms), .tenth_o(tenth)
  );

  tc_paramc u_paramc (
    .clk_i, .rst_ni(rst_n),
    .decode_i(decode), .extract_i(extract), .write_i(write), .commit_i(commit), .display_i(display),
    .decoded_o(decoded), .writes_o(writes), .last_o(last), .pending_o(pending),
    .cmd_i(cmd), .cmd_word_index_o(cmd_word_index), .cmd_word_i(cmd_word),
    .rsp_kind_o(rsp_kind), .rsp_exc_o(rsp_exc),
    .store_o(store), .index_o(index), .value_o(value), .discard_o(discard), .discarding_i(discarding),
    .t_max_staged_i(t_max_staged),
    .lock_i(params.lock), .running_i(run), .run_allowed_i(run_allowed), .cause_present_i(cause != 15'd0),
    .manual_i(params.mode[tc_pkg::ModeManual]), .run_o(cmd_run), .stop_o(cmd_stop), .clear_o(cmd_clear),
    .tuning_i(tuning), .tune_wr_i(tune_wr), .tune_o(cmd_tune),
    .rd_addr_i(rd_addr), .rd_data_o(rd_data), .mem_rd_index_o(mem_rd_index), .mem_rd_data_i(mem_rd_data),
    .rd_busy_i(rsp_busy || tlm_busy),
    .pv_valid_i(pv_valid), .pv_i(pv), .slope_i(slope), .sp_work_i(sp_work), .duty_i(duty),
    .term_p_i(term_p), .term_i_i(term_i), .term_d_i(term_d), .raw_i(reading.raw), .samples_i(samples),
    .status_i(status),
    .fault_i(fault), .cause_i(cause), .first_fault_i(first_fault), .state_i(state), .wd_left_i(wd_left),
    .counters_i(line_counters), .sensor_errors_i(sensor_errors), .mem_corrected_i(mem_corrected),
    .quality_i(quality), .on_time_i(on_time), .tuned_i(tuned), .tune_hold_i(tune_hold)
  );

  tc_mem u_mem (
    .clk_i, .rst_ni(rst_n), .scan_en_i,
    .wr_i((write && store) || tune_wr), .wr_index_i(tune_wr ? tune_index : index),
    .wr_data_i(tune_wr ? tune_data : value),
    .commit_i(commit), .discard_i(discard), .discarding_o(discarding),
    .rd_i(mem_rd), .rd_index_i(mem_rd_index), .rd_data_o(mem_rd_data), .rd_wait_o(mem_rd_wait),
    .params_o(params), .t_max_staged_o(t_max_staged),
    .scrub_start_i(tick), .bad_o(mem_bad), .corrected_o(mem_corrected), .scrub_busy_o(scrub_busy)
  );

  tc_sensc u_sensc (
    .clk_i, .rst_ni(rst_n),
    .start_i(sens_start), .type_i(params.sens_type[2:0]),
    .custom_i({params.sens_frame, params.sens_data, params.sens_scale, params.sens_offset, params.sens_fault_mask,
               params.sens_check_mask_h, params.sens_check_mask_l, params.sens_check_value_h, params.sens_check_value_l,
               params.sens_setup}),
    .spi_div_i(params.spi_div[7:0]), .trim_i(params.sens_trim), .miso_i(miso), .reconfig_i(commit),
    .sclk_o(spi_sclk_o), .cs_no(spi_cs_no), .mosi_o(spi_mosi_o),
    .busy_o(sens_busy), .done_o(sens_done),
`ifndef SYNTHESIS
    .clocks_o(reading_clocks),
`endif
    .reading_o(reading)
  );

  tc_algor u_algor (
    .clk_i, .rst_ni(rst_n),
    .params_i(params), .start_i(algor_start), .sample_ok_i(!sample_held), .run_i(run), .at_temp_i(at_temp), .ms_i(ms),
    .pv_i(pv), .drop_i(drop), .hold_test_i(hold_test), .tuning_i(tuning), .tune_duty_i(tune_duty),
    .tune_hold_i(tune_hold), .done_o(algor_done), .duty_o(duty), .sp_work_o(sp_work), .ramping_o(ramping),
    .i_o(algor_i), .filt_o(algor_filt), .still_o(algor_still), .limited_o(limited),
`ifndef SYNTHESIS
    .computing_o(computing),
`endif
    .segment_o(segment), .i_held_o(i_held), .hold_limit_o(hold_limit),
    .target_o(target), .amb_o(amb), .duty_max_o(duty_max), .term_p_o(term_p), .term_i_o(term_i), .term_d_o(term_d)
  );

  assign sample = algor_start && !sample_held;

  tc_atune u_atune (
    .clk_i, .rst_ni(rst_n),
    .tune_i(cmd_tune), .run_i(run), .sample_i(sample), .tenth_i(tenth), .commit_i(commit), .pv_i(pv),
    .sp_work_i(sp_work), .amb_i(amb), .ramping_i(ramping), .duty_max_i(duty_max),
    .window_i(params.at_window),
    .tuning_o(tuning), .duty_o(tune_duty), .hold_o(tune_hold), .stop_o(tune_stop),
    .parity_o(tune_parity), .still_o(tune_still),
    .wr_o(tune_wr), .wr_index_o(tune_index), .wr_data_o(tune_data), .tuned_o(tuned)
  );

  tc_quality u_quality (
    .clk_i, .rst_ni(rst_n),
    .run_i(run), .sample_i(sample), .tenth_i(tenth), .pv_i(pv), .target_i(target), .window_i(params.at_window),
    .at_temp_i(at_temp), .heater_i(heater), .quality_o(quality), .on_time_o(on_time)
  );

  tc_pwmc u_pwmc (
    .clk_i, .rst_ni(rst_n),
    .prescale_i(params.pwm_prescale), .period_i(params.pwm_period), .min_on_i(params.pwm_min_on),
    .dither_i(params.ctrl[tc_pkg::CtrlDither]),
    .enable_i(run), .duty_i(duty), .load_i(pwm_load), .pwm_o(pwm),
    .parity_o(pwmc_parity), .still_o(pwmc_still), .period_start_o(period_start)
  );

  tc_guard u_guard (
    .clk_i, .rst_ni(rst_n),
    .params_i(params), .tenth_i(tenth),
    .sens_done_i(sens_done), .sens_i(reading),
    .duty_i(duty), .hold_limit_i(hold_limit), .limited_i(limited), .segment_i(segment), .sp_work_i(sp_work),
    .ramping_i(ramping), .pwm_i(pwm),
    .run_i(cmd_run), .stop_i(stop), .clear_i(cmd_clear), .good_frame_i(good_frame), .mem_bad_i(mem_bad),
    .state_illegal_i(state_bad), .overrun_i(overrun),
    .watch_parity_i({pwmc_parity, ^{algor_i, algor_filt, sp_work, tune_parity}}),
    .watch_still_i({pwmc_still, algor_still && tune_still}),
    .inhibit_i(inhibit), .heater_fb_i(heater_fb),
    .heater_o(heater), .safe_en_o, .run_o(run), .run_allowed_o(run_allowed), .at_temp_o(at_temp),
    .sensor_ok_o(sensor_ok), .sample_held_o(sample_held), .hold_test_o(hold_test), .wd_armed_o(wd_armed),
    .permitted_o(permitted), .pv_valid_o(pv_valid), .pv_o(pv), .slope_o(slope), .samples_o(samples),
    .sensor_errors_o(sensor_errors), .wd_left_o(wd_left),
`ifndef SYNTHESIS
    .accept_o(accept),
`endif
    .cause_o(cause), .fault_o(fault), .first_fault_o(first_fault)
  );

  // ---- Pins ---------------------------------------------------------------------------------------------------------

  // The emergency stop acts even when the clock is gone.
  assign heater_o  = heater && !inhibit_i;
  assign fault_no  = fault == 15'd0;
  assign at_temp_o = at_temp;
  assign scan_o    = '0;

  logic unused;
  assign unused = ^{params, sens_busy, scrub_busy, period_start, scan_i};

`ifndef SYNTHESIS
  tc_properties u_properties (
    .clk_i, .rst_ni(rst_n),
    .heater_pin_i(heater_o), .inhibit_pin_i(inhibit_i), .safe_en_i(safe_en_o),
    .params_i(params), .tenth_i(tenth),
    .sens_done_i(sens_done), .sens_ok_i(reading.ok), .sens_pv_i(reading.pv), .accept_i(accept), .duty_i(duty),
    .run_cmd_i(cmd_run), .cmd_stop_i(cmd_stop), .uart_stop_i(uart_stop), .tune_stop_i(tune_stop), .clear_i(cmd_clear),
    .good_frame_i(good_frame), .mem_bad_i(mem_bad), .illegal_i(illegal), .overrun_i(overrun), .inhibit_i(inhibit),
    .pwm_i(pwm), .heater_i(heater), .run_i(run), .sensor_ok_i(sensor_ok), .pv_valid_i(pv_valid), .pv_i(pv),
    .cause_i(cause), .fault_i(fault), .first_fault_i(first_fault),
    .cmd_valid_i(cmd_valid), .cmd_broadcast_i(cmd.broadcast), .rsp_busy_i(rsp_busy), .de_i(uart_de_o),
    .write_i(write), .store_i(store), .index_i(index), .value_i(value), .discard_i(discard), .discarding_i(discarding),
    .tune_i(cmd_tune), .tune_wr_i(tune_wr),
    .state_i(state), .tick_i(tick), .commit_i(commit), .sens_start_i(sens_start), .sens_busy_i(sens_busy),
    .reading_i(reading_clocks),
    .algor_start_i(algor_start), .computing_i(computing)
  );
`endif

endmodule
