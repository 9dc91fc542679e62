// SPDX-License-Identifier: Apache-2.0
// PARAMC: judges a received command, hands its parameters to MEM one by one, keeps the staged-write bookkeeping, and
// answers register reads.
//
// CmdDecode: one clock for function, length, count and address, then one clock for each value; the first defect decides
// the exception, and nothing is written. ExtrParam takes the next value, WrParam writes it (write_i with store_o) or
// carries out the command word. Reads show the staged holding registers and the input registers as TempDisplay latched
// them.
`include "tc_assert.svh"

module tc_paramc (
  input  logic        clk_i,
  input  logic        rst_ni,

  // Main state machine.
  input  logic        decode_i,
  input  logic        extract_i,
  input  logic        write_i,
  input  logic        commit_i,
  input  logic        display_i,
  output logic        decoded_o,
  output logic        writes_o,
  output logic        last_o,
  output logic        pending_o,        // staged writes to commit at the tick

  // Command as UARTC holds it.
  input  tc_types_pkg::command_t cmd_i,
  output logic [3:0]  cmd_word_index_o,
  input  logic [15:0] cmd_word_i,       // read port: follows cmd_word_index_o in the same clock
  output logic [2:0]  rsp_kind_o,
  output logic [7:0]  rsp_exc_o,        // exception code; with the server id the run indicator

  // MEM.
  output logic        store_o,          // the parameter in hand goes to MEM (not the command word)
  output logic [5:0]  index_o,
  output logic [15:0] value_o,
  output logic        discard_o,
  input  logic        discarding_i,     // until MEM has done it; ExtrParam waits
  input  logic [15:0] t_max_staged_i,
  input  logic [15:0] lock_i,           // active LOCK

  // GUARD.
  input  logic        running_i,
  input  logic        run_allowed_i,
  input  logic        cause_present_i,
  input  logic        manual_i,
  output logic        run_o,            // pulses
  output logic        stop_o,
  output logic        clear_o,

  // ATUNE.
  input  logic        tuning_i,
  input  logic        tune_wr_i,        // it writes a gain to MEM's staged set
  output logic        tune_o,           // pulse

  // Register read port of UARTC.
  input  logic [15:0] rd_addr_i,
  output logic [15:0] rd_data_o,        // follows rd_addr_i in the same clock
  output logic [5:0]  mem_rd_index_o,   // follows rd_addr_i in the same clock
  input  logic [15:0] mem_rd_data_i,
  input  logic        rd_busy_i,        // an answer or telemetry frame is being sent: keep the snapshot

  // What the input registers show.
  input  logic        pv_valid_i,
  input  logic [15:0] pv_i,
  input  logic [15:0] slope_i,
  input  logic [15:0] sp_work_i,
  input  logic [16:0] duty_i,
  input  logic [17:0] term_p_i,
  input  logic [17:0] term_i_i,
  input  logic [17:0] term_d_i,
  input  logic [31:0] raw_i,
  input  logic [15:0] samples_i,
  input  tc_pkg::status_t status_i,     // writes_pending and hold are PARAMC's own, low here
  input  logic [tc_pkg::FaultCount-1:0] fault_i,
  input  logic [tc_pkg::FaultCount-1:0] cause_i,
  input  logic [3:0]  first_fault_i,
  input  logic [4:0]  state_i,
  input  logic [15:0] wd_left_i,
  input  tc_types_pkg::line_counters_t counters_i,
  input  logic [15:0] sensor_errors_i,
  input  logic [15:0] mem_corrected_i,
  input  tc_types_pkg::quality_t quality_i,
  input  logic [31:0] on_time_i,
  input  tc_types_pkg::tuned_t tuned_i,
  input  logic [16:0] tune_hold_i
);

  localparam logic [15:0] HoldingEnd = tc_pkg::HoldingBase + 16'(tc_pkg::HoldingCount);

  logic        decoded_q;       // the command has been judged ...
  logic        writes_q;        // ... and has parameters to write
  logic        checking_q;      // its form was sound; its values are being judged
  logic        last_q;          // the parameter in hand is the last
  logic [2:0]  rsp_kind_q;      // the answer: tc_pkg::Rsp*
  logic [7:0]  rsp_exc_q;
  logic [3:0]  word_q;          // word of the command in hand
  logic [5:0]  index_q;         // register in hand
  logic [15:0] value_q;
  logic        staged_q;        // writes wait for a commit
  logic        hold_q;          // host asked to keep them staged
  logic        ordered_q;       // host ordered the commit
  logic        run_q, stop_q, clear_q, discard_q, tune_q;  // the command word, for one clock

  // Snapshot of the input registers that belong to one sample.
  logic        snap_valid_q;
  logic [15:0] snap_pv_q, snap_slope_q, snap_sp_q, snap_samples_q;
  logic [16:0] snap_duty_q;
  logic [17:0] snap_p_q, snap_i_q, snap_d_q;
  logic [31:0] snap_raw_q;

  assign decoded_o        = decoded_q;
  assign writes_o         = writes_q;
  assign last_o           = last_q;
  assign pending_o        = staged_q && !hold_q && !discard_q;
  assign cmd_word_index_o = word_q;
  assign rsp_kind_o       = rsp_kind_q;
  assign rsp_exc_o        = rsp_exc_q;
  assign store_o          = index_q != tc_pkg::RegCmd;
  assign index_o          = index_q;
  assign value_o          = value_q;
  assign discard_o        = discard_q;
  // With its command still in hand: an upset of one flop is no command.
  assign run_o            = run_q && index_q == tc_pkg::RegCmd && value_q == tc_pkg::CmdRun;
  assign stop_o           = stop_q;
  assign clear_o          = clear_q;
  assign tune_o           = tune_q && index_q == tc_pkg::RegCmd && value_q == tc_pkg::CmdTune;

  // ---- Judging a command --------------------------------------------------------------------------------------------

  logic fc_read, fc_single, fc_multiple, fc_write;
  assign fc_read     = cmd_i.fc == tc_pkg::FcReadHolding || cmd_i.fc == tc_pkg::FcReadInput;
  assign fc_single   = cmd_i.fc == tc_pkg::FcWriteSingle;
  assign fc_multiple = cmd_i.fc == tc_pkg::FcWriteMultiple;
  assign fc_write    = fc_single || fc_multiple;

  // One past the last register asked for. It may wrap: then it is not above its start, or the count is refused.
  logic [15:0] end_addr;
  assign end_addr = cmd_i.a + (fc_single ? 16'd1 : cmd_i.b);

  logic in_holding, in_input;
  assign in_holding = cmd_i.a >= tc_pkg::HoldingBase && end_addr <= HoldingEnd && end_addr > cmd_i.a;
  assign in_input   = cmd_i.a < 16'(tc_pkg::InputCount) && end_addr <= 16'(tc_pkg::InputCount);

  // Of FC 43/14: one object, or a stream of them.
  logic [7:0] read_code;
  logic       one_object;
  assign read_code  = cmd_i.a[7:0];
  assign one_object = read_code == tc_pkg::IdentificationObject;

  // Function, length, count, address, in the order the standard asks for.
  logic [7:0] form_exc;
  logic [2:0] form_kind;
  always_comb begin
    form_exc  = tc_pkg::ExcFunction;
    form_kind = tc_pkg::RspException;
    if (fc_read) begin
      form_kind = tc_pkg::RspRead;
      if (cmd_i.len != 9'd8 || cmd_i.b == 16'd0 || cmd_i.b > tc_pkg::MaxRead) form_exc = tc_pkg::ExcValue;
      else if (!in_holding && !in_input) form_exc = tc_pkg::ExcAddress;
      else form_exc = tc_pkg::ExcNone;
    end else if (fc_single) begin
      form_kind = tc_pkg::RspEcho;
      if (cmd_i.len != 9'd8) form_exc = tc_pkg::ExcValue;
      else if (!in_holding) form_exc = tc_pkg::ExcAddress;
      else form_exc = tc_pkg::ExcNone;
    end else if (fc_multiple) begin
      form_kind = tc_pkg::RspEcho;
      if (cmd_i.b == 16'd0 || cmd_i.b > tc_pkg::WriteWords || {8'd0, cmd_i.count} != {cmd_i.b[14:0], 1'b0} ||
          {7'd0, cmd_i.len} != {cmd_i.b[14:0], 1'b0} + 16'd9) form_exc = tc_pkg::ExcValue;
      else if (!in_holding) form_exc = tc_pkg::ExcAddress;
      else form_exc = tc_pkg::ExcNone;
    end else if (cmd_i.fc == tc_pkg::FcDiagnostics) begin
      form_kind = tc_pkg::RspEcho;
      if (cmd_i.a != 16'd0) form_exc = tc_pkg::ExcFunction;
      else if (cmd_i.len != 9'd8) form_exc = tc_pkg::ExcValue;
      else form_exc = tc_pkg::ExcNone;
    end else if (cmd_i.fc == tc_pkg::FcReportServerId) begin
      form_kind = tc_pkg::RspServerId;
      form_exc  = cmd_i.len == 9'd4 ? tc_pkg::ExcNone : tc_pkg::ExcValue;
    end else if (cmd_i.fc == tc_pkg::FcEncapsulated) begin
      form_kind = one_object ? tc_pkg::RspIdObject : tc_pkg::RspIdStream;
      if (cmd_i.a[15:8] != tc_pkg::MeiType) form_exc = tc_pkg::ExcFunction;
      else if (cmd_i.len != 9'd7 || read_code == 8'd0 || read_code > tc_pkg::IdentificationObject)
        form_exc = tc_pkg::ExcValue;
      else if (one_object && cmd_i.b[15:8] >= 8'(tc_pkg::IdentObjects)) form_exc = tc_pkg::ExcAddress;
      else form_exc = tc_pkg::ExcNone;
    end
  end

  // The value in hand against its register.
  logic [5:0]  reg_now;
  logic [15:0] value_now;
  assign reg_now   = cmd_i.a[5:0] + {2'd0, word_q};
  assign value_now = fc_single ? cmd_i.b : cmd_word_i;

  logic        last_now, is_stop, is_tune, cmd_known, too_low, too_high, above_t_max;
  logic [15:0] flip, setpoint_limit;
  assign last_now  = fc_single || {12'd0, word_q} + 16'd1 == cmd_i.b;
  assign is_stop   = reg_now == tc_pkg::RegCmd && value_now == tc_pkg::CmdStop;
  assign is_tune   = reg_now == tc_pkg::RegCmd && value_now == tc_pkg::CmdTune;
  assign cmd_known = value_now == tc_pkg::CmdStop || value_now == tc_pkg::CmdRun ||
                     value_now == tc_pkg::CmdClearFault || value_now == tc_pkg::CmdHold ||
                     value_now == tc_pkg::CmdCommit || value_now == tc_pkg::CmdDiscard ||
                     value_now == tc_pkg::CmdTune;
  // Two's complement values compare as unsigned once their sign bits are flipped.
  assign flip      = {tc_pkg::reg_signed(reg_now), 15'd0};
  assign too_low   = (value_now ^ flip) < (tc_pkg::reg_min(reg_now) ^ flip);
  assign too_high  = (value_now ^ flip) > (tc_pkg::reg_max(reg_now) ^ flip);
  assign setpoint_limit = t_max_staged_i - tc_pkg::SetpointMargin;
  assign above_t_max    = reg_now == tc_pkg::RegSetpoint && $signed(value_now) > $signed(setpoint_limit);

  logic [7:0] value_exc;
  always_comb begin
    value_exc = tc_pkg::ExcNone;
    if (reg_now == tc_pkg::RegCmd && !cmd_known) value_exc = tc_pkg::ExcValue;
    else if (too_low || too_high || above_t_max) value_exc = tc_pkg::ExcValue;
    else if (is_stop) value_exc = tc_pkg::ExcNone;
    else if (lock_i != 16'd0 && !(reg_now == tc_pkg::RegLock && value_now == 16'd0)) value_exc = tc_pkg::ExcDevice;
    else if (ordered_q || tuning_i || (is_tune && (staged_q || hold_q))) value_exc = tc_pkg::ExcBusy;
    else if (reg_now == tc_pkg::RegCmd && value_now == tc_pkg::CmdRun && !run_allowed_i) value_exc = tc_pkg::ExcDevice;
    else if (reg_now == tc_pkg::RegCmd && value_now == tc_pkg::CmdClearFault && cause_present_i)
      value_exc = tc_pkg::ExcDevice;
    else if (is_tune && (!running_i || manual_i)) value_exc = tc_pkg::ExcDevice;
  end

  logic exec;  // the command word in hand is carried out
  assign exec = write_i && index_q == tc_pkg::RegCmd;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      decoded_q  <= 1'b0;
      writes_q   <= 1'b0;
      checking_q <= 1'b0;
      last_q     <= 1'b0;
      rsp_kind_q <= tc_pkg::RspNone;
      rsp_exc_q  <= 8'd0;
      word_q     <= 4'd0;
      index_q    <= 6'd0;
      value_q    <= 16'd0;
      staged_q   <= 1'b0;
      hold_q     <= 1'b0;
      ordered_q  <= 1'b0;
      run_q      <= 1'b0;
      stop_q     <= 1'b0;
      clear_q    <= 1'b0;
      discard_q  <= 1'b0;
      tune_q     <= 1'b0;
    end else begin
      if (decode_i && !decoded_q) begin
        if (!checking_q) begin
          word_q <= 4'd0;
          if (form_exc == tc_pkg::ExcNone && fc_write) begin
            checking_q <= 1'b1;
          end else begin
            decoded_q  <= 1'b1;
            writes_q   <= 1'b0;
            rsp_kind_q <= cmd_i.broadcast ? tc_pkg::RspNone
                        : form_exc != tc_pkg::ExcNone ? tc_pkg::RspException : form_kind;
            rsp_exc_q  <= form_exc != tc_pkg::ExcNone ? form_exc : {8{form_kind == tc_pkg::RspServerId && running_i}};
          end
        end else if (value_exc != tc_pkg::ExcNone || last_now) begin
          checking_q <= 1'b0;
          decoded_q  <= 1'b1;
          writes_q   <= value_exc == tc_pkg::ExcNone;
          rsp_kind_q <= cmd_i.broadcast ? tc_pkg::RspNone
                      : value_exc != tc_pkg::ExcNone ? tc_pkg::RspException : tc_pkg::RspEcho;
          rsp_exc_q  <= value_exc;
          word_q     <= 4'd0;
        end else begin
          word_q <= word_q + 4'd1;
        end
      end else if (!decode_i) begin
        decoded_q  <= 1'b0;
        checking_q <= 1'b0;
      end

      if (extract_i && !discarding_i) begin
        index_q <= reg_now;
        value_q <= value_now;
        last_q  <= last_now;
        word_q  <= word_q + 4'd1;
      end

      run_q     <= exec && value_q == tc_pkg::CmdRun;
      stop_q    <= exec && value_q == tc_pkg::CmdStop;
      clear_q   <= exec && value_q == tc_pkg::CmdClearFault;
      discard_q <= exec && value_q == tc_pkg::CmdDiscard;
      tune_q    <= exec && value_q == tc_pkg::CmdTune;
      if ((write_i && store_o) || tune_wr_i) staged_q <= 1'b1;
      else if (commit_i || discard_q) staged_q <= 1'b0;
      if (exec && value_q == tc_pkg::CmdHold) hold_q <= 1'b1;
      else if (exec && (value_q == tc_pkg::CmdCommit || value_q == tc_pkg::CmdDiscard)) hold_q <= 1'b0;
      if (exec && value_q == tc_pkg::CmdCommit && staged_q) ordered_q <= 1'b1;
      else if (commit_i || discard_q) ordered_q <= 1'b0;
    end
  end

  // ---- Input registers ----------------------------------------------------------------------------------------------

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      snap_valid_q   <= 1'b0;
      snap_pv_q      <= 16'd0;
      snap_slope_q   <= 16'd0;
      snap_sp_q      <= 16'd0;
      snap_samples_q <= 16'd0;
      snap_duty_q    <= 17'd0;
      snap_p_q       <= 18'd0;
      snap_i_q       <= 18'd0;
      snap_d_q       <= 18'd0;
      snap_raw_q     <= 32'd0;
    end else if (display_i && !rd_busy_i) begin
      snap_valid_q   <= pv_valid_i;
      snap_pv_q      <= pv_i;
      snap_slope_q   <= slope_i;
      snap_sp_q      <= sp_work_i;
      snap_samples_q <= samples_i;
      snap_duty_q    <= duty_i;
      snap_p_q       <= term_p_i;
      snap_i_q       <= term_i_i;
      snap_d_q       <= term_d_i;
      snap_raw_q     <= raw_i;
    end
  end

  // Temperatures in 0.1 degC: x 10 / 64, rounded.
  logic signed [15:0] tenths_src;
  logic signed [19:0] tenths;
  assign tenths_src = rd_addr_i[5:0] == tc_pkg::InPv ? snap_pv_q : snap_sp_q;
  assign tenths     = (20'(tenths_src) * 20'sd5 + 20'sd16) >>> 5;

  // Duties in 0.01 %: x 10000 / 65536, rounded.
  logic signed [17:0] percent_src;
  logic signed [28:0] percent;
  always_comb begin
    unique case (rd_addr_i[5:0])
      tc_pkg::InTermP:  percent_src = snap_p_q;
      tc_pkg::InTermI:  percent_src = snap_i_q;
      tc_pkg::InTermD:  percent_src = snap_d_q;
      tc_pkg::InAtDuty: percent_src = {1'b0, tune_hold_i};
      default:          percent_src = {1'b0, snap_duty_q};   // InDuty
    endcase
  end
  assign percent = (29'(percent_src) * 29'sd625 + 29'sd2048) >>> 12;

  assign mem_rd_index_o = rd_addr_i[5:0];

  tc_pkg::status_t status;
  always_comb begin
    status                = status_i;
    status.writes_pending = staged_q;
    status.hold           = hold_q;
  end

  always_comb begin
    rd_data_o = mem_rd_data_i;
    if (!rd_addr_i[8]) begin
      unique case (rd_addr_i[5:0])
        tc_pkg::InStatus:       rd_data_o = status;
        tc_pkg::InPv:           rd_data_o = snap_valid_q ? tenths[15:0] : tc_pkg::PvNone;
        tc_pkg::InSpWork:       rd_data_o = tenths[15:0];
        tc_pkg::InDuty:         rd_data_o = percent[15:0];
        tc_pkg::InFault:        rd_data_o = {1'b0, fault_i};
        tc_pkg::InFirstFault:   rd_data_o = {4'd0, first_fault_i, 3'd0, state_i};
        tc_pkg::InPvFine:       rd_data_o = snap_pv_q;
        tc_pkg::InPvSlope:      rd_data_o = snap_slope_q;
        tc_pkg::InTermP:        rd_data_o = percent[15:0];
        tc_pkg::InTermI:        rd_data_o = percent[15:0];
        tc_pkg::InTermD:        rd_data_o = percent[15:0];
        tc_pkg::InRawH:         rd_data_o = snap_raw_q[31:16];
        tc_pkg::InRawL:         rd_data_o = snap_raw_q[15:0];
        tc_pkg::InSamples:      rd_data_o = snap_samples_q;
        tc_pkg::InWdLeft:       rd_data_o = wd_left_i;
        tc_pkg::InCause:        rd_data_o = {1'b0, cause_i};
        tc_pkg::InCrcErrors:    rd_data_o = counters_i.crc_errors;
        tc_pkg::InCharErrors:   rd_data_o = counters_i.char_errors;
        tc_pkg::InMessages:     rd_data_o = counters_i.messages;
        tc_pkg::InSensorErrors: rd_data_o = sensor_errors_i;
        tc_pkg::InMemCorrected: rd_data_o = mem_corrected_i;
        tc_pkg::InDeviceId:     rd_data_o = tc_pkg::DeviceId;
        tc_pkg::InVersion:      rd_data_o = tc_pkg::Version;
        tc_pkg::InMapCrc:       rd_data_o = tc_pkg::MapCrc;
        tc_pkg::InOvershoot:    rd_data_o = quality_i.overshoot;
        tc_pkg::InBandTime:     rd_data_o = quality_i.band_time;
        tc_pkg::InBandError:    rd_data_o = quality_i.band_error;
        tc_pkg::InPeak:         rd_data_o = quality_i.peak;
        tc_pkg::InOnTimeH:      rd_data_o = on_time_i[31:16];
        tc_pkg::InOnTimeL:      rd_data_o = on_time_i[15:0];
        tc_pkg::InAtState:      rd_data_o = tuned_i.state;
        tc_pkg::InAtKu:         rd_data_o = tuned_i.ku;
        tc_pkg::InAtTu:         rd_data_o = tuned_i.tu;
        tc_pkg::InAtDuty:       rd_data_o = percent[15:0];
        default:                rd_data_o = 16'd0;
      endcase
    end
  end

  logic unused;
  assign unused = ^{tenths[19:16], percent[28:16], status_i, rd_addr_i[15:9], rd_addr_i[7:6], cmd_i.a[15:6]};

`ifndef SYNTHESIS
  `TC_ASSERT_SETUP
  // A refused command writes nothing, and a broadcast is never answered.
  `TC_ASSERT_IF(ParamcRefusedWritesNothing_A, decoded_q && rsp_kind_q == tc_pkg::RspException, !writes_q)
  `TC_ASSERT_IF(ParamcOneCommandPulse_A, run_q || stop_q || clear_q || discard_q || tune_q,
                $onehot0({run_q, stop_q, clear_q, discard_q, tune_q}))
  `TC_ASSERT_IF(ParamcChecksSoundForm_A, checking_q, decode_i && !decoded_q && form_exc == tc_pkg::ExcNone && fc_write)
  `TC_ASSERT_IF(ParamcHeldIsNotPending_A, hold_q, !pending_o)
  // When the command word was judged no cause was present, or it does not clear faults.
  logic judged_sound;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) judged_sound <= 1'b0;
    else if (!past_ok_q) judged_sound <= 1'b1;
    else if (decode_i && checking_q && reg_now == tc_pkg::RegCmd) judged_sound <= !cause_present_i;
  end
  `TC_ASSERT_IF(P02_ClearJudged_A, clear_q, judged_sound)
  // P15: a command ends in CmdReady after 18 clocks of judging and 32 of writing sixteen parameters at the most, and
  // what its Discard takes.
  logic [5:0] commanded;   // clocks that the command has been in work, but for those that wait for MEM
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) commanded <= 6'd0;
    else if (!(decode_i || extract_i || write_i) || !past_ok_q) commanded <= 6'd0;
    else commanded <= commanded + 6'(commanded != 6'h3F && !(extract_i && discarding_i));
  end
  `TC_ASSERT_IF(P15_CommandEnds_A, commanded != 6'd0, commanded <= 6'd50)
`ifdef FORMAL
  // How far each phase has come.
  logic [3:0]  hand;                             // place of the parameter in hand
  logic [15:0] words;
  assign words = fc_single ? 16'd1 : cmd_i.b;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) hand <= 4'd0;
    else if (extract_i && !discarding_i) hand <= word_q;
  end
  `TC_ASSERT_IF(P15_Judging_A, decode_i && checking_q,
                {12'd0, word_q} < words && words <= tc_pkg::WriteWords && commanded == 6'(word_q) + 6'd1)
  `TC_ASSERT_IF(P15_Judged_A, decode_i && decoded_q,
                commanded <= 6'd17 && (!writes_q || (word_q == 4'd0 && words != 16'd0 && words <= tc_pkg::WriteWords)))
  `TC_ASSERT_IF(P15_Begins_A, decode_i && !checking_q && !decoded_q, commanded == 6'd0)
  `TC_ASSERT_IF(P15_Extracting_A, extract_i,
                {12'd0, word_q} < words && words <= tc_pkg::WriteWords && commanded <= 6'd18 + {1'b0, word_q, 1'b0})
  `TC_ASSERT_IF(P15_Writing_A, write_i, {12'd0, hand} < words && words <= tc_pkg::WriteWords && word_q == hand + 4'd1 &&
                last_q == ({12'd0, hand} + 16'd1 == words) && commanded <= 6'd19 + {1'b0, hand, 1'b0})
`endif
`endif

endmodule
