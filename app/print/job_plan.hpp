// SPDX-License-Identifier: Apache-2.0
// From what a job says to what a printer or a machine does: bumps in planned order, compensation, rows.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/print/job_file.hpp"

namespace meltstage::app {

struct LoadedJob {
  tb::PrintJob job;  // bumps in planned order
  std::string plan_metric;
  std::vector<motion::Point> bumps_in_file_order;
  motion::Plan plan;                                 // costs in s if the metric is time, else mm
  double moves_before_s = 0.0, moves_after_s = 0.0;  // of the stage with a stop at each bump
  std::optional<double> rows_s;    // on the fly, the ways to the first row and to the end too
  std::vector<std::string> notes;  // on the files, as JobDescription has them
  std::string plan_unit;
  std::filesystem::path coordinates;
  std::vector<std::filesystem::path> inputs;    // every file that was read
  std::optional<tb::BoardAlignment> alignment;  // before the print
};

// What rounding leaves of a sum of hops is nothing that a cheaper order could save; the page proves the same.
// NaN without a bound.
double most_above_cheapest_percent(const motion::Plan& plan);

// Plans the path, and the rows of a print on the fly. Throws UserError.
LoadedJob plan_job(JobDescription parsed, const motion::PathProgress& progress = {});

// Parses and plans. Throws UserError.
LoadedJob load_job(const std::filesystem::path& path, const motion::PathProgress& progress = {});

}  // namespace meltstage::app
