// SPDX-License-Identifier: Apache-2.0
// `dft tester` and `dft diagnose`: from a defect to a fail log, and back.
#pragma once

#include "app/command_line.hpp"

namespace meltstage::app {

/// Adds the subcommand to `dft`; what carries it out.
Action add_tester_command(CLI::App& dft);
Action add_diagnose_command(CLI::App& dft);

}  // namespace meltstage::app
