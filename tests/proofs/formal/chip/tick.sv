// SPDX-License-Identifier: Apache-2.0
// The control tick: tc_top with SYSCTRL, SENSC and ALGOR, whose products may be anything (tick.map); the other blocks are cut away.
// What is proved here holds for every parameter in every clock, every command and every level on MISO.
// engine: induction
// cut: u_uartc u_paramc u_mem u_atune u_quality u_pwmc u_guard
// prove: P05_SampleIsPrompt_A P11_* P15_TickEnds_A P15_AlgorAnswers_A P15_Displaying_A P15_Comput* P15_Read* SenscReading_A
// prove: SenscStateLegal_A SenscEdgesBounded_A SenscGapCounts_A SenscNoSetUpLeft_A SenscReadBounded_A SenscLeadIdles_A
// prove: SysctrlSensStartInReadTemp_A AlgorStepLegal_A AlgorComputing_A SenscDeselectedClockIdles_A SenscSelect_A
// prove: SenscClockPhase_A

module chip_tick (
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
