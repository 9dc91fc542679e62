// SPDX-License-Identifier: Apache-2.0
// rtl/tc_algor.sv as functions of named words, from the SMT-LIB 2 file that Yosys writes of it (prove.sh).
#pragma once

#include <z3++.h>

#include <string>
#include <vector>

#include "kernel_side.hpp"

namespace meltstage::proof {

struct RtlSide {
  Words<z3::expr>
      before;  // flops, pins and parameters: each flop a free constant, inputs made of free constants
  Words<z3::expr> after;     // next flops with reset high; outputs of the state before the clock
  Words<z3::expr> in_reset;  // what each flop reads while reset is low, and in the first clock after it
};

// Throws std::runtime_error, in one line, where flops or outputs of the file are not those of the kernel, or
// a flop is not free.
RtlSide load_rtl(const std::string& path, const std::vector<FlopWord>& flops);

}  // namespace meltstage::proof
