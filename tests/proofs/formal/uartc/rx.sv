// SPDX-License-Identifier: Apache-2.0
// The receiver for every line, baud rate and format: the assertions inside tc_uart_rx (legal states, a character ends after at most
// 169 ticks, silence is never reported during one), and how its outputs belong together. Its measure of silence: silence.sv.
// prove: UartRx* IdleEnds* LowLine* OneClock* CharacterWithout*
`include "tc_assert.svh"

module rx (
  input logic        clk_i,
  input logic [12:0] baud_i,
  input logic [1:0]  format_i,
  input logic        pause_i,
  input logic        rx_i
);

  logic rst_ni;
  initial rst_ni = 1'b0;
  always @(posedge clk_i) rst_ni <= 1'b1;

  logic       valid, error, gap, give_up, idle;
  logic [7:0] data;

  tc_uart_rx dut (
    .clk_i, .rst_ni, .baud_i, .format_i, .pause_i, .rx_i,
    .valid_o(valid), .data_o(data), .error_o(error), .gap_o(gap), .give_up_o(give_up), .idle_o(idle)
  );

  `TC_ASSERT_SETUP
  `TC_ASSERT_IF(IdleEndsEveryFrame_A, idle, gap && give_up)
  `TC_ASSERT_NEXT(LowLineEndsSilence_A, (gap || give_up) && !rx_i, !gap && !give_up && !idle)
  `TC_ASSERT_NEXT(OneClockACharacter_A, valid, !valid)
  `TC_COVER(CharacterWithoutError_C, valid && !error)

endmodule
