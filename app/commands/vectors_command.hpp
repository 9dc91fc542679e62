// SPDX-License-Identifier: Apache-2.0
// `meltstage vectors ...`: scan, test patterns, grading, proofs, lint, replay for any flat Yosys netlist.
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace meltstage::app {

// Adds the subcommand; what it returns carries out what was asked for, once `cli` has parsed it, and returns
// the exit status: 0 good, 1 a verdict is bad (a mismatch, a breach of a rule, an aborted fault). Throws
// UserError and dft::StilError for wrong input.
std::function<int()> add_vectors_command(CLI::App& cli);

}  // namespace meltstage::app
