// SPDX-License-Identifier: Apache-2.0
// Commands: tc_top with UARTC's framing, SYSCTRL and PARAMC; the receiver says anything at any time, so that a frame takes a few
// clocks and no length of silence matters; the other blocks are cut away. What is proved here holds for every sequence of
// characters, gaps and ticks.
// cut: u_rx u_tlm u_mem u_sensc u_algor u_atune u_quality u_pwmc u_guard
// prove: P02_ClearIsKeyed_A P02_ClearJudged_A P09_StopIsHeard_A P09_StopIsTrue_A P10_[!T]* P13_* P15_CommandEnds_A P15_Judg*
// prove: P15_Begins_A P15_Extracting_A P15_Writing_A UartFrame* Paramc*

module chip_command (
  input logic       clk_i,
  input logic       reset_i,
  input logic       uart_rx_i,
  input logic [2:0] addr_strap_i,
  input logic       spi_miso_i,
  input logic       heater_fb_i,
  input logic       inhibit_i,
  input logic       drop_i,
  input logic       test_mode_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;

  logic uart_tx, uart_de, tlm_tx, spi_sclk, spi_cs_n, spi_mosi, heater, safe_en, fault_n, at_temp;
  logic [tc_pkg::ScanChains-1:0] scan;
  tc_top #(.MsClocks(2)) u_top (
    .clk_i, .rst_ni(started_q && !reset_i), .uart_rx_i, .uart_tx_o(uart_tx), .uart_de_o(uart_de), .tlm_tx_o(tlm_tx),
    .addr_strap_i, .spi_sclk_o(spi_sclk), .spi_cs_no(spi_cs_n), .spi_mosi_o(spi_mosi), .spi_miso_i, .heater_o(heater),
    .heater_fb_i, .safe_en_o(safe_en), .inhibit_i, .drop_i, .fault_no(fault_n), .at_temp_o(at_temp),
    .test_mode_i, .scan_en_i(1'b0), .scan_i('0), .scan_o(scan)
  );

endmodule
