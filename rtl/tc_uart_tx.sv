// SPDX-License-Identifier: Apache-2.0
// Serial transmitter of whole Modbus frames: the bytes offered to it, then their CRC.
//
// A frame starts when valid_i is high while busy_o is low: three bit times of mark, then the characters without a gap:
// driver enable leads the first start bit, and what the receiver's gap_o came early is made up for. data_i is taken at
// each character's start and take_o pulses in the next clock; the next byte must then stand before the character ends
// (at least 160 clocks). With the byte taken under last_i the CRC follows by itself, low byte first. busy_o: from the
// lead to the end of the last stop bit. baud_i, format_i change only while busy_o is low.
`include "tc_assert.svh"

module tc_uart_tx (
  input  logic        clk_i,
  input  logic        rst_ni,
  input  logic [12:0] baud_i,
  input  logic [1:0]  format_i,
  input  logic        valid_i,
  input  logic [7:0]  data_i,
  input  logic        last_i,
  output logic        take_o,
  output logic        busy_o,
  output logic        tx_o
);

  // What follows the character being sent.
  typedef enum logic [1:0] {
    NextData    = 2'd0,
    NextCrcLow  = 2'd1,
    NextCrcHigh = 2'd2,
    NextEnd     = 2'd3
  } next_e;

  localparam logic [10:0] Mark = 11'h7FF;
  localparam logic [3:0]  LeadBits = 4'd3;

  logic        busy_q;    // a frame is being sent, its lead included
  logic [12:0] acc_q;     // accumulator of the baud rate (tc_uart_pkg)
  logic [3:0]  tick_q;    // sixteenths of the bit gone by
  logic [3:0]  bits_q;    // bits of this character after the one on the line
  logic [10:0] shift_q;   // bit 0 is on the line
  next_e       next_q;
  logic [15:0] crc_q;     // of the bytes taken so far
  logic        take_q;    // data_i was taken in the clock before

  assign tx_o   = shift_q[0];
  assign busy_o = busy_q;
  assign take_o = take_q;

  logic [12:0] acc_next;
  logic tick, bit_end, char_end;
  assign {tick, acc_next} = tc_uart_pkg::baud_step(acc_q, baud_i);
  assign bit_end  = tick && tick_q == 4'd15;
  assign char_end = bit_end && bits_q == 4'd0;

  logic [7:0] byte_now;
  always_comb begin
    unique case (next_q)
      NextCrcLow:  byte_now = crc_q[7:0];
      NextCrcHigh: byte_now = crc_q[15:8];
      default:     byte_now = data_i;
    endcase
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      busy_q  <= 1'b0;
      acc_q   <= 13'd0;
      tick_q  <= 4'd0;
      bits_q  <= 4'd0;
      shift_q <= Mark;
      next_q  <= NextData;
      crc_q   <= 16'hFFFF;
      take_q  <= 1'b0;
    end else begin
      take_q <= 1'b0;
      if (!busy_q) begin
        if (valid_i) begin
          busy_q <= 1'b1;
          acc_q  <= 13'd0;
          tick_q <= 4'd0;
          bits_q <= LeadBits - 4'd1;
          next_q <= NextData;
          crc_q  <= 16'hFFFF;
        end
      end else begin
        acc_q <= acc_next;
        if (tick) tick_q <= tick_q + 4'd1;
        if (char_end) begin
          bits_q  <= tc_uart_pkg::char_bits(format_i) - 4'd1;
          shift_q <= {1'b1, tc_uart_pkg::ninth_bit(format_i, byte_now), byte_now, 1'b0};
          unique case (next_q)
            NextData: begin
              take_q <= 1'b1;
              crc_q  <= tc_math_pkg::crc16_byte(crc_q, data_i);
              if (last_i) next_q <= NextCrcLow;
            end
            NextCrcLow:  next_q <= NextCrcHigh;
            NextCrcHigh: next_q <= NextEnd;
            default: begin   // NextEnd
              busy_q  <= 1'b0;
              shift_q <= Mark;
            end
          endcase
        end else if (bit_end) begin
          bits_q  <= bits_q - 4'd1;
          shift_q <= {1'b1, shift_q[10:1]};
        end
      end
    end
  end

  `TC_ASSERT_SETUP
  `TC_ASSERT_IF(UartTxIdleIsMark_A, !busy_q, shift_q == Mark)
  `TC_ASSERT(UartTxBitsLegal_A, bits_q <= 4'd10)
  `TC_ASSERT_NEXT(UartTxLevelHeldThroughABit_A, busy_q && !bit_end, tx_o == $past(tx_o) && busy_o)
  `TC_ASSERT(UartTxTakesOnlyInAFrame_A, busy_o || !take_o)
  // The next byte is there long before it is needed: a few clocks into the character before it. (No cover: no proof
  // reaches a frame's fourth byte; every lockstep run with telemetry does.)
  `TC_ASSERT(UartTxByteInTime_A, !busy_q || next_q != NextData || valid_i || (bits_q >= 4'd9 && tick_q <= 4'd7))

`ifndef SYNTHESIS
  // P14: the lead counted the long-hand way: a bit has 120000 units, a clock baud_i.
  localparam logic [18:0] TickUnits = 19'(tc_pkg::ClkHz / 1600);
  logic        resumed_q;                   // set by a bench that loads flops
  logic [18:0] missing;                     // of three bits since the frame began
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      resumed_q <= 1'b0;
      missing   <= 19'd0;
    end else begin
      resumed_q <= 1'b0;
      if (!busy_q && valid_i) missing <= 19'd48 * TickUnits;
      else if (resumed_q) missing <= 19'd0;
      else missing <= missing > 19'(baud_i) ? missing - 19'(baud_i) : 19'd0;
    end
  end
  // P14: the first start bit comes three bits after the frame began, so with the gap before (P14_GapIsSilence_A in
  // tc_uart_rx) 3.5 characters and nearly half a bit after the last stop bit.
  `TC_ASSERT_IF(P14_LeadIsThreeBits_A, !tx_o, missing == 19'd0)
`ifdef FORMAL
  // What leads there.
  logic leading;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) leading <= 1'b0;
    else leading <= busy_q ? leading && !char_end : valid_i;
  end
  `TC_ASSERT(P14_LeadFalls_A, acc_q < TickUnits[12:0] &&
             (missing == 19'd0 || (leading && busy_q && shift_q == Mark && bits_q <= 4'd2 &&
                                   {1'b0, missing} + 20'(acc_q) <=
                                   20'({bits_q[1:0], 4'd0} + 6'd16 - {2'd0, tick_q}) * 20'(TickUnits))))
`endif
`endif

endmodule
