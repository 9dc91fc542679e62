// SPDX-License-Identifier: Apache-2.0
// Options of `meltstage windows` that other verbs share.
#pragma once

#include "app/windows/windows.hpp"

namespace CLI {
class App;
}

namespace meltstage::app {

/// Who checks the windows.
void add_runner_options(CLI::App* command, RunWindowsSettings& settings, bool& slurm);
/// Where a run is cut into windows.
void add_border_options(CLI::App* command, tb::WindowBorders& borders);

}  // namespace meltstage::app
