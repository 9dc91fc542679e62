// SPDX-License-Identifier: Apache-2.0
// Proof of tc_paramc driven by tc_sysctrl, for every command that UARTC can hold and reset at any time. One word of the
// command (chosen by the solver) keeps its value while the command is in hand, the others are free in every clock: what holds
// for any word holds for all.
// (So a command word may differ when it is judged and when it is obeyed: P02_ClearJudged_A is proved in chip/command.)
// engine: induction
// prove: FormalParamc* Paramc* P15_* Sysctrl*

`include "tc_assert.svh"

module formal_paramc (
  input logic        clk_i,
  input logic        reset_i,
  input logic        cmd_start_i,
  input logic        cmd_broadcast_i,
  input logic [7:0]  cmd_fc_i,
  input logic [15:0] cmd_a_i,
  input logic [15:0] cmd_b_i,
  input logic [7:0]  cmd_count_i,
  input logic [8:0]  cmd_len_i,
  input logic [3:0]  watched_i,
  input logic [15:0] watched_word_i,
  input logic [15:0] other_word_i,
  input logic [15:0] t_max_staged_i,
  input logic [15:0] lock_i,
  input logic        running_i,
  input logic        run_allowed_i,
  input logic        cause_present_i,
  input logic        manual_i,
  input logic        tuning_i,
  input logic        tune_wr_i,
  input logic        sens_done_i,
  input logic        algor_done_i,
  input logic        mem_done_i,
  input logic        rd_busy_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  // ---- UARTC's side: a command stays as it is until the clock after cmd_done. LOCK, T_MAX and tuning stay while it is in hand.
  logic        valid_q, broadcast_q, tuning_q;
  logic [7:0]  fc_q, count_q;
  logic [8:0]  len_q;
  logic [15:0] a_q, b_q, watched_word_q, t_max_q, lock_q;
  logic [3:0]  watched_q;
  logic        cmd_done;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      valid_q        <= 1'b0;
      broadcast_q    <= 1'b0;
      fc_q           <= 8'd0;
      count_q        <= 8'd0;
      len_q          <= 9'd0;
      a_q            <= 16'd0;
      b_q            <= 16'd0;
      watched_q      <= 4'd0;
      watched_word_q <= 16'd0;
      t_max_q        <= 16'd0;
      lock_q         <= 16'd0;
      tuning_q       <= 1'b0;
    end else if (!valid_q) begin
      valid_q        <= cmd_start_i;
      broadcast_q    <= cmd_broadcast_i;
      fc_q           <= cmd_fc_i;
      count_q        <= cmd_count_i;
      len_q          <= cmd_len_i;
      a_q            <= cmd_a_i;
      b_q            <= cmd_b_i;
      watched_q      <= watched_i;
      watched_word_q <= watched_word_i;
      t_max_q        <= t_max_staged_i;
      lock_q         <= lock_i;
      tuning_q       <= tuning_i;
    end else if (cmd_done) begin
      valid_q        <= 1'b0;
    end
  end

  logic [4:0]  state;
  logic        decode, extract, write, commit, tick, sens_start, display, tlm_start, algor_start, pwm_load, illegal, overrun;
  logic        ms, tenth, decoded, writes, last, pending, store, discard, run, stop, clear, tune;
  logic [3:0]  word_index;
  logic [2:0]  rsp_kind;
  logic [7:0]  rsp_exc;
  logic [5:0]  index, mem_index;
  logic [15:0] value, rd_data, word;
  assign word = word_index == watched_q ? watched_word_q : other_word_i;

  // MEM's side: a discard may last. ATUNE writes only while it tunes (AtuneWritesOnlyTuning_A), when no Discard passes, and a Tune waits
  // behind the one in hand.
  logic mem_discarding_q, discarding, tune_wr;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) mem_discarding_q <= 1'b0;
    else mem_discarding_q <= discard || (mem_discarding_q && !mem_done_i);
  end
  assign discarding = discard || mem_discarding_q;
  assign tune_wr = tune_wr_i && !discarding;

  tc_sysctrl #(.MsClocks(2)) u_sysctrl (
    .clk_i, .rst_ni, .ts_i(16'd40), .tlm_period_i(16'd0), .cmd_valid_i(valid_q), .decoded_i(decoded), .writes_i(writes),
    .last_i(last), .pending_i(pending), .discarding_i(discarding), .sens_done_i, .algor_done_i, .state_o(state), .decode_o(decode), .extract_o(extract),
    .write_o(write), .cmd_done_o(cmd_done), .commit_o(commit), .tick_o(tick), .sens_start_o(sens_start), .display_o(display),
    .tlm_start_o(tlm_start), .algor_start_o(algor_start), .pwm_load_o(pwm_load), .illegal_o(illegal), .overrun_o(overrun),
    .ms_o(ms), .tenth_o(tenth)
  );

  tc_paramc u_paramc (
    .clk_i, .rst_ni, .decode_i(decode), .extract_i(extract), .write_i(write), .commit_i(commit), .display_i(display),
    .decoded_o(decoded), .writes_o(writes), .last_o(last), .pending_o(pending),
    .cmd_i({broadcast_q, fc_q, a_q, b_q, count_q, len_q}), .cmd_word_index_o(word_index), .cmd_word_i(word), .rsp_kind_o(rsp_kind), .rsp_exc_o(rsp_exc),
    .store_o(store), .index_o(index), .value_o(value), .discard_o(discard), .discarding_i(discarding), .t_max_staged_i(t_max_q), .lock_i(lock_q),
    .running_i, .run_allowed_i, .cause_present_i, .manual_i, .run_o(run), .stop_o(stop), .clear_o(clear),
    .tuning_i(tuning_q), .tune_wr_i(tune_wr), .tune_o(tune),
    .rd_addr_i({10'd0, tc_pkg::InStatus}), .rd_data_o(rd_data), .mem_rd_index_o(mem_index), .mem_rd_data_i(16'd0), .rd_busy_i,
    .pv_valid_i(1'b0), .pv_i(16'd0), .slope_i(16'd0), .sp_work_i(16'd0), .duty_i(17'd0), .term_p_i(18'd0), .term_i_i(18'd0),
    .term_d_i(18'd0), .raw_i(32'd0), .samples_i(16'd0), .status_i(16'd0), .fault_i(15'd0), .cause_i(15'd0), .first_fault_i(4'd0), .state_i(state), .wd_left_i(16'd0),
    .counters_i('0), .sensor_errors_i(16'd0), .mem_corrected_i(16'd0), .quality_i('0), .on_time_i(32'd0), .tuned_i('0), .tune_hold_i(17'd0)
  );

  `TC_ASSERT_SETUP

  // ---- What a sound write is, said once more.
  logic        single, multiple;
  logic [15:0] words;
  assign single   = fc_q == 8'd6;
  assign multiple = fc_q == 8'd16;
  assign words    = single ? 16'd1 : b_q;
  logic form_ok;
  assign form_ok = (single && len_q == 9'd8 || multiple && b_q >= 16'd1 && b_q <= 16'd16 && {8'd0, count_q} == 16'd2 * b_q &&
                    {7'd0, len_q} == 16'd9 + 16'd2 * b_q) &&
                   a_q >= 16'h0100 && {1'b0, a_q} + {1'b0, words} <= 17'h0100 + 17'(tc_pkg::HoldingCount);

  // The parameter in hand: the watched word, or the only one of a single write.
  logic [3:0] hand_q;                 // its place in the command
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) hand_q <= 4'd0;
    else if (extract && !discarding) hand_q <= word_index;
  end
  logic        watched;
  logic [15:0] expected;
  assign watched  = write && (single || hand_q == watched_q);
  assign expected = single ? b_q : watched_word_q;

  function automatic logic in_range(input logic [5:0] i, input logic [15:0] x);
    in_range = tc_pkg::reg_signed(i) ? $signed(x) >= $signed(tc_pkg::reg_min(i)) && $signed(x) <= $signed(tc_pkg::reg_max(i))
                                     : x >= tc_pkg::reg_min(i) && x <= tc_pkg::reg_max(i);
  endfunction

  // What an accepted parameter satisfies: x in register r.
  function automatic logic sound(input logic [5:0] r, input logic [15:0] x, input logic locked, input logic tuning,
                                 input logic [15:0] t_max);
    logic [15:0] limit;
    limit = t_max - 16'd50;
    sound = (r == 6'd0 ? x == 16'h0000 || x == 16'hA501 || x == 16'hA5F0 || x == 16'hA5B0 || x == 16'hA5C0 || x == 16'hA5D0 ||
                         x == 16'hA5A7
                       : in_range(r, x)) &&
            (r != tc_pkg::RegSetpoint || $signed(x) <= $signed(limit)) &&
            (!locked || (x == 16'd0 && (r == tc_pkg::RegLock || r == 6'd0))) && (!tuning || (x == 16'd0 && r == 6'd0));
  endfunction
  logic        sound_now;
  logic [15:0] setpoint_limit;
  assign setpoint_limit = t_max_q - 16'd50;
  assign sound_now = single ? sound(a_q[5:0], b_q, lock_q != 16'd0, tuning_q, t_max_q)
                   : {12'd0, watched_q} >= b_q || sound(a_q[5:0] + {2'd0, watched_q}, watched_word_q, lock_q != 16'd0, tuning_q,
                                             t_max_q);

  // ---- Lemmas: how far each phase of a command has come.
  logic decode_q, checking;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) decode_q <= 1'b0;
    else decode_q <= decode;
  end
  assign checking = decode && decode_q && !decoded;
  logic [5:0] work_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) work_q <= 6'd0;
    else if (!(extract && discarding)) work_q <= decode || extract || write ? work_q + 6'd1 : 6'd0;
  end
  always @(posedge clk_i) begin  // also in the first clock after reset, so that induction may begin anywhere
    FormalParamcCommandStands_A: assert (valid_q || !(decode || extract || write || cmd_done));
    FormalParamcBegins_A: assert (!(decode && !decode_q) || work_q == 6'd0 && !decoded);
    FormalParamcBegins_A_C: cover (decode && !decode_q);
    FormalParamcChecks_A: assert (!(checking) ||
                form_ok && {12'd0, word_index} < words && work_q == {2'd0, word_index} + 6'd1 &&
                (single || word_index <= watched_q || sound_now));
    FormalParamcChecks_A_C: cover (checking);
    FormalParamcDecoded_A: assert (!(decode && decoded) ||
                work_q <= 6'd17 && (!writes || (form_ok && word_index == 4'd0 && sound_now && rsp_kind == (broadcast_q ? 3'd0 : 3'd3))));
    FormalParamcDecoded_A_C: cover (decode && decoded);
    FormalParamcExtracts_A: assert (!(extract) ||
                form_ok && sound_now && {12'd0, word_index} < words && work_q <= 6'd18 + {1'b0, word_index, 1'b0} &&
                rsp_kind == (broadcast_q ? 3'd0 : 3'd3));
    FormalParamcExtracts_A_C: cover (extract);
    FormalParamcWrites_A: assert (!(write) ||
                form_ok && sound_now && {12'd0, hand_q} < words && word_index == hand_q + 4'd1 &&
                last == ({12'd0, hand_q} + 16'd1 == words) && work_q <= 6'd19 + {1'b0, hand_q, 1'b0} &&
                rsp_kind == (broadcast_q ? 3'd0 : 3'd3));
    FormalParamcWrites_A_C: cover (write);
  end

  // ---- Properties
  // Nothing is written but by a sound write command, one register after the other, and by an accepted one only.
  `TC_ASSERT_IF(FormalParamcWriteHasForm_A, write, form_ok && valid_q)
  `TC_ASSERT_IF(FormalParamcWriteAccepted_A, write, rsp_kind != 3'd1)
  `TC_ASSERT_IF(FormalParamcAnswersWrites_A, write && !broadcast_q, rsp_kind == 3'd3)
  `TC_ASSERT_IF(FormalParamcBroadcastSilent_A, cmd_done && broadcast_q, rsp_kind == 3'd0)
  `TC_ASSERT_IF(FormalParamcInPlace_A, write, {10'd0, index} == a_q - 16'h0100 + {12'd0, hand_q} && {12'd0, hand_q} < words)
  `TC_ASSERT_IF(FormalParamcValue_A, watched, value == expected)
  `TC_ASSERT_IF(FormalParamcInRange_A, watched && store, in_range(index, value))
  `TC_ASSERT_IF(FormalParamcSetpoint_A, watched && index == tc_pkg::RegSetpoint,
                $signed(value) <= $signed(setpoint_limit))
  // LOCK: only LOCK = 0 and STOP pass.
  `TC_ASSERT_IF(FormalParamcLocked_A, watched && lock_q != 16'd0,
                value == 16'd0 && (index == tc_pkg::RegLock || index == tc_pkg::RegCmd))
  // While ATUNE is at work: only STOP.
  `TC_ASSERT_IF(FormalParamcTuning_A, watched && tuning_q, value == 16'd0 && index == tc_pkg::RegCmd)
  // While MEM discards nothing is written, whatever the frame holds behind its Discard, and no set becomes active: nothing is staged.
  `TC_ASSERT_IF(FormalParamcDiscardWhole_A, discarding, !write && !commit)
  `TC_ASSERT_IF(FormalParamcDiscarded_A, mem_discarding_q, !rd_data[7])
  `TC_COVER(FormalParamcDiscardWaits_C, extract && mem_discarding_q)
  // Pulses come from a command word that was written in the clock before.
  logic exec_q;
  logic [15:0] value_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      exec_q  <= 1'b0;
      value_q <= 16'd0;
    end else begin
      exec_q  <= write && index == 6'd0;
      value_q <= value;
    end
  end
  `TC_ASSERT(FormalParamcPulses_A, {run, stop, clear, discard, tune} ==
             (!exec_q ? 5'b00000 : value_q == 16'hA501 ? 5'b10000 : value_q == 16'h0000 ? 5'b01000 :
              value_q == 16'hA5F0 ? 5'b00100 : value_q == 16'hA5D0 ? 5'b00010 : value_q == 16'hA5A7 ? 5'b00001 : 5'b00000))
  // Every command ends within 50 clocks, but for those that it waits for MEM to discard: 18 in CmdDecode, 32 for sixteen parameters.
  `TC_ASSERT(FormalParamcEnds_A, work_q <= 6'd50)
  `TC_COVER(FormalParamcSixteen_C, write && last && hand_q == 4'd15)
  `TC_COVER(FormalParamcBusy_C, cmd_done && rsp_kind == 3'd1 && rsp_exc == 8'd6)

endmodule
