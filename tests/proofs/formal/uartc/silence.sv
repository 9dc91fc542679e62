// SPDX-License-Identifier: Apache-2.0
// The receiver's measure of silence (P14), for every line and format and every rate that BAUD can hold, changed in any clock.
// engine: abc-induction
// prove: P14_GapIsSilence_A P14_UnitsAreTicks_A P14_SilenceFalls_A UartRxStateLegal_A UartRxSilenceLegal_A

module silence (
  input logic        clk_i,
  input logic [12:0] baud_i,
  input logic [1:0]  format_i,
  input logic        pause_i,
  input logic        rx_i
);

  logic rst_ni;
  initial rst_ni = 1'b0;
  always @(posedge clk_i) rst_ni <= 1'b1;

  always_comb assume (baud_i <= tc_pkg::reg_max(tc_pkg::RegBaud));   // PARAMC lets no more through

  logic       valid, error, gap, give_up, idle;
  logic [7:0] data;
  tc_uart_rx dut (
    .clk_i, .rst_ni, .baud_i, .format_i, .pause_i, .rx_i,
    .valid_o(valid), .data_o(data), .error_o(error), .gap_o(gap), .give_up_o(give_up), .idle_o(idle)
  );

endmodule
