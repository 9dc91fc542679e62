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

  // Register FORMAT.
  localparam logic [1:0] Format8E1 = 2'd0;
  localparam logic [1:0] Format8O1 = 2'd1;
  localparam logic [1:0] Format8N2 = 2'd2;
  localparam logic [1:0] Format8N1 = 2'd3;

  function automatic logic has_parity(input logic [1:0] format);
    has_parity = format == Format8E1 || format == Format8O1;
  endfunction

  // The bit after the data: parity, or the mark of a stop bit.
  function automatic logic ninth_bit(input logic [1:0] format, input logic [7:0] data);
    case (format)
      Format8E1: ninth_bit = ^data;
      Format8O1: ninth_bit = ~^data;
      default:   ninth_bit = 1'b1;
    endcase
  endfunction

  // Bits of a character, start and stop bits included.
  function automatic logic [3:0] char_bits(input logic [1:0] format);
    char_bits = format == Format8N1 ? 4'd10 : 4'd11;
  endfunction

  localparam logic [7:0] BroadcastAddress = 8'd0;

  // Modbus function codes that the serial port itself knows.
  localparam logic [7:0] FcReadInput = 8'h04;
  localparam logic [7:0] FcWriteSingle = 8'h06;

  // Kinds of answer, from PARAMC.
  localparam logic [2:0] RspNone = 3'd0;
  localparam logic [2:0] RspException = 3'd1;
  localparam logic [2:0] RspRead = 3'd2;
  localparam logic [2:0] RspEcho = 3'd3;
  localparam logic [2:0] RspServerId = 3'd4;
  localparam logic [2:0] RspIdStream = 3'd5;
  localparam logic [2:0] RspIdObject = 3'd6;

endpackage
