// SPDX-License-Identifier: Apache-2.0
// ATUNE left out, in place of rtl/tc_atune.sv where its gains would have nowhere to go: the Tune command has no
// effect.

module tc_atune (
  input  logic               clk_i,
  input  logic               rst_ni,
  input  logic               tune_i,
  input  logic               run_i,
  input  logic               sample_i,
  input  logic               tenth_i,
  input  logic               commit_i,
  input  logic signed [15:0] pv_i,
  input  logic signed [15:0] sp_work_i,
  input  logic signed [15:0] amb_i,
  input  logic               ramping_i,
  input  logic [16:0]        duty_max_i,
  input  logic [15:0]        window_i,
  output logic               tuning_o,
  output logic [16:0]        duty_o,
  output logic [16:0]        hold_o,
  output logic               stop_o,
  output logic               parity_o,
  output logic               still_o,
  output logic               wr_o,
  output logic [5:0]         wr_index_o,
  output logic [15:0]        wr_data_o,
  output tc_types_pkg::tuned_t tuned_o
);
  assign still_o = 1'b1;
  assign {tuning_o, duty_o, hold_o, stop_o, parity_o, wr_o, wr_index_o, wr_data_o, tuned_o} = '0;

  logic unused;
  assign unused = ^{clk_i, rst_ni, tune_i, run_i, sample_i, tenth_i, commit_i, pv_i, sp_work_i,
                    amb_i, ramping_i, duty_max_i, window_i};
endmodule
