// SPDX-License-Identifier: Apache-2.0
// Framing alone, for every sequence of characters: a command, and a STOP, exactly when an independent checker says so (P9, P10).
// The checker keeps the first bytes as they are and computes the CRC bit by bit.
`include "tc_assert.svh"

module frame (
  input logic       clk_i,
  input logic       valid_i,
  input logic [7:0] data_i,
  input logic       error_i,
  input logic       gap_i,
  input logic       give_up_i,
  input logic       busy_i,
  input logic       cmd_done_i,
  input logic [7:0] address_free_i,
  input logic [3:0] cmd_word_index_i
);

  logic rst_ni;
  initial rst_ni = 1'b0;
  always @(posedge clk_i) rst_ni <= 1'b1;

  logic        open, cmd_valid, cmd_broadcast, stop, good;
  logic [7:0]  cmd_fc;
  logic [15:0] cmd_a, cmd_b, cmd_word, crc_errors, char_errors, messages;
  logic [7:0]  cmd_count;
  logic [8:0]  cmd_len;
  tc_types_pkg::command_t cmd;
  assign {cmd_broadcast, cmd_fc, cmd_a, cmd_b, cmd_count, cmd_len} = cmd;

  // The address changes only between frames, as UARTC's configuration does.
  logic [7:0] address_q;
  always @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) address_q <= 8'd1;
    else if (!open && !valid_i) address_q <= address_free_i;
  end

  tc_uart_frame dut (
    .clk_i, .rst_ni, .address_i(address_q),
    .valid_i, .data_i, .error_i, .gap_i, .give_up_i, .busy_i, .cmd_done_i,
    .open_o(open), .cmd_valid_o(cmd_valid), .cmd_o(cmd), .cmd_word_index_i, .cmd_word_o(cmd_word),
    .stop_o(stop), .good_o(good), .counters_o({crc_errors, char_errors, messages})
  );

  // -- Checker ----------------------------------------------------------------------------------------------------------------

  logic [15:0] crc_q, crc_next;
  logic [8:0]  bytes_q;         // stays at 257
  logic        error_q, busy_q;
  logic        ours_q, all_q;   // addressed to this slave, to all
  logic [2:0]  stop_q;          // bytes in a row from the first that are those of a STOP, of 5 after the address
  logic [39:0] head_q;          // the five bytes after the address, the first in the top byte
  integer i;
  always_comb begin
    crc_next = crc_q;
    for (i = 0; i < 8; i = i + 1) begin
      crc_next = {1'b0, crc_next[15:1]} ^ ((crc_next[0] ^ data_i[i]) ? 16'hA001 : 16'h0000);
    end
  end

  logic sound, ends, is_stop;
  assign sound   = crc_q == 16'd0 && bytes_q >= 9'd4 && bytes_q != 9'd257 && !error_q;
  assign is_stop = stop_q == 3'd5 && bytes_q == 9'd8;
  assign ends    = !valid_i && bytes_q != 9'd0 && (sound ? gap_i : give_up_i);

  always @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      crc_q   <= 16'hFFFF;
      bytes_q <= 9'd0;
      error_q <= 1'b0;
      busy_q  <= 1'b0;
      ours_q  <= 1'b0;
      all_q   <= 1'b0;
      stop_q  <= 3'd0;
      head_q  <= 40'd0;
    end else if (valid_i) begin
      crc_q   <= crc_next;
      error_q <= error_q || error_i;
      busy_q  <= busy_q || busy_i || cmd_valid;
      if (bytes_q != 9'd257) bytes_q <= bytes_q + 9'd1;
      case (bytes_q)
        9'd0: begin
          ours_q <= data_i == address_q || data_i == 8'd0;
          all_q  <= data_i == 8'd0;
          stop_q <= 3'd0;
        end
        9'd1: head_q[39:32] <= data_i;
        9'd2: head_q[31:24] <= data_i;
        9'd3: head_q[23:16] <= data_i;
        9'd4: head_q[15:8]  <= data_i;
        9'd5: head_q[7:0]   <= data_i;
        default: ;
      endcase
      if ((bytes_q == 9'd1 && stop_q == 3'd0 && data_i == 8'h06) || (bytes_q == 9'd2 && stop_q == 3'd1 && data_i == 8'h01) ||
          (bytes_q == 9'd3 && stop_q == 3'd2 && data_i == 8'h00) || (bytes_q == 9'd4 && stop_q == 3'd3 && data_i == 8'h00) ||
          (bytes_q == 9'd5 && stop_q == 3'd4 && data_i == 8'h00)) begin
        stop_q <= stop_q + 3'd1;
      end
    end else if (ends) begin
      crc_q   <= 16'hFFFF;
      bytes_q <= 9'd0;
      error_q <= 1'b0;
      busy_q  <= 1'b0;
    end
  end

  // -- Properties -------------------------------------------------------------------------------------------------------------

  logic accepts;
  assign accepts = ends && sound && ours_q && !busy_q;

  `TC_ASSERT_SETUP
  `TC_ASSERT_NEXT(AcceptedFrameIsCommand_A, accepts, cmd_valid && good)
  `TC_ASSERT_NEXT(NothingElseIsCommand_A, !accepts, !good && (!cmd_valid || $past(cmd_valid)))
  `TC_ASSERT_NEXT(CommandKeptTillDone_A, cmd_valid && !cmd_done_i, cmd_valid)
  `TC_ASSERT_NEXT(CommandEndsWhenDone_A, cmd_valid && cmd_done_i && !accepts, !cmd_valid)
  `TC_ASSERT_NEXT(StopFrameStops_A, ends && sound && ours_q && is_stop, stop)
  `TC_ASSERT_NEXT(NothingElseStops_A, !(ends && sound && ours_q && is_stop), !stop)
  `TC_COVER(StopHeardWhileBusy_C, stop && busy_i && $past(busy_q))
  `TC_ASSERT_NEXT(HeaderIsTheFrames_A, accepts,
                  cmd_fc == $past(head_q[39:32]) && cmd_broadcast == $past(all_q) &&
                  cmd_len == $past(bytes_q) && ($past(bytes_q) < 9'd6 || {cmd_a, cmd_b} == $past(head_q[31:0])))
  `TC_ASSERT_NEXT(CommandUntouchedWhileInHand_A, cmd_valid || busy_i,
                  cmd_fc == $past(cmd_fc) && cmd_a == $past(cmd_a) && cmd_b == $past(cmd_b) &&
                  cmd_count == $past(cmd_count) && cmd_broadcast == $past(cmd_broadcast))
  `TC_ASSERT_NEXT(OneCounterAtMost_A, 1'b1,
                  $countones({crc_errors != $past(crc_errors), char_errors != $past(char_errors),
                              messages != $past(messages)}) <= 1)

endmodule
