// SPDX-License-Identifier: Apache-2.0
// Arithmetic that RTL and model share by name (cmodel/math.hpp is the twin).

package tc_math_pkg;

  // Narrowing to 16 bits signed with saturation.
  function automatic logic [15:0] sat_s16(input logic signed [39:0] x);
    if (x[39:15] == {25{x[39]}}) sat_s16 = x[15:0];
    else sat_s16 = x[39] ? 16'h8000 : 16'h7FFF;
  endfunction

  // Narrowing to a duty, UQ1.16 clamped to 0 .. 65536.
  function automatic logic [16:0] sat_duty(input logic signed [39:0] x);
    if (x[39]) sat_duty = 17'd0;
    else if (x[38:16] != 23'd0) sat_duty = 17'd65536;
    else sat_duty = {1'b0, x[15:0]};
  endfunction

  // Check bits of the (22,16) Hsiao code.
  function automatic logic [5:0] secded_check(input logic [15:0] data);
    secded_check = {^(data & tc_pkg::SecdedRow5), ^(data & tc_pkg::SecdedRow4), ^(data & tc_pkg::SecdedRow3),
                    ^(data & tc_pkg::SecdedRow2), ^(data & tc_pkg::SecdedRow1), ^(data & tc_pkg::SecdedRow0)};
  endfunction

  // Code word: check bits above the data, an even number of ones in all.
  function automatic logic [21:0] secded_encode(input logic [15:0] data);
    secded_encode = {secded_check(data), data};
  endfunction

  // Wrong bit of a code word (one bit set); zero when the word is clean or can not be corrected.
  function automatic logic [21:0] secded_flip(input logic [21:0] code);
    logic [5:0] syndrome;
    syndrome = secded_check(code[15:0]) ^ code[21:16];
    secded_flip = 22'd0;
    if (syndrome != 6'd0) begin
      for (int i = 0; i < 16; i++) secded_flip[i] = syndrome == secded_check(16'd1 << i);
      for (int i = 0; i < 6; i++) secded_flip[16+i] = syndrome == (6'd1 << i);
    end
  endfunction

  // Row of MEM: a register's word as stored, check bits above the data, an even number of ones in all. Of the check
  // bits a register has one, those that are corrected on the way out all six.
  function automatic logic [21:0] mem_row(input logic corrected, input logic [15:0] data);
    mem_row = corrected ? secded_encode(data) : {5'd0, ^data, data};
  endfunction

  // Modbus CRC-16 (reflected 0x8005) of one more byte.
  function automatic logic [15:0] crc16_byte(input logic [15:0] crc, input logic [7:0] data);
    logic [15:0] c;
    c = crc ^ {8'h00, data};
    for (int i = 0; i < 8; i++) c = c[0] ? ((c >> 1) ^ 16'hA001) : (c >> 1);
    crc16_byte = c;
  endfunction

endpackage
