// SPDX-License-Identifier: Apache-2.0
// For proofs alone: a detector of tc_guard acts in the very clock in which its condition has lasted its time, neither
// earlier nor later. The time is counted here once more, beyond the detector's own counter.
`include "tc_assert.svh"

`ifdef FORMAL
module tc_guard_times (
  input logic        clk_i,
  input logic        rst_ni,
  input logic        tick_i,    // of the time: 0.1 s
  input logic        lasts_i,   // the condition: time passes
  input logic        judged_i,  // it is so in this clock
  input logic [15:0] limit_i,   // the time, in ticks
  input logic [15:0] count_i,   // the detector's counter
  input logic        due_i      // the detector acts
);

  `TC_ASSERT_SETUP

  logic [16:0] lasted_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) lasted_q <= 17'd0;
    else if (!lasts_i) lasted_q <= 17'd0;
    else if (tick_i && !lasted_q[16]) lasted_q <= lasted_q + 17'd1;
  end

  // In time: no tick late,
  `TC_ASSERT_IF(GuardDueInTime_A, judged_i && lasted_q >= {1'b0, limit_i}, due_i)
  // nor early.
  `TC_ASSERT_IF(GuardDueNotBefore_A, !judged_i || lasted_q < {1'b0, limit_i}, !due_i)
  // The counter stops at its top.
  `TC_ASSERT(GuardCounts_A, {1'b0, count_i} == (lasted_q[16] ? 17'h0FFFF : lasted_q))

endmodule
`endif
