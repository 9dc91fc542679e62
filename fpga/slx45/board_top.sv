// SPDX-License-Identifier: Apache-2.0
// The chip on a Digilent Atlys (Spartan-6 XC6SLX45, 100 MHz oscillator): clock of 12 MHz, reset while it isn't
// steady, pins of the head's electronics on the Pmod connector, what the chip says on LEDs. Polarities outside are
// the chip's own, but for the reset button.

module board_top (
  input  logic       clk_100mhz_i,
  input  logic       button_reset_ni,
  input  logic       uart_rx_i,
  output logic       uart_tx_o,
  output logic       spi_sclk_o,
  output logic       spi_cs_no,
  output logic       spi_mosi_o,
  input  logic       spi_miso_i,
  output logic       heater_o,
  input  logic       heater_fb_i,
  output logic       safe_en_o,
  input  logic       inhibit_i,
  output logic [7:0] led_o
);
  // 100 MHz x 3 / 25 = 12 MHz.
  /* verilator lint_off PINCONNECTEMPTY */
  logic clk, clk_buffered, locked;
  DCM_CLKGEN #(.CLKFX_MULTIPLY(3), .CLKFX_DIVIDE(25), .CLKIN_PERIOD(10.0)) clock (
    .CLKIN(clk_100mhz_i), .CLKFX(clk), .LOCKED(locked), .RST(1'b0), .FREEZEDCM(1'b0),
    .PROGCLK(1'b0), .PROGDATA(1'b0), .PROGEN(1'b0), .CLKFX180(), .CLKFXDV(), .PROGDONE(), .STATUS()
  );
  /* verilator lint_on PINCONNECTEMPTY */
  BUFG global_clock (.I(clk), .O(clk_buffered));

  // A clock that stops being locked is a clock that isn't known: reset, heater off.
  logic fault_n, at_temp, tlm, de;
  logic [tc_pkg::ScanChains-1:0] scan;
  logic unused;
  assign unused = ^scan;
  tc_top chip (
    .clk_i(clk_buffered), .rst_ni(button_reset_ni && locked), .uart_rx_i, .uart_tx_o, .uart_de_o(de), .tlm_tx_o(tlm),
    .addr_strap_i(3'd0), .spi_sclk_o, .spi_cs_no, .spi_mosi_o, .spi_miso_i,
    .heater_o, .heater_fb_i, .safe_en_o, .inhibit_i,
    .drop_i(1'b0), .fault_no(fault_n), .at_temp_o(at_temp),
    .test_mode_i(1'b0), .scan_en_i(1'b0), .scan_i('0), .scan_o(scan)
  );

  assign led_o = {locked, inhibit_i, tlm, de, safe_en_o, at_temp, heater_o, !fault_n};
endmodule
