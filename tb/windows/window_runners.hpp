// SPDX-License-Identifier: Apache-2.0
// Who checks the windows of a work folder: worker processes of this machine, or a Slurm cluster. Results lie
// in the folder; a worker that is lost leaves none, and its window is run again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tb/windows/window_process.hpp"
#include "tb/windows/windows.hpp"

namespace meltstage::tb {

struct RunWindowsOptions {
  Arguments worker;        // command that checks one window; folder and number are appended
  unsigned processes = 1;  // on this machine at once
  unsigned attempts = 3;   // for a window in all, before it is left without result
};

struct WindowProgress {
  std::size_t done;  // of this call
  std::size_t total;
  std::string detail;  // "2 processes", "Slurm job 17: 3 running, 5 waiting"
};
// Called several times a second; may throw to end the run: workers are then killed, jobs cancelled.
using WindowProgressCall = std::function<void(const WindowProgress&)>;

struct RanWindows {
  std::string workers;             // "2 processes on this machine", "Slurm job 17"
  std::vector<std::string> notes;  // a line for each lost worker
};

// Both throw UserError when a worker says that the folder's files can't be used (exit status 2), or when
// the engine is missing.
RanWindows run_windows_here(const std::filesystem::path& folder, const std::vector<std::size_t>& windows,
                            const RunWindowsOptions& options, const WindowProgressCall& progress);
RanWindows run_windows_slurm(const std::filesystem::path& folder, const WindowPlan& plan,
                             const std::vector<std::size_t>& windows, const RunWindowsOptions& options,
                             const WindowProgressCall& progress);

}  // namespace meltstage::tb
