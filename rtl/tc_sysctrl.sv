// SPDX-License-Identifier: Apache-2.0
// SYSCTRL: main state machine (Xie et al. 2023, fig. 5) and the chip's time base.
//
// Nine states, any two codes at least two bits apart; an illegal code raises illegal_o and falls to Idle in one clock
// (GUARD has the heater off by then). The control tick of period TS is served from CmdReady or CfgPwm: a parameter
// commit (commit_o), then the sensor reading one clock later, so that a tick never sees half a parameter set.
`include "tc_assert.svh"

module tc_sysctrl #(
  // Clocks of a millisecond; a parameter so that proofs can shorten the time base.
  parameter int unsigned MsClocks = tc_pkg::ClkHz / 1000
) (
  input  logic        clk_i,
  input  logic        rst_ni,
`ifdef TC_SYSCTRL_UPSET
  // For tests and proofs: flips bits of the state.
  input  logic [4:0]  upset_i,
`endif

  input  logic        test_mode_i,     // short times, for tests
  input  logic [15:0] ts_i,            // control period, ms
  input  logic [15:0] tlm_period_i,    // 0.1 s, 0 = off

  input  logic        cmd_valid_i,     // UARTC: a command waits
  input  logic        decoded_i,       // PARAMC: command judged ...
  input  logic        writes_i,        // ... and has parameters to write
  input  logic        last_i,          // PARAMC: the parameter in hand is the last
  input  logic        pending_i,       // PARAMC: staged writes wait for the tick
  input  logic        discarding_i,    // MEM: takes no write
  input  logic        sens_done_i,
  input  logic        algor_done_i,

  output logic [4:0]  state_o,
  output logic        decode_o,        // level in CmdDecode
  output logic        extract_o,       // level in ExtrParam
  output logic        write_o,         // level in WrParam
  output logic        cmd_done_o,      // pulse: command carried out, answer may start
  output logic        commit_o,        // pulse: staged set becomes active
  output logic        tick_o,          // pulse: first clock of a control period's work
  output logic        sens_start_o,    // pulse
  output logic        display_o,       // level in TempDisplay
  output logic        tlm_start_o,     // pulse
  output logic        algor_start_o,   // pulse
  output logic        pwm_load_o,      // pulse
  output logic        illegal_o,       // level: illegal state code
  // pulse: a tick came before the last one's work was done, or that went out of order
  output logic        overrun_o,
  output logic        ms_o,            // pulse each millisecond
  output logic        tenth_o          // pulse each 0.1 s
);

  if (MsClocks < 1 || MsClocks > 16384) begin : g_no_millisecond
    $error("tc_sysctrl: MsClocks: expected 1 to 16384 clocks a millisecond");
  end
  localparam logic [13:0] MsLast = 14'(MsClocks - 1);
  localparam logic [13:0] TestMsLast = MsClocks > tc_pkg::TestSpeedup ? 14'(MsClocks / tc_pkg::TestSpeedup - 1) : 14'd0;

  tc_pkg::state_e state_q, state_d;
  logic [2:0]  served_q;               // parts of the tick's work done: sample, display, duty
  logic [13:0] ms_cnt_q;               // clocks of this millisecond
  logic [6:0]  tenth_cnt_q;            // milliseconds of this tenth of a second
  logic [10:0] ts_cnt_q;               // milliseconds of this control period
  logic [15:0] tlm_cnt_q;              // tenths of a second since telemetry was due
  logic        tick_pend_q;            // a control tick waits for CmdReady or CfgPwm
  logic        tlm_due_q;              // telemetry waits for the next TempDisplay
  // Outputs of the same name.
  logic        ms_q, tenth_q, overrun_q;
  logic        cmd_done_q, commit_q, tick_q, sens_start_q, tlm_start_q, algor_start_q, pwm_load_q;

  assign state_o       = state_q;
  assign decode_o      = state_q == tc_pkg::StCmdDecode;
  assign extract_o     = state_q == tc_pkg::StExtrParam;
  assign write_o       = state_q == tc_pkg::StWrParam;
  assign display_o     = state_q == tc_pkg::StTempDisplay;
  assign illegal_o     = !tc_pkg::state_legal(state_q);
  assign cmd_done_o    = cmd_done_q;
  assign commit_o      = commit_q;
  assign tick_o        = tick_q;
  assign sens_start_o  = sens_start_q;
  assign tlm_start_o   = tlm_start_q;
  assign algor_start_o = algor_start_q;
  assign pwm_load_o    = pwm_load_q;
  assign overrun_o     = overrun_q;
  assign ms_o          = ms_q;
  assign tenth_o       = tenth_q;

  // cmd_valid_i falls one clock after cmd_done_q: the command just carried out must not start again.
  logic new_cmd;
  assign new_cmd = cmd_valid_i && !cmd_done_q;

  always_comb begin
    state_d = tc_pkg::StIdle;
    unique case (state_q)
      tc_pkg::StIdle:        state_d = new_cmd ? tc_pkg::StCmdDecode : tc_pkg::StIdle;
      tc_pkg::StCmdDecode:   state_d = !decoded_i ? tc_pkg::StCmdDecode
                                     : writes_i ? tc_pkg::StExtrParam : tc_pkg::StCmdReady;
      tc_pkg::StExtrParam:   state_d = discarding_i ? tc_pkg::StExtrParam : tc_pkg::StWrParam;
      tc_pkg::StWrParam:     state_d = last_i ? tc_pkg::StCmdReady : tc_pkg::StExtrParam;
      tc_pkg::StCmdReady:    state_d = new_cmd ? tc_pkg::StCmdDecode
                                     : tick_pend_q ? tc_pkg::StReadTemp : tc_pkg::StCmdReady;
      tc_pkg::StReadTemp:    state_d = sens_done_i ? tc_pkg::StTempDisplay : tc_pkg::StReadTemp;
      tc_pkg::StTempDisplay: state_d = tc_pkg::StInitAlgor;
      tc_pkg::StInitAlgor:   state_d = algor_done_i ? tc_pkg::StCfgPwm : tc_pkg::StInitAlgor;
      tc_pkg::StCfgPwm:      state_d = new_cmd ? tc_pkg::StCmdDecode
                                     : tick_pend_q ? tc_pkg::StReadTemp : tc_pkg::StCfgPwm;
      default:               state_d = tc_pkg::StIdle;
    endcase
  end

  // In test mode a millisecond is TestSpeedup times shorter, and each ends a tenth of a second.
  logic ms_last, tenth_last;
  assign ms_last    = ms_cnt_q == (test_mode_i ? TestMsLast : MsLast);
  assign tenth_last = tenth_cnt_q == 7'd99 || test_mode_i;

  localparam logic [2:0] Served = 3'b111;

  logic to_read, to_ready, ts_wrap, tlm_wrap, sampled, computed, disordered;
  assign to_read  = state_d == tc_pkg::StReadTemp && state_q != tc_pkg::StReadTemp;
  assign sampled    = state_q == tc_pkg::StReadTemp && sens_done_i;
  assign computed   = state_q == tc_pkg::StInitAlgor && algor_done_i;
  assign disordered = (sampled && served_q != 3'b000) || (display_o && served_q != 3'b001) ||
                      (computed && served_q != 3'b011);
  assign to_ready = state_d == tc_pkg::StCmdReady && state_q != tc_pkg::StCmdReady;
  assign ts_wrap  = ms_q && {5'd0, ts_cnt_q} + 16'd1 >= ts_i;
  assign tlm_wrap = {1'b0, tlm_cnt_q} + 17'd1 >= {1'b0, tlm_period_i};

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      state_q       <= tc_pkg::StIdle;
      served_q      <= Served;
      ms_cnt_q      <= 14'd0;
      ms_q          <= 1'b0;
      tenth_cnt_q   <= 7'd0;
      tenth_q       <= 1'b0;
      ts_cnt_q      <= 11'd0;
      tick_pend_q   <= 1'b0;
      overrun_q     <= 1'b0;
      tlm_cnt_q     <= 16'd0;
      tlm_due_q     <= 1'b0;
      cmd_done_q    <= 1'b0;
      commit_q      <= 1'b0;
      tick_q        <= 1'b0;
      sens_start_q  <= 1'b0;
      tlm_start_q   <= 1'b0;
      algor_start_q <= 1'b0;
      pwm_load_q    <= 1'b0;
    end else begin
`ifdef TC_SYSCTRL_UPSET
      state_q <= state_d ^ upset_i;
`else
      state_q <= state_d;
`endif

      // Time base.
      ms_cnt_q <= ms_last ? 14'd0 : ms_cnt_q + 14'd1;
      ms_q     <= ms_last;
      if (ms_q) tenth_cnt_q <= tenth_last ? 7'd0 : tenth_cnt_q + 7'd1;
      tenth_q <= ms_q && tenth_last;

      // Control tick. Before the first command nothing is due, so nothing can be late.
      if (ms_q) ts_cnt_q <= ts_wrap ? 11'd0 : ts_cnt_q + 11'd1;
      if (state_q == tc_pkg::StIdle) tick_pend_q <= 1'b0;
      else if (ts_wrap) tick_pend_q <= 1'b1;
      else if (to_read) tick_pend_q <= 1'b0;
      // Its work, part by part: all of it must be done when the next tick comes, and in this order.
      if (state_q == tc_pkg::StIdle) served_q <= Served;
      else if (to_read) served_q <= 3'b000;
      else served_q <= served_q | {computed, display_o, sampled};
      overrun_q <= (ts_wrap && (tick_pend_q || served_q != Served)) || disordered;

      // Telemetry.
      if (tlm_period_i == 16'd0) begin
        tlm_cnt_q <= 16'd0;
        tlm_due_q <= 1'b0;
      end else begin
        if (display_o) tlm_due_q <= 1'b0;
        if (tenth_q) begin
          tlm_cnt_q <= tlm_wrap ? 16'd0 : tlm_cnt_q + 16'd1;
          if (tlm_wrap) tlm_due_q <= 1'b1;
        end
      end
      tlm_start_q <= display_o && tlm_due_q;

      // Hand-overs.
      cmd_done_q    <= to_ready;
      tick_q        <= to_read;
      commit_q      <= to_read && pending_i;
      sens_start_q  <= tick_q;
      algor_start_q <= display_o;
      pwm_load_q    <= computed;
    end
  end

`ifndef SYNTHESIS
  `TC_ASSERT_SETUP
  // P16: an illegal state falls to Idle in one clock (and has the heater off in two: P02_BrokenIsOff_A).
  `TC_ASSERT_IF(P16_IllegalFallsToIdle_A, illegal_o, state_d == tc_pkg::StIdle)
  `TC_ASSERT_NEXT(SysctrlCommitOnlyWithTick_A, to_read && pending_i, commit_q && tick_q)
`ifndef TC_SYSCTRL_UPSET
  `TC_ASSERT_IF(SysctrlSensStartInReadTemp_A, sens_start_q, state_q == tc_pkg::StReadTemp ||
      state_q == tc_pkg::StTempDisplay)
  `TC_ASSERT(SysctrlTickExcludesDecode_A, !(tick_q && decode_o))
  `TC_ASSERT(SysctrlCommitExcludesWrite_A, !(commit_q && write_o))
`endif
`endif

endmodule
