// SPDX-License-Identifier: Apache-2.0
// `meltstage chip play`: a scenario on the virtual chip, as the chip's page runs it.
#pragma once

#include <filesystem>

namespace meltstage::app {

// Rows of a tenth of a second that a run keeps.
inline constexpr double kLongestPlay_s = 20'000.0;

struct PlayOptions {
  std::filesystem::path scenario;
  double for_s = 300.0;
  std::filesystem::path out;  // of the trace; empty: standard output
  std::filesystem::path vcd;  // of the pins' waves; empty: none
};

// Writes the trace, and those changes of the pins that a ScriptedRun keeps. Returns 0, or 1 when the chip
// refused or did not answer what the scenario asked without `try`; each is told in a line. Throws UserError
// for a scenario that can't be read, naming its line.
int play_scenario(const PlayOptions& options);

}  // namespace meltstage::app
