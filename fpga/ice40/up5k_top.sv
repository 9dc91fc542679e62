// SPDX-License-Identifier: Apache-2.0
// The chip on an iCE40UP5K-B-EVN breakout board: as board_top.sv, with the board's one three-coloured LED, whose pins light when low.

module up5k_top (
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
  output logic       red_no,           // fault latched
  output logic       green_no,         // heating permitted
  output logic       blue_no           // heater output
);
  logic [7:0] led, unused;
  board_top board (
    .clk_i, .rst_ni, .uart_rx_i, .uart_tx_o, .uart_de_o, .tlm_tx_o, .strap_ni, .spi_sclk_o, .spi_cs_no, .spi_mosi_o, .spi_miso_i,
    .heater_o, .heater_fb_i, .safe_en_o, .inhibit_i, .drop_i, .fault_no, .at_temp_o, .test_mode_ni, .led_o(led)
  );
  assign unused   = led;
  assign red_no   = !led[0];
  assign green_no = !led[3];
  assign blue_no  = !led[1];
endmodule
