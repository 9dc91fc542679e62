// SPDX-License-Identifier: Apache-2.0
// Pins of the two vendor cells of fpga/slx45/board_top.sv, for lint.
/* verilator lint_off DECLFILENAME */
/* verilator lint_off UNUSED */
module DCM_CLKGEN #(parameter integer CLKFX_MULTIPLY = 4, parameter integer CLKFX_DIVIDE = 1, parameter real CLKIN_PERIOD = 0.0) (
  input CLKIN, input RST, input FREEZEDCM, input PROGCLK, input PROGDATA, input PROGEN,
  output CLKFX, output CLKFX180, output CLKFXDV, output LOCKED, output PROGDONE, output [2:1] STATUS
);
  assign CLKFX = CLKIN;
  assign CLKFX180 = !CLKIN;
  assign CLKFXDV = CLKIN;
  assign LOCKED = !RST;
  assign PROGDONE = 1'b0;
  assign STATUS = 2'b00;
endmodule
module BUFG (input I, output O);
  assign O = I;
endmodule
