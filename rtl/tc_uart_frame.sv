// SPDX-License-Identifier: Apache-2.0
// Modbus RTU framing: collects characters into a frame, judges it at the end, and holds the command until it is done.
//
// A frame ends with gap_i if its CRC is right, it has 4..256 bytes and no character error. Any other is given up with
// give_up_i, which comes earlier unless the host may pause. A frame for another address is dropped in silence. A frame
// of which a byte came while busy_i or cmd_valid_o is dropped as a whole, with one exception: STOP (FC 06, CMD = 0) is
// heard at any time, since it only needs matching, no storage. stop_o, good_o: one clock, in the clock after the frame
// was judged. cmd_o and its words hold from cmd_valid_o until the answer has been sent.
`include "tc_assert.svh"

module tc_uart_frame (
  input  logic        clk_i,
  input  logic        rst_ni,
  input  logic [7:0]  address_i,
  // Receiver.
  input  logic        valid_i,
  input  logic [7:0]  data_i,
  input  logic        error_i,
  input  logic        gap_i,
  input  logic        give_up_i,
  // Command.
  input  logic        busy_i,          // an answer is being sent
  input  logic        cmd_done_i,
  output logic        open_o,          // bytes of a frame not yet judged
  output logic        cmd_valid_o,
  output tc_types_pkg::command_t cmd_o,
  input  logic [3:0]  cmd_word_index_i,
  output logic [15:0] cmd_word_o,      // read port: follows cmd_word_index_i in the same clock
  output logic        stop_o,
  output logic        good_o,
  output tc_types_pkg::line_counters_t counters_o
);

  localparam logic [8:0] LeastBytes = 9'd4;    // address, function code, CRC
  localparam logic [8:0] MostBytes  = 9'd256;
  localparam logic [8:0] OverLong   = 9'd257;  // count_q stays here
  localparam logic [8:0] StopBytes  = 9'd8;
  localparam logic [8:0] FirstWord  = 9'd7;    // byte place of the data words of FC 16
  localparam logic [8:0] WordsEnd   = FirstWord + {tc_pkg::WriteWords[7:0], 1'b0};
  localparam logic [3:0] WordMask   = 4'(tc_pkg::WriteWords - 16'd1);

  // Frame being received.
  logic [8:0]  count_q;        // bytes so far
  logic [15:0] crc_q;          // over them; 0 with a right CRC behind them
  logic        bad_q;          // a character error
  logic        skip_q;         // a byte came while a command or an answer was in hand
  logic        match_q;        // own address or broadcast
  logic        stop_like_q;    // all bytes so far are those of a STOP to us
  // Command: header and data words, written as they come in.
  logic        broadcast_q;
  logic [7:0]  fc_q;           // function code
  logic [15:0] a_q;            // bytes 2 and 3: the first register's address
  logic [15:0] b_q;            // bytes 4 and 5: count or value
  logic [7:0]  bytes_q;        // byte 6: of FC 16 how many bytes of data follow
  logic [8:0]  len_q;          // bytes of the whole frame
  (* mem2reg *) logic [15:0] words_q [16];
  logic        cmd_valid_q;    // all of these hold a command that waits or is carried out
  logic        stop_q;
  logic        good_q;
  // Counters, modulo 65536.
  logic [15:0] crc_errors_q;
  logic [15:0] char_errors_q;
  logic [15:0] messages_q;

  assign open_o          = count_q != 9'd0;
  assign cmd_valid_o     = cmd_valid_q;
  assign cmd_word_o      = words_q[cmd_word_index_i];
  assign stop_o          = stop_q;
  assign good_o          = good_q;
  always_comb begin
    counters_o.crc_errors  = crc_errors_q;
    counters_o.char_errors = char_errors_q;
    counters_o.messages    = messages_q;
  end
  always_comb begin
    cmd_o.broadcast = broadcast_q;
    cmd_o.fc        = fc_q;
    cmd_o.a         = a_q;
    cmd_o.b         = b_q;
    cmd_o.count     = bytes_q;
    cmd_o.len       = len_q;
  end

  // STOP on the wire: address, 06, CMD register, CmdStop, CRC.
  logic stop_byte, match;
  assign match = data_i == address_i || data_i == tc_pkg::BroadcastAddress;
  always_comb begin
    unique case (count_q)
      9'd0:    stop_byte = match;
      9'd1:    stop_byte = data_i == tc_pkg::FcWriteSingle;
      9'd2:    stop_byte = data_i == tc_pkg::HoldingBase[15:8];
      9'd3:    stop_byte = data_i == tc_pkg::HoldingBase[7:0];
      9'd4:    stop_byte = data_i == tc_pkg::CmdStop[15:8];
      9'd5:    stop_byte = data_i == tc_pkg::CmdStop[7:0];
      default: stop_byte = 1'b1;  // CRC, judged at the end
    endcase
  end

  logic skip, bad, good, ends;
  logic [8:0] place;
  assign skip    = skip_q || busy_i || cmd_valid_q;
  assign bad     = bad_q || count_q == OverLong;
  assign good    = crc_q == 16'd0 && count_q >= LeastBytes && !bad;
  assign ends    = open_o && (good ? gap_i : give_up_i);
  assign place   = count_q - FirstWord;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      count_q       <= 9'd0;
      crc_q         <= 16'hFFFF;
      bad_q         <= 1'b0;
      skip_q        <= 1'b0;
      match_q       <= 1'b0;
      stop_like_q   <= 1'b0;
      broadcast_q   <= 1'b0;
      fc_q          <= 8'd0;
      a_q           <= 16'd0;
      b_q           <= 16'd0;
      bytes_q       <= 8'd0;
      len_q         <= 9'd0;
      for (int i = 0; i < 16; i++) words_q[i] <= 16'd0;
      cmd_valid_q   <= 1'b0;
      stop_q        <= 1'b0;
      good_q        <= 1'b0;
      crc_errors_q  <= 16'd0;
      char_errors_q <= 16'd0;
      messages_q    <= 16'd0;
    end else begin
      stop_q <= 1'b0;
      good_q <= 1'b0;
      if (cmd_done_i) cmd_valid_q <= 1'b0;

      if (valid_i) begin
        if (count_q != OverLong) count_q <= count_q + 9'd1;
        crc_q       <= tc_math_pkg::crc16_byte(crc_q, data_i);
        bad_q       <= bad_q || error_i;
        skip_q      <= skip;
        match_q     <= count_q == 9'd0 ? match : match_q;
        stop_like_q <= stop_byte && (count_q == 9'd0 || stop_like_q);
        if (!skip) begin
          if (error_i || count_q == MostBytes) char_errors_q <= char_errors_q + 16'd1;
          unique case (count_q)
            9'd0: broadcast_q <= data_i == tc_pkg::BroadcastAddress;
            9'd1: fc_q        <= data_i;
            9'd2: a_q[15:8]   <= data_i;
            9'd3: a_q[7:0]    <= data_i;
            9'd4: b_q[15:8]   <= data_i;
            9'd5: b_q[7:0]    <= data_i;
            9'd6: bytes_q     <= data_i;
            default:
              if (count_q < WordsEnd) begin
                if (!place[0]) words_q[place[4:1] & WordMask][15:8] <= data_i;
                else words_q[place[4:1] & WordMask][7:0] <= data_i;
              end
          endcase
        end
      end else if (ends) begin
        count_q <= 9'd0;
        crc_q   <= 16'hFFFF;
        bad_q   <= 1'b0;
        skip_q  <= 1'b0;
        if (good && match_q) begin
          stop_q <= stop_like_q && count_q == StopBytes;
          if (!skip_q) begin
            cmd_valid_q <= 1'b1;
            good_q      <= 1'b1;
            len_q       <= count_q;
            messages_q  <= messages_q + 16'd1;
          end
        end
        if (!good && !bad && !skip_q) crc_errors_q <= crc_errors_q + 16'd1;
      end
    end
  end

  logic unused;
  assign unused = ^place[8:5];

  `TC_ASSERT_SETUP
  `TC_ASSERT(UartFrameCountLegal_A, count_q <= OverLong)
  `TC_ASSERT_NEXT(UartFrameCommandKept_A, cmd_valid_q && !cmd_done_i, cmd_valid_q)
  `TC_ASSERT_IF(UartFrameGoodIsCommand_A, good_q, cmd_valid_q)

`ifndef SYNTHESIS
  logic        known, sound, busy, stop_bytes, is_stop, silent_past, sound_past, stop_past;
  logic [8:0]  bytes;
  logic [15:0] crc;
  logic        resumed_q;                         // set by a bench that loads flops
  tc_uart_judge u_judge (
    .clk_i, .rst_ni, .resumed_i(resumed_q), .address_i, .valid_i, .data_i, .error_i, .in_hand_i(busy_i || cmd_valid_q),
    .open_i(open_o), .known_o(known), .bytes_o(bytes), .sound_o(sound), .busy_o(busy), .stop_o(stop_bytes), .crc_o(crc)
  );
  assign is_stop = sound && stop_bytes && bytes == 9'd8;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      resumed_q    <= 1'b0;
      silent_past <= 1'b0;
      sound_past  <= 1'b0;
      stop_past   <= 1'b0;
    end else begin
      resumed_q    <= 1'b0;
      silent_past <= gap_i && !valid_i;
      sound_past  <= !known || (sound && !busy);
      stop_past   <= !known || is_stop;
    end
  end
  // What framing keeps agrees with what the judge kept.
  `TC_ASSERT_IF(UartFrameAgrees_A, known && open_o,
                count_q == bytes && crc_q == crc && skip_q == busy && stop_like_q == stop_bytes && (match_q &&
                    good) == sound)
  // P9: a sound STOP frame to this slave or all, followed by the silence, is a STOP in the next clock, while busy and
  // locked too.
  `TC_ASSERT_NEXT(P09_StopIsHeard_A, known && is_stop && gap_i && !valid_i, stop_q)
  // Nothing else is a STOP.
  `TC_ASSERT_IF(P09_StopIsTrue_A, stop_q, stop_past && silent_past)
  // P10: only a frame with this slave's address or the broadcast's, a right CRC, 4 to 256 characters without error and
  // the silence behind it becomes a command.
  `TC_ASSERT_IF(P10_CommandIsSound_A, good_q, sound_past && silent_past)
`endif

endmodule
