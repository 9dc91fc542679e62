// SPDX-License-Identifier: Apache-2.0
// The verbs of the `meltstage` programs. Each adds its subcommand to the command line and returns what
// carries it out; that throws UserError for wrong input and returns the exit status: 0 good, 1 the job's own
// verdict is bad. `typed` is the whole command line, for reports.
#pragma once

#include <string>

#include "app/command_line.hpp"

namespace meltstage::app {

Action add_print_command(CLI::App& cli, const std::string& typed);
Action add_chip_command(CLI::App& cli, const std::string& typed);
Action add_report_command(CLI::App& cli, const std::string& typed);
Action add_windows_command(CLI::App& cli, const std::string& typed);
Action add_window_command(CLI::App& cli, const std::string& typed);
Action add_init_command(CLI::App& cli, const std::string& typed);
Action add_coordinates_command(CLI::App& cli, const std::string& typed);
Action add_doctor_command(CLI::App& cli, const std::string& typed);
Action add_gcode_command(CLI::App& cli, const std::string& typed);
Action add_accuracy_command(CLI::App& cli, const std::string& typed);
Action add_conformal_command(CLI::App& cli, const std::string& typed);
Action add_dft_command(CLI::App& cli, const std::string& typed);
Action add_hls_command(CLI::App& cli, const std::string& typed);
Action add_live_command(CLI::App& cli, const std::string& typed);
Action add_page_command(CLI::App& cli, const std::string& typed);
Action add_regress_command(CLI::App& cli, const std::string& typed);
Action add_bench_command(CLI::App& cli, const std::string& typed);

}  // namespace meltstage::app
