// SPDX-License-Identifier: Apache-2.0
// A clock of a Verilated design. Include the headers of the design and of its root (V..., V...___024root)
// before.
#pragma once

namespace meltstage::tb::verilated {

// A rising edge with all that follows. Nothing happens at the falling one: Verilator 5.006 is told of it,
// which saves an evaluation of all that depends on pins. Other versions keep the last level elsewhere.
template <class Top>
void rising_edge(Top& top) {
  if constexpr (requires { top.rootp->__Vtrigrprev__TOP__clk_i; }) {
    top.rootp->__Vtrigrprev__TOP__clk_i = 0;
  } else {
    top.clk_i = 0;
    top.eval();
  }
  top.clk_i = 1;
  top.eval();
}

}  // namespace meltstage::tb::verilated
