// SPDX-License-Identifier: Apache-2.0
// Serial receiver: characters of 8 data bits at any baud rate, and the silence after them.
//
// A low line starts a character; the start bit and every later bit is the majority of ticks 7, 8 and 9 of 16. A high
// start bit was a glitch and leaves no trace. valid_o pulses for one clock when the first stop bit has been judged
// (data_o and error_o hold then); the next start bit is accepted from there on: from the middle of the stop bit if two
// samples were high by then, or a host that is 3.5 % fast would gain on us at 500 kBd. After a low stop bit the line
// must first go high again.
//
// Silence is counted from the end of the last character and stays until the next start bit. Modbus leaves open what
// lies between 1.5 characters, which a host may pause inside a frame, and 3.5, which it keeps between frames.
// - give_up_o: 27 bits (23.5 where a character has 10), nearly 2.5 characters: what is still incomplete won't be
//   completed. A host that keeps its 3.5 characters is heard again although it is 3.5 % fast and although the receiver,
//   having lost the place of the start bits, takes the last character to end up to 10 bits late. With pause_i also
//   1.75 ms since the middle of the first stop bit.
// - gap_o: 3.5 characters less 2.5 bits, so that frames of a host that is 6 % fast are told apart.
// - idle_o: nothing moves. baud_i, format_i and pause_i change only while idle_o.
`include "tc_assert.svh"

module tc_uart_rx (
  input  logic        clk_i,
  input  logic        rst_ni,
  input  logic [12:0] baud_i,
  input  logic [1:0]  format_i,
  input  logic        pause_i,
  input  logic        rx_i,
  output logic        valid_o,
  output logic [7:0]  data_o,
  output logic        error_o,
  output logic        gap_o,
  output logic        give_up_o,
  output logic        idle_o
);

  // Any two codes differ in two bits; an illegal code falls back to idle.
  typedef enum logic [3:0] {
    RxIdle   = 4'b0000,   // the line is high
    RxStart  = 4'b0011,
    RxData   = 4'b0101,
    RxParity = 4'b0110,
    RxStop   = 4'b1001,   // the first stop bit
    RxBreak  = 4'b1010    // it was low: waits for a high line
  } rx_state_e;

  // tick_q counts the ticks gone by in this bit: the n-th tick comes while tick_q is n - 1.
  localparam logic [3:0] FirstSample  = 4'd6;
  localparam logic [3:0] SecondSample = 4'd7;
  localparam logic [3:0] ThirdSample  = 4'd8;

  localparam logic [9:0] GapTicks     = 10'd576;  // 3.5 characters of 11 bits, less 2.5 bits
  localparam logic [9:0] GapTicks10   = 10'd520;  // the same of 10 bits
  localparam logic [9:0] GiveUpLeft   = 10'd144;  // an incomplete frame is given up when fewer ticks are missing
  localparam logic [9:0] StopRest     = 10'd8;    // from the middle of the stop bit to its end
  localparam logic [9:0] SecondStop   = 10'd16;
  localparam logic [14:0] QuietClocks = 15'(tc_pkg::ClkHz / 4000 * 7);  // 1.75 ms: 4000 Hz is 0.25 ms

  rx_state_e   state_q;
  logic [12:0] acc_q;       // accumulator of the baud rate (tc_uart_pkg)
  logic [3:0]  tick_q;
  logic [2:0]  bit_q;       // data bits taken
  logic [1:0]  high_q;      // samples of this bit that were high
  logic [7:0]  shift_q;     // the character; its last bit comes in at the top
  logic        parity_bad_q;
  logic        valid_q;     // a character was judged in the clock before
  logic        error_q;     // its parity or its stop bit was wrong
  logic [9:0]  gap_q;       // ticks of silence still missing
  logic [14:0] quiet_q;     // with pause_i: clocks of silence still missing

  logic [12:0] acc_next;
  logic tick, judged, stop_judged, level, listening;
  assign {tick, acc_next} = tc_uart_pkg::baud_step(acc_q, baud_i);
  assign judged      = tick && tick_q == ThirdSample;
  // One or two samples are in high_q, the last is on the line.
  assign level       = high_q[1] || (high_q[0] && rx_i);  // two of three
  assign stop_judged = judged || (tick && tick_q == SecondSample && level);
  // silence is counted, also under a start bit not yet sure
  assign listening   = state_q == RxIdle || state_q == RxStart;

  assign valid_o    = valid_q;
  assign data_o     = shift_q;
  assign error_o    = error_q;
  assign gap_o      = state_q == RxIdle && gap_q == 10'd0;
  assign give_up_o  = state_q == RxIdle && gap_q < GiveUpLeft && quiet_q == 15'd0;
  assign idle_o     = gap_o && quiet_q == 15'd0;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      state_q      <= RxIdle;
      acc_q        <= 13'd0;
      tick_q       <= 4'd0;
      bit_q        <= 3'd0;
      high_q       <= 2'd0;
      shift_q      <= 8'd0;
      parity_bad_q <= 1'b0;
      valid_q      <= 1'b0;
      error_q      <= 1'b0;
      gap_q        <= 10'd0;
      quiet_q      <= 15'd0;
    end else begin
      valid_q <= 1'b0;
      if (listening && quiet_q != 15'd0) quiet_q <= quiet_q - 15'd1;

      if (state_q != RxIdle || gap_q != 10'd0) begin
        acc_q <= acc_next;
        if (tick) begin
          tick_q <= tick_q + 4'd1;
          if (listening && gap_q != 10'd0) gap_q <= gap_q - 10'd1;
          if (tick_q == FirstSample) high_q <= {1'b0, rx_i};
          else if (tick_q == SecondSample) high_q <= high_q + {1'b0, rx_i};
        end
      end

      unique case (state_q)
        RxIdle: begin
          if (!rx_i) begin
            state_q <= RxStart;
            acc_q   <= 13'd0;
            tick_q  <= 4'd0;
          end
        end
        RxStart: begin
          if (judged) begin
            state_q      <= level ? RxIdle : RxData;
            bit_q        <= 3'd0;
            parity_bad_q <= 1'b0;
          end
        end
        RxData: begin
          if (judged) begin
            shift_q <= {level, shift_q[7:1]};
            bit_q   <= bit_q + 3'd1;
            if (bit_q == 3'd7) state_q <= tc_uart_pkg::has_parity(format_i) ? RxParity : RxStop;
          end
        end
        RxParity: begin
          if (judged) begin
            state_q      <= RxStop;
            parity_bad_q <= level != tc_uart_pkg::ninth_bit(format_i, shift_q);
          end
        end
        RxStop: begin
          if (stop_judged) begin
            state_q <= level ? RxIdle : RxBreak;
            valid_q <= 1'b1;
            error_q <= parity_bad_q || !level;
            gap_q   <= (tc_uart_pkg::char_bits(format_i) == 4'd10 ? GapTicks10 : GapTicks) + StopRest +
                       (format_i == tc_pkg::Format8N2 ? SecondStop : 10'd0);
            quiet_q <= pause_i ? QuietClocks : 15'd0;
          end
        end
        RxBreak: if (rx_i) state_q <= RxIdle;
        default: state_q <= RxIdle;
      endcase
    end
  end

  `TC_ASSERT_SETUP
  `TC_ASSERT(UartRxStateLegal_A, state_q == RxIdle || state_q == RxStart || state_q == RxData || state_q == RxParity ||
                                 state_q == RxStop || state_q == RxBreak)
  `TC_ASSERT(UartRxSilenceLegal_A, gap_q <= GapTicks + StopRest + SecondStop && quiet_q <= QuietClocks)
  `TC_ASSERT_IF(UartRxCharacterBreaksSilence_A, valid_o, !gap_o && !give_up_o && !idle_o)
  `TC_ASSERT_NEXT(UartRxIdleTillStart_A, idle_o && rx_i, idle_o)

`ifndef SYNTHESIS
  // P14: the silence counted the long-hand way, from the middle of the last first stop bit: a bit has 120000 units, a
  // clock baud_i.
  localparam logic [22:0] TickUnits = 23'(tc_pkg::ClkHz / 1600);
  localparam logic [22:0] HalfBit   = 23'd8 * TickUnits;
  logic        resumed_q;                   // set by a bench that loads flops
  logic [22:0] missing;
  logic [6:0]  half_bits;                   // 3.5 characters less 2.5 bits, and the rest of the stop bits
  assign half_bits = (tc_uart_pkg::char_bits(format_i) == 4'd10 ? 7'd66 : 7'd73) +
                     (format_i == tc_pkg::Format8N2 ? 7'd2 : 7'd0);
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      resumed_q <= 1'b0;
      missing   <= 23'd0;
    end else begin
      resumed_q <= 1'b0;
      if (state_q == RxStop && stop_judged) missing <= 23'(half_bits) * HalfBit;
      else if (resumed_q) missing <= 23'd0;
      else if (state_q != RxBreak) missing <= missing > 23'(baud_i) ? missing - 23'(baud_i) : 23'd0;
    end
  end
  // P14: a gap is 3.5 characters less 2.5 bits of silence, to a sixteenth of a bit.
  `TC_ASSERT_IF(P14_GapIsSilence_A, gap_o, missing <= TickUnits)
`endif

`ifdef FORMAL
  // What leads there: what is missing falls with the ticks, of which to_go counts the units.
  logic [23:0] to_go;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) to_go <= 24'd0;
    else if (state_q == RxStop && stop_judged) to_go <= 24'(half_bits) * 24'(HalfBit);
    else if (tick && listening && gap_q != 10'd0) to_go <= to_go - 24'(TickUnits);
  end
  `TC_ASSERT(P14_UnitsAreTicks_A, to_go == 24'(gap_q) * 24'(TickUnits))
  `TC_ASSERT(P14_SilenceFalls_A, acc_q < TickUnits[12:0] &&
             (state_q == RxBreak ? {1'b0, missing} <= to_go
                                 : {1'b0, missing} + 24'(acc_q) <= to_go + 24'(TickUnits) || missing == 23'd0))
  // A host that has not been allowed to pause since reset is heard after every gap.
  logic paused_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) paused_q <= 1'b0;
    else paused_q <= paused_q || pause_i;
  end
  `TC_ASSERT_IF(UartRxNoPauseNoWait_A, !paused_q, quiet_q == 15'd0)
  `TC_ASSERT_IF(UartRxHeardAfterGap_A, !paused_q && gap_o, give_up_o && idle_o)

  // Never locks up: with every tick a character comes nearer to its end, from at most 169 ticks away. phase: ticks
  // since a bit was judged; left: ticks to the end.
  logic       in_char;
  logic [3:0] phase, bits_left;
  logic [7:0] left;
  assign in_char = state_q == RxStart || state_q == RxData || state_q == RxParity || state_q == RxStop;
  assign phase   = tick_q - 4'd9;
  always_comb begin
    case (state_q)
      RxStart:  bits_left = 4'd11;
      RxData:   bits_left = 4'd10 - {1'b0, bit_q};
      RxParity: bits_left = 4'd2;
      default:  bits_left = 4'd1;
    endcase
  end
  assign left = in_char ? {bits_left, 4'd0} - {4'd0, phase} : 8'd0;
  `TC_ASSERT(UartRxCharacterBounded_A, left <= 8'd169)
  `TC_ASSERT_NEXT(UartRxProgress_A, in_char && tick, left < $past(left))
  `TC_ASSERT_NEXT(UartRxKeepsPlace_A, in_char && !tick, left == $past(left))
`endif

endmodule
