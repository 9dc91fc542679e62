// SPDX-License-Identifier: Apache-2.0
// Each adds its subcommand to `dft` and returns what carries it out.
#pragma once

#include "app/command_line.hpp"

namespace meltstage::app {

Action add_generate_command(CLI::App& dft);
Action add_scan_command(CLI::App& dft);
Action add_rules_command(CLI::App& dft);
Action add_grade_command(CLI::App& dft);
Action add_functional_command(CLI::App& dft);
Action add_lint_command(CLI::App& dft);
Action add_replay_command(CLI::App& dft);
Action add_prove_command(CLI::App& dft);
Action add_check_proof_command(CLI::App& dft);
Action add_iddq_command(CLI::App& dft);
// From a defect to a fail log, and back.
Action add_tester_command(CLI::App& dft);
Action add_diagnose_command(CLI::App& dft);

}  // namespace meltstage::app
