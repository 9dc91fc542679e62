// SPDX-License-Identifier: Apache-2.0
// `meltstage chip ...`: the virtual chip for Modbus masters, and the driver's commands for a chip, virtual or
// real.
#pragma once

#include <functional>
#include <string>

namespace CLI {
class App;
}

namespace meltstage::app {

// Adds the subcommand; what it returns carries out what was asked for, once `cli` has parsed it, and returns
// the exit status. Throws UserError for wrong input, UserError for a wrong register, value or port.
std::function<int()> add_chip_command(CLI::App& cli, const std::string& command_line);

}  // namespace meltstage::app
