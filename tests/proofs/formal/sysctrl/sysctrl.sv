// SPDX-License-Identifier: Apache-2.0
// Proof of tc_sysctrl with free inputs, reset at any time, and bits of the state flipping at any time (upset_i). The arcs are
// written out here once more, independently of the RTL's next-state logic; tests/cmodel/sysctrl_test.cpp checks the model
// against the list in spec/.

`include "tc_assert.svh"

module formal_sysctrl (
  input logic        clk_i,
  input logic        reset_i,
  input logic [4:0]  upset_i,
  input logic        test_mode_i,
  input logic [15:0] ts_i,
  input logic [15:0] tlm_period_i,
  input logic        cmd_valid_i,
  input logic        decoded_i,
  input logic        writes_i,
  input logic        last_i,
  input logic        pending_i,
  input logic        discarding_i,
  input logic        sens_done_i,
  input logic        algor_done_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  logic [4:0] state;
  logic decode, extract, write, cmd_done, commit, tick, sens_start, display, tlm_start, algor_start, pwm_load;
  logic illegal, overrun, ms, tenth;

  // A short time base brings the ticks within reach; nothing proved depends on its length, or on its being shortened for tests.
  tc_sysctrl #(.MsClocks(2)) u_sysctrl (
    .clk_i, .rst_ni, .upset_i, .test_mode_i, .ts_i, .tlm_period_i, .cmd_valid_i, .decoded_i, .writes_i, .last_i, .pending_i, .discarding_i,
    .sens_done_i,
    .algor_done_i, .state_o(state), .decode_o(decode), .extract_o(extract), .write_o(write), .cmd_done_o(cmd_done),
    .commit_o(commit), .tick_o(tick), .sens_start_o(sens_start), .display_o(display), .tlm_start_o(tlm_start),
    .algor_start_o(algor_start), .pwm_load_o(pwm_load), .illegal_o(illegal), .overrun_o(overrun), .ms_o(ms), .tenth_o(tenth)
  );

  `TC_ASSERT_SETUP

  logic [4:0] past_q;                // state one clock ago
  logic       upset_q, one_flip_q, upset_ever_q, pending_q, discarding_q, valid_q, done_q, tick_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      past_q       <= 5'd0;
      upset_q      <= 1'b0;
      one_flip_q   <= 1'b0;
      upset_ever_q <= 1'b0;
      pending_q    <= 1'b0;
      discarding_q <= 1'b0;
      valid_q      <= 1'b0;
      done_q       <= 1'b0;
      tick_q       <= 1'b0;
    end else begin
      past_q       <= state;
      upset_q      <= upset_i != 5'd0;
      one_flip_q   <= upset_i != 5'd0 && (upset_i & (upset_i - 5'd1)) == 5'd0;
      upset_ever_q <= upset_ever_q || upset_i != 5'd0;
      pending_q    <= pending_i;
      discarding_q <= discarding_i;
      valid_q      <= cmd_valid_i;
      done_q       <= cmd_done;
      tick_q       <= tick;
    end
  end

  function automatic logic arc(input logic [4:0] from, input logic [4:0] to);
    case (from)
      5'b00000: arc = to == 5'b00011;                    // Idle -> CmdDecode
      5'b00011: arc = to == 5'b00101 || to == 5'b01001;  // CmdDecode -> ExtrParam, CmdReady
      5'b00101: arc = to == 5'b00110;                    // ExtrParam -> WrParam
      5'b00110: arc = to == 5'b00101 || to == 5'b01001;  // WrParam -> ExtrParam, CmdReady
      5'b01001: arc = to == 5'b00011 || to == 5'b01010;  // CmdReady -> CmdDecode, ReadTemp
      5'b01010: arc = to == 5'b01100;                    // ReadTemp -> TempDisplay
      5'b01100: arc = to == 5'b01111;                    // TempDisplay -> InitAlgor
      5'b01111: arc = to == 5'b10001;                    // InitAlgor -> CfgPwm
      5'b10001: arc = to == 5'b00011 || to == 5'b01010;  // CfgPwm -> CmdDecode, ReadTemp
      default:  arc = to == 5'b00000;                    // illegal -> Idle
    endcase
  endfunction
  function automatic logic waits(input logic [4:0] from, input logic discarding);  // states that may last
    waits = (from == 5'b00101 && discarding) || from == 5'b00000 || from == 5'b00011 || from == 5'b01001 || from == 5'b01010 || from == 5'b01111 || from == 5'b10001;
  endfunction
  function automatic logic legal(input logic [4:0] code);
    legal = code == 5'b00000 || code == 5'b00011 || code == 5'b00101 || code == 5'b00110 || code == 5'b01001 ||
            code == 5'b01010 || code == 5'b01100 || code == 5'b01111 || code == 5'b10001;
  endfunction

  // Without upsets the state is always legal; any two legal codes differ in two bits, so one flip is always seen.
  `TC_ASSERT_IF(FormalSysctrlLegal_A, !upset_ever_q, legal(state) && !illegal)
  `TC_ASSERT(FormalSysctrlIllegalSeen_A, illegal == !legal(state))
  `TC_ASSERT_IF(FormalSysctrlOneFlipSeen_A, one_flip_q && legal(past_q), illegal)
  // P16: back to Idle in one clock.
  `TC_ASSERT_IF(FormalSysctrlIllegalToIdle_A, !legal(past_q) && !upset_q, state == 5'b00000)
  // Arcs of the specification and no other.
  `TC_ASSERT_IF(FormalSysctrlArcs_A, !upset_q, state == past_q ? waits(past_q, discarding_q) : arc(past_q, state))
  // While MEM discards, ExtrParam waits.
  `TC_ASSERT_IF(FormalSysctrlDiscardWaits_A, !upset_q && past_q == 5'b00101 && discarding_q, state == 5'b00101)

  // Hand-overs: a tick is the first clock in ReadTemp; a commit comes with it or not at all, and before the sensor's start.
  logic in_read_first;
  assign in_read_first = state == 5'b01010 && past_q != 5'b01010;
  `TC_ASSERT_IF(FormalSysctrlTick_A, !upset_q && tick, in_read_first)
  `TC_ASSERT_IF(FormalSysctrlEveryTick_A, !upset_q && in_read_first && past_ok_q, tick)
  `TC_ASSERT_IF(FormalSysctrlCommit_A, commit, tick && pending_q)
  `TC_ASSERT_IF(FormalSysctrlPendingCommits_A, tick && pending_q, commit)
  `TC_ASSERT_IF(FormalSysctrlSensAfterCommit_A, !upset_ever_q && sens_start, tick_q && !commit)
  `TC_ASSERT_IF(FormalSysctrlTickNotDecode_A, !upset_q && tick, !decode)
  // A command ends once for each decoding, and the command that has just ended does not start again.
  `TC_ASSERT_IF(FormalSysctrlDone_A, cmd_done && !upset_q, past_q == 5'b00011 || past_q == 5'b00110)
  `TC_ASSERT_IF(FormalSysctrlNoRestart_A, done_q && past_q == 5'b01001 && !upset_q, state != 5'b00011)
  // A waiting command is taken at once where commands are taken, so parameters are never waited for by a full period.
  `TC_ASSERT_IF(FormalSysctrlCommandFirst_A,
                valid_q && !done_q && !upset_q && (past_q == 5'b00000 || past_q == 5'b01001 || past_q == 5'b10001),
                state == 5'b00011)
  // Nothing is late before the first command.
  `TC_ASSERT_IF(FormalSysctrlIdleNotLate_A, !upset_ever_q && past_q == 5'b00000 && state == 5'b00011, !overrun)
  `TC_COVER(FormalSysctrlOverrun_C, overrun)
  `TC_COVER(FormalSysctrlTelemetry_C, tlm_start)

endmodule
