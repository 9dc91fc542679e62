// SPDX-License-Identifier: Apache-2.0
// A regression's work folder: plan.json, results/000001.json, failures/; and its verdict. Any process that is
// told folder and number does a run, here or on another machine with the same files.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tb/regress/suites.hpp"
#include "tb/regress/tests.hpp"

namespace meltstage::tb {

struct RegressPlan {
  Suite suite;
  std::string program;  // SHA-256 of the program that made the plan: results of another one don't count
};

RegressPlan plan_for(const Suite& suite);

// Whether the folder holds this very plan.
bool holds(const std::filesystem::path& folder, const RegressPlan& plan);
// Writes it, and removes the results and the verdict of another one.
void begin_regression(const std::filesystem::path& folder, const RegressPlan& plan);
// Throws UserError when there is none, or it is of another program.
RegressPlan read_regression(const std::filesystem::path& folder);

// Does run `number`, from 0; its result appears whole. A run that takes longer than its suite allows ends
// this process with exit status 1, its result written. Throws UserError when it can't be written.
RunResult do_planned_run(const std::filesystem::path& folder, const RegressPlan& plan, std::size_t number);
// Numbers without a usable result.
std::vector<std::size_t> runs_to_do(const std::filesystem::path& folder, const RegressPlan& plan);

struct RegressVerdict {
  std::vector<std::optional<RunResult>> results;  // by number; none: its worker was lost
  std::vector<std::string> faults;                // a line each; empty: passed
  std::vector<std::string> holes;                 // what the runs together have not met
  FlopToggles toggles;                            // of all runs
  std::map<std::string, FlopToggles> toggles_of;  // by the name of the test; of those that look at them
  Compared compared;                              // sums
  std::size_t good = 0, failed = 0, missing = 0;
  double run_s = 0.0;  // of all runs, one after another

  bool passed() const { return faults.empty(); }
};

RegressVerdict join_runs(const std::filesystem::path& folder, const RegressPlan& plan);

}  // namespace meltstage::tb
