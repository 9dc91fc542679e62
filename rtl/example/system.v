// SPDX-License-Identifier: Apache-2.0
// The chip in a system of one's own: a UART master asks for the temperature, a sensor answers on SPI, nothing heats.
module system (
  input  wire       clk,     // 12 MHz
  input  wire       rst_n,
  output wire       heater,
  output wire       answer_valid,
  output wire [7:0] answer
);
  wire request, reply, sclk, cs_n;
  reg  [31:0] sensor;        // a MAX31855 at 215.25 degC: 0.25 degC a count, in the upper 14 bits

  always @(negedge sclk or posedge cs_n)
    if (cs_n) sensor <= 861 << 18;
    else sensor <= sensor << 1;

  // Modbus RTU: device 1, function 4, one register from PV (1) on, CRC.
  uart_master #(.Request(64'h01_04_00_01_00_01_60_0A)) u_master (
    .clk(clk), .rst_n(rst_n), .tx(request), .rx(reply), .byte_valid(answer_valid), .byte_data(answer));

  tc_top u_tc (
    .clk_i(clk), .rst_ni(rst_n),
    .uart_rx_i(request), .uart_tx_o(reply), .uart_de_o(), .tlm_tx_o(), .addr_strap_i(3'd0),
    .spi_sclk_o(sclk), .spi_cs_no(cs_n), .spi_mosi_o(), .spi_miso_i(sensor[31]),
    .heater_o(heater), .heater_fb_i(heater), .safe_en_o(), .inhibit_i(1'b0), .drop_i(1'b0),
    .fault_no(), .at_temp_o(), .test_mode_i(1'b0), .scan_en_i(1'b0), .scan_i(8'd0), .scan_o()
  );
endmodule
