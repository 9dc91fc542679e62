// SPDX-License-Identifier: Apache-2.0
// The transmitter's lead (P14), for all bytes and formats and every rate that BAUD can hold, changed in any clock.
// engine: induction
// prove: P14_Lead* UartTxIdleIsMark_A UartTxBitsLegal_A

module lead (
  input logic        clk_i,
  input logic [12:0] baud_i,
  input logic [1:0]  format_i,
  input logic        valid_i,
  input logic [7:0]  data_i,
  input logic        last_i
);

  logic rst_ni;
  initial rst_ni = 1'b0;
  always @(posedge clk_i) rst_ni <= 1'b1;

  always_comb assume (baud_i <= tc_pkg::reg_max(tc_pkg::RegBaud));   // PARAMC lets no more through

  logic take, busy, tx;
  tc_uart_tx dut (.clk_i, .rst_ni, .baud_i, .format_i, .valid_i, .data_i, .last_i, .take_o(take), .busy_o(busy), .tx_o(tx));

endmodule
