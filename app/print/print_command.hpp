// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/command_line.hpp"
#include "app/print/print.hpp"

namespace meltstage::app {

/// `print` with `align` for jobs with [alignment]; without it such a job goes on in the program that has it.
Action add_print_command_with(CLI::App& cli, const std::string& typed, BoardAligner align);

}  // namespace meltstage::app
