// SPDX-License-Identifier: Apache-2.0
// Heater off: tc_top with everything but GUARD cut away, so that parameters, samples, duty, pulses, commands and states are free in
// every clock; reset at any time. What is proved holds whatever the other blocks do.
// cut: u_uartc u_sysctrl u_paramc u_mem u_sensc u_algor u_atune u_quality u_pwmc
// prove: P01_* P02_FaultIsOff_A P02_CauseIsFault_A P02_BrokenIsOff_A P02_InhibitIsOff_A P02_FaultStays_A P02_RunNeedsCommand_A
// prove: P03_* P04_* P05_Hot* P06_* P07_HeaterIsPulse_A P09_StopIsOff_A P17_* P18_*
// prove: GuardFault* GuardCause* GuardHot*_A GuardDead* GuardHold* GuardHeat* GuardStop* GuardInhibit* GuardFirst* GuardNo*

module chip_off (
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
  tc_top u_top (
    .clk_i, .rst_ni(started_q && !reset_i), .uart_rx_i, .uart_tx_o(uart_tx), .uart_de_o(uart_de), .tlm_tx_o(tlm_tx),
    .addr_strap_i, .spi_sclk_o(spi_sclk), .spi_cs_no(spi_cs_n), .spi_mosi_o(spi_mosi), .spi_miso_i, .heater_o(heater),
    .heater_fb_i, .safe_en_o(safe_en), .inhibit_i, .drop_i, .fault_no(fault_n), .at_temp_o(at_temp),
    .test_mode_i, .scan_en_i(1'b0), .scan_i('0), .scan_o(scan)
  );

  // P1 again, without a clock: reset at the pin means off at the pins.
  always_comb begin
    P01_ResetPinIsOff_A: assert (started_q && !reset_i || !heater && !safe_en);
  end

endmodule
