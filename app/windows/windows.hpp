// SPDX-License-Identifier: Apache-2.0
// `meltstage windows ...` and `meltstage window`: time-parallel lockstep of a recorded run. Reference:
// docs/verify/windows.md.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "tb/windows/window_plan.hpp"
#include "tb/windows/windows.hpp"

namespace meltstage::app {

enum class WindowRunner { here, slurm };

struct RunWindowsSettings {
  WindowRunner runner = WindowRunner::here;
  unsigned processes = 0;  // on this machine; 0: one for each core
  unsigned attempts = 3;   // for each window
};

struct CheckedRun {
  tb::JoinedWindows joined;
  tb::WindowPlan plan;
  std::string workers;
  std::vector<std::string> notes;  // lost workers
  std::size_t kept = 0;            // windows whose results lay there already
  double wall_s = 0.0;
};

// Checks every window of a work folder that has no result yet and joins all results. Throws UserError
// when the folder can't be used, Interrupted on a signal; results so far stay.
CheckedRun check_run(const std::filesystem::path& folder, const RunWindowsSettings& settings);
// "12 of 12 windows equal, ..." in one line, and what is wrong in the lines behind it.
std::string describe(const CheckedRun& run);

// The commands; they return the exit status: 0 equal, 1 not.
int plan_windows(const std::filesystem::path& pins, const std::filesystem::path& folder,
                 const tb::WindowBorders& borders);
int run_windows(const std::filesystem::path& folder, const RunWindowsSettings& settings);
int join_windows(const std::filesystem::path& folder);
int check_one_window(const std::filesystem::path& folder, std::size_t window);

}  // namespace meltstage::app
