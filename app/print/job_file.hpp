// SPDX-License-Identifier: Apache-2.0
// The job file of `meltstage print`: TOML, every field named with its unit. Reference: docs/print/jobs.md.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "motion/tour/path.hpp"
#include "tb/printer/board_alignment.hpp"
#include "tb/printer/printer.hpp"

namespace meltstage::app {

// What a job's files say, every value in its range; nothing is planned yet.
struct JobDescription {
  std::filesystem::path file;
  tb::PrintJob job;  // without bumps, compensation and rows
  std::vector<motion::Point> bumps_in_file_order;
  std::vector<std::string> notes;  // on what the files hold and how it is read, a line each
  motion::PathTask task;
  std::string plan_metric;
  std::optional<motion::FlyByConfig> fly_by;  // otherwise it stops at each bump
  std::array<std::optional<std::vector<motion::TargetDeviations>>, 2>
      deviations;           // of X and Y, where measured
  std::string quiet_place;  // of stage.quiet_tolerance_um, for a refusal
  std::filesystem::path coordinates;
  std::vector<std::filesystem::path> inputs;    // every file that was read
  std::optional<tb::BoardAlignment> alignment;  // before the print
};

// Reads the job and the files that it names (relative to it). Throws UserError.
JobDescription parse_job(const std::filesystem::path& path);

}  // namespace meltstage::app
