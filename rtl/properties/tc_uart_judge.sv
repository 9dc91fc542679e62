// SPDX-License-Identifier: Apache-2.0
// An independent judge of received frames, for assertions alone (P9, P10): keeps the frame's first bytes as they came
// and computes the CRC bit by bit. Absent in synthesis. It follows the framing only in where a frame begins: with the
// first character after open_i was low.

`ifndef SYNTHESIS
module tc_uart_judge (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic       resumed_i,       // a bench has written flops: nothing is known till the next frame begins
  input  logic [7:0] address_i,
  input  logic       valid_i,
  input  logic [7:0] data_i,
  input  logic       error_i,
  input  logic       in_hand_i,      // a command waits or an answer is being sent: characters are not for a new command
  input  logic       open_i,         // characters of a frame not yet judged
  output logic       known_o,
  output logic [8:0] bytes_o,        // characters so far, 257: more than 256
  output logic       sound_o,        // 4 to 256 characters, none bad, CRC right, for this slave or all
  output logic       busy_o,         // one of them came while in_hand_i
  output logic       stop_o,         // the first six are those of a STOP
  output logic [15:0] crc_o
);

  logic        known, error, busy, ours;
  logic [8:0]  bytes;                // 257: more than 256
  logic [15:0] crc, crc_from, crc_next;
  logic [39:0] head;                 // the five bytes after the address, the first in the top byte

  assign crc_from = open_i ? crc : 16'hFFFF;
  always_comb begin
    crc_next = crc_from;
    for (int i = 0; i < 8; i++) begin
      crc_next = {1'b0, crc_next[15:1]} ^ ((crc_next[0] ^ data_i[i]) ? 16'hA001 : 16'h0000);
    end
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      known <= 1'b1;
      error <= 1'b0;
      busy  <= 1'b0;
      ours  <= 1'b0;
      bytes <= 9'd0;
      crc   <= 16'hFFFF;
      head  <= 40'd0;
    end else begin
      if (resumed_i) known <= 1'b0;
      else if (!open_i) known <= 1'b1;
      if (valid_i) begin
        error <= error_i || (open_i && error);
        busy  <= in_hand_i || (open_i && busy);
        crc   <= crc_next;
        if (!open_i) begin
          ours  <= data_i == address_i || data_i == 8'd0;
          bytes <= 9'd1;
          head  <= 40'd0;
        end else begin
          if (bytes != 9'd257) bytes <= bytes + 9'd1;
          if (bytes <= 9'd5) head <= {head[31:0], data_i};
        end
      end
    end
  end

  // As many bytes of a STOP after the address as there are.
  logic [39:0] wanted;
  always_comb begin
    wanted = {8'h06, tc_pkg::HoldingBase, 16'h0000};
    if (bytes < 9'd6) wanted = wanted >> {6'd6 - bytes[5:0], 3'd0};
  end

  assign known_o = known;
  assign bytes_o = open_i ? bytes : 9'd0;
  assign sound_o = open_i && crc == 16'd0 && bytes >= 9'd4 && bytes <= 9'd256 && !error && ours;
  assign busy_o  = open_i && busy;
  assign stop_o  = open_i && ours && head == wanted;
  assign crc_o   = crc_from;

endmodule
`endif
