// SPDX-License-Identifier: Apache-2.0
// The chip from power-up, its flops unknown: a reset that begins and ends at some phase of the clock. The values behind it go to
// +vcd=FILE. The heater has to be off from the moment the reset is there.
`timescale 1ns / 1ns
module power_up;
  reg clk = 0;
  `include "replay_pins.vh"

  integer phase;
  reg [8*1024-1:0] path;

  always #4 clk = ~clk;

  initial begin
    if (!$value$plusargs("phase=%d", phase) || !$value$plusargs("vcd=%s", path)) begin
      $display("power_up: expected +phase=0..7 and +vcd=FILE");
      $finish;
    end
    rst_ni = 1;
    heater_fb_i = 1;
    #(80 + phase) rst_ni = 0;
    #1 if (dut.heater_o !== 1'b0 || dut.safe_en_o !== 1'b0)
      $display("phase %0d: heater_o %b, safe_en_o %b in reset", phase, dut.heater_o, dut.safe_en_o);
    #21 rst_ni = 1;
    #80;
    $dumpfile(path);
    $dumpvars(0, dut);
    #1 $display("phase %0d: done", phase);
    $finish;
  end
endmodule
