// SPDX-License-Identifier: Apache-2.0
// A circuit as model checkers take it, by Yosys.
#pragma once

#include <string>

namespace meltstage::hls {

/// AIGER (binary, with the names of the pins) or BTOR2 (with those of the flops, too) of a module of
/// SystemVerilog. A clock is a step; an asynchronous reset shows its values in the step in which it is low.
/// Throws UserError with what Yosys says.
enum class SolverFormat { kAiger, kBtor2 };
std::string for_solvers(SolverFormat format, const std::string& verilog, const std::string& module);

}  // namespace meltstage::hls
