// SPDX-License-Identifier: Apache-2.0
// What receiver and transmitter of the serial lines share (cmodel/uart_line.hpp is the twin).

package tc_uart_pkg;

  // Ticks of a sixteenth bit: an accumulator gains BAUD (baud rate / 100) each clock and wraps at clock / 1600; a wrap
  // is a tick. So their mean rate is exact at every baud rate. Result: {tick, accumulator of the next clock}.
  function automatic logic [13:0] baud_step(input logic [12:0] acc, input logic [12:0] baud);
    logic [13:0] modulus, sum;
    modulus = 14'(tc_pkg::ClkHz / (16 * 100));
    sum     = {1'b0, acc} + {1'b0, baud};
    baud_step = sum < modulus ? sum & 14'h1FFF : (sum - modulus) | 14'h2000;
  endfunction

  function automatic logic has_parity(input logic [1:0] format);
    has_parity = format == tc_pkg::Format8E1 || format == tc_pkg::Format8O1;
  endfunction

  // The bit after the data: parity, or the mark of a stop bit.
  function automatic logic ninth_bit(input logic [1:0] format, input logic [7:0] data);
    unique case (format)
      tc_pkg::Format8E1: ninth_bit = ^data;
      tc_pkg::Format8O1: ninth_bit = ~^data;
      default:           ninth_bit = 1'b1;
    endcase
  endfunction

  // Bits of a character, start and stop bits included.
  function automatic logic [3:0] char_bits(input logic [1:0] format);
    char_bits = format == tc_pkg::Format8N1 ? 4'd10 : 4'd11;
  endfunction

endpackage
