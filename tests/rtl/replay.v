// SPDX-License-Identifier: Apache-2.0
// A recording of the model's pins (recording.hpp) on the netlist. An x or z on an output is a mismatch.
`timescale 1ns / 1ns
module replay;
  reg clk = 0;
  reg [8:0] in = 0;
  reg [9:0] expected;
  wire [9:0] out;
  tc_top dut (
    .clk_i(clk), .rst_ni(in[0]), .uart_rx_i(in[1]), .addr_strap_i(in[4:2]), .spi_miso_i(in[5]), .heater_fb_i(in[6]),
    .inhibit_i(in[7]), .drop_i(in[8]),
    .uart_tx_o(out[0]), .uart_de_o(out[1]), .tlm_tx_o(out[2]), .spi_sclk_o(out[3]), .spi_cs_no(out[4]), .spi_mosi_o(out[5]),
    .heater_o(out[6]), .safe_en_o(out[7]), .fault_no(out[8]), .at_temp_o(out[9]),
    .test_mode_i(1'b0), .scan_en_i(1'b0), .scan_i(8'd0), .scan_o()
  );

  integer file, left, clocks, mismatches;
  reg [8*1024-1:0] path;
  initial begin
    clocks = 0;
    mismatches = 0;
    if (!$value$plusargs("recording=%s", path)) begin
      $display("replay: expected +recording=FILE");
      $finish;
    end
    file = $fopen(path, "r");
    #1;
    while ($fscanf(file, "%d %b %b\n", left, in, expected) == 3) begin
      while (left > 0) begin
        left = left - 1;
        #1 clk = 1;
        #1 clk = 0;
        #1 clocks = clocks + 1;
        if (out !== expected) begin
          mismatches = mismatches + 1;
          if (mismatches <= 10) $display("clock %0d: netlist %b, model %b", clocks - 1, out, expected);
        end
      end
    end
    if (clocks == 0) $display("replay: nothing was compared");
    else $display("%0d clocks, %0d mismatches", clocks, mismatches);
    $finish;
  end
endmodule
