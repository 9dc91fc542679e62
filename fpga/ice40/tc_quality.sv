// SPDX-License-Identifier: Apache-2.0
// QUALITY left out, in place of rtl/tc_quality.sv: its registers read 0.

module tc_quality (
  input  logic               clk_i,
  input  logic               rst_ni,
  input  logic               run_i,
  input  logic               sample_i,
  input  logic               tenth_i,
  input  logic signed [15:0] pv_i,
  input  logic signed [15:0] target_i,
  input  logic [15:0]        window_i,
  input  logic               at_temp_i,
  input  logic               heater_i,
  output tc_types_pkg::quality_t quality_o,
  output logic [31:0]        on_time_o
);
  assign {quality_o, on_time_o} = '0;

  logic unused;
  assign unused = ^{clk_i, rst_ni, run_i, sample_i, tenth_i, pv_i, target_i, window_i, at_temp_i, heater_i};
endmodule
