// SPDX-License-Identifier: Apache-2.0
// `meltstage conformal ...`: from a tool path to a probe program, from its touches to a print program.
// Reference: docs/motion/conformal.md.
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace meltstage::app {

// Adds the subcommand; what it returns carries out what was asked for, once `cli` has parsed it, and returns
// the exit status. Throws UserError for wrong input.
std::function<int()> add_conformal_command(CLI::App& cli);

}  // namespace meltstage::app
