// SPDX-License-Identifier: Apache-2.0
// Assertions, one macro family: immediate, alive in Verilator (--assert), proved in Yosys (-formal), absent in
// synthesis. Use inside a module with clk_i and rst_ni, after `TC_ASSERT_SETUP` once. Signals are sampled before the
// clock edge. past_ok_q is low in the first clock after reset, when a *_NEXT assertion has no past yet; a bench that
// loads flops clears it. Nothing is asserted of the first clock of all, when flops may hold anything.
`ifndef TC_ASSERT_SVH
`define TC_ASSERT_SVH

`ifdef SYNTHESIS
`define TC_ASSERT_SETUP
`define TC_ASSERT(name, prop)
`define TC_ASSERT_IF(name, ante, cons)
`define TC_ASSERT_NEXT(name, ante, cons)
`define TC_ASSERT_RESET(name, prop)
`define TC_COVER(name, prop)
`else
`define TC_ASSERT_SETUP \
  logic past_ok_q; \
  initial past_ok_q = 1'b0; \
  always @(posedge clk_i or negedge rst_ni) begin \
    if (!rst_ni) past_ok_q <= 1'b0; \
    else past_ok_q <= 1'b1; \
  end
// prop holds in every clock out of reset.
`define TC_ASSERT(name, prop) \
  always @(posedge clk_i) if (past_ok_q) begin name: assert (prop); end
// cons holds in every clock in which ante holds; ante is covered.
`define TC_ASSERT_IF(name, ante, cons) \
  always @(posedge clk_i) if (past_ok_q) begin \
    name: assert (!(ante) || (cons)); \
    name``_C: cover (ante); \
  end
// cons holds in the clock after one in which ante held; ante is covered.
`define TC_ASSERT_NEXT(name, ante, cons) \
  logic name``_past_q; \
  always_ff @(posedge clk_i or negedge rst_ni) begin \
    if (!rst_ni) name``_past_q <= 1'b0; \
    else name``_past_q <= (ante); \
  end \
  always @(posedge clk_i) if (past_ok_q) begin \
    name: assert (!name``_past_q || (cons)); \
    name``_C: cover (name``_past_q); \
  end
// prop holds while reset is asserted and in the first clock after it. For modules with a flop resumed_q
// (tc_properties).
`define TC_ASSERT_RESET(name, prop) \
  logic name``_clocked_q; \
  initial name``_clocked_q = 1'b0; \
  always @(posedge clk_i) name``_clocked_q <= 1'b1; \
  always @(posedge clk_i) if (name``_clocked_q && !past_ok_q && !resumed_q) begin \
    name: assert (prop); \
    name``_C: cover (1'b1); \
  end
`define TC_COVER(name, prop) \
  always @(posedge clk_i) if (past_ok_q) begin name: cover (prop); end
`endif

`endif
