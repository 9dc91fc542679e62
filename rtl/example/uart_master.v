// SPDX-License-Identifier: Apache-2.0
// A UART master as a system may have it: sends the request after reset and again every so often, and hands on the bytes that come
// back. 8 data bits, even parity, 1 stop bit. It knows nothing of the chip. ClocksPerBit is 4 to 65,536.
module uart_master #(
  parameter ClocksPerBit = 104,
  parameter PeriodClocks = 1_300_000,
  parameter RequestBytes = 8,
  parameter [8*RequestBytes-1:0] Request = 0   // first byte on the left
) (
  input  wire       clk,
  input  wire       rst_n,
  output wire       tx,
  input  wire       rx,
  output reg        byte_valid,
  output reg  [7:0] byte_data
);

  reg [8*RequestBytes-1:0] to_send;
  reg [31:0] period_clocks;
  reg [7:0]  bytes_left;
  reg [15:0] tx_clocks, rx_clocks;
  reg [3:0]  tx_bits, rx_bits;
  reg [10:0] tx_frame;                         // stop, parity, data, start
  reg [9:0]  rx_frame;                         // parity, data, start
  wire [7:0] next_byte = to_send[8*RequestBytes-1-:8];
  assign tx = tx_frame[0];

  always @(posedge clk or negedge rst_n)
    if (!rst_n) begin
      to_send       <= Request;
      bytes_left    <= RequestBytes;
      tx_frame      <= 11'h7FF;
      tx_bits       <= 0;
      tx_clocks     <= 0;
      period_clocks <= PeriodClocks;
    end else if (period_clocks == 0) begin
      period_clocks <= PeriodClocks;
      to_send       <= Request;
      bytes_left    <= RequestBytes;
    end else begin
      period_clocks <= period_clocks - 32'd1;
      if (tx_clocks != 0) tx_clocks <= tx_clocks - 16'd1;
      else if (tx_bits != 0) begin
        tx_frame  <= {1'b1, tx_frame[10:1]};
        tx_bits   <= tx_bits - 4'd1;
        tx_clocks <= ClocksPerBit - 1;
      end else if (bytes_left != 0) begin
        tx_frame   <= {1'b1, ^next_byte, next_byte, 1'b0};
        tx_bits    <= 4'd10;
        tx_clocks  <= ClocksPerBit - 1;
        to_send    <= to_send << 8;
        bytes_left <= bytes_left - 8'd1;
      end
    end

  always @(posedge clk or negedge rst_n)
    if (!rst_n) begin
      rx_bits    <= 0;
      rx_clocks  <= 0;
      rx_frame   <= 0;
      byte_valid <= 0;
      byte_data  <= 0;
    end else begin
      byte_valid <= 0;
      if (rx_clocks != 0) rx_clocks <= rx_clocks - 16'd1;
      else if (rx_bits == 0) begin
        if (!rx) begin                         // the middle of the start bit is next
          rx_bits   <= 4'd11;
          rx_clocks <= ClocksPerBit / 2 - 1;
        end
      end else begin
        rx_frame  <= {rx, rx_frame[9:1]};
        rx_bits   <= rx_bits - 4'd1;
        rx_clocks <= rx_bits == 4'd1 ? 16'd0 : ClocksPerBit - 1;
        if (rx_bits == 4'd1 && rx && ^rx_frame[9:1] == 1'b0) begin
          byte_valid <= 1;
          byte_data  <= rx_frame[8:1];
        end
      end
    end

endmodule
