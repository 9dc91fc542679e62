// SPDX-License-Identifier: Apache-2.0
// The job file of `meltstage print`: TOML, every field named with its unit. Reference: docs/print/jobs.md.
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "motion/tour/path.hpp"
#include "tb/printer/board_alignment.hpp"
#include "tb/printer/printer.hpp"

namespace meltstage::app {

struct LoadedJob {
  tb::PrintJob job;  // bumps in planned order
  std::string plan_metric;
  std::vector<motion::Point> bumps_in_file_order;
  motion::Plan plan;                                 // costs in s if the metric is time, else mm
  double moves_before_s = 0.0, moves_after_s = 0.0;  // of the stage with a stop at each bump
  std::string plan_unit;
  std::filesystem::path coordinates;
  std::vector<std::filesystem::path> inputs;    // every file that was read
  std::optional<tb::BoardAlignment> alignment;  // before the print
};

// Reads the job and its coordinate file (relative to the job file) and plans the path. Throws UserError.
LoadedJob load_job(const std::filesystem::path& path, const motion::PathProgress& progress = {});

}  // namespace meltstage::app
