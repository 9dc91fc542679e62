// SPDX-License-Identifier: Apache-2.0
// `meltstage print JOB.toml`: runs a job on the virtual printer and writes its folder.
#pragma once

#include <filesystem>
#include <optional>

#include "app/windows/windows.hpp"
#include "tb/printer/board_alignment.hpp"
#include "tb/printer/printer.hpp"

namespace meltstage::app {

/// Brings a board to where the print expects it; tb::align_board, or null in a program without the camera's
/// libraries.
using BoardAligner = tb::AlignedBoard (*)(const tb::BoardAlignment&, const tb::AlignmentProgress&);

struct PrintOptions {
  std::filesystem::path job;
  std::filesystem::path out;          // folder to write (print_folder.hpp)
  std::optional<tb::RtlWindows> rtl;  // instead of the job's
  bool vcd = false;                   // the waves of all pins as pins.vcd too
  std::string command;                // as typed, for reports
  BoardAligner align = nullptr;       // for a job with [alignment]
  // With the full job in RTL:
  std::string for_full_rtl;  // an option given that means nothing without; empty: none
  std::filesystem::path
      work;  // folder of plan and results; empty: beside `out`, and removed when all is equal
  tb::WindowBorders borders;
  RunWindowsSettings windows;
};

// Writes summary.json, report.html, pins.mvec (and pins.vcd) into a folder that appears whole or not at all.
// Returns the exit status: 0 printed, 1 stopped or mismatch. Throws UserError for wrong input.
int print_job(const PrintOptions& options);

}  // namespace meltstage::app
