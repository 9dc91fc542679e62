// SPDX-License-Identifier: Apache-2.0
// The chip on an iCE40HX8K-B-EVN breakout board: 12 MHz oscillator, every pin of operation on a header or at the USB
// bridge, what the chip says on LEDs. Straps and test mode are active low outside: open pins are pulled up, and mean
// address 1 and operation. Test mode has a pin so that the packed bitstream can be replayed in test time.

module board_top (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic       uart_rx_i,
  output logic       uart_tx_o,
  output logic       uart_de_o,
  output logic       tlm_tx_o,
  input  logic [2:0] strap_ni,
  output logic       spi_sclk_o,
  output logic       spi_cs_no,
  output logic       spi_mosi_o,
  input  logic       spi_miso_i,
  output logic       heater_o,
  input  logic       heater_fb_i,
  output logic       safe_en_o,
  input  logic       inhibit_i,
  input  logic       drop_i,
  output logic       fault_no,
  output logic       at_temp_o,
  input  logic       test_mode_ni,
  output logic [7:0] led_o
);
  // Flops are 0 when the device has loaded, without a reset: held there until it has counted.
  logic [3:0] since_load_q;
  logic       loaded;
  assign loaded = since_load_q == 4'hF;
  always_ff @(posedge clk_i) if (!loaded) since_load_q <= since_load_q + 4'd1;
  initial since_load_q = 4'd0;

  logic [tc_pkg::ScanChains-1:0] scan;
  logic unused;
  assign unused = ^scan;
  tc_top chip (
    .clk_i, .rst_ni(rst_ni && loaded), .uart_rx_i, .uart_tx_o, .uart_de_o, .tlm_tx_o,
    .addr_strap_i(~strap_ni), .spi_sclk_o, .spi_cs_no,
    .spi_mosi_o, .spi_miso_i, .heater_o, .heater_fb_i, .safe_en_o, .inhibit_i, .drop_i, .fault_no, .at_temp_o,
    .test_mode_i(!test_mode_ni),
    .scan_en_i(1'b0), .scan_i('0), .scan_o(scan)
  );

  assign led_o = {loaded, inhibit_i, tlm_tx_o, uart_de_o, safe_en_o, at_temp_o, heater_o, !fault_no};
endmodule
