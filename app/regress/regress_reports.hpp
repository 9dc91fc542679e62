// SPDX-License-Identifier: Apache-2.0
// What a regression leaves for people and for other programs: junit.xml, summary.json, report.html, and a
// line in history.jsonl beside the folders of all suites.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tb/regress/regression.hpp"

namespace meltstage::app {

struct RegressReport {
  tb::RegressPlan plan;
  tb::RegressVerdict verdict;
  std::string date;                // UTC, 2026-11-27T03:50:00Z
  std::string workers;             // "2 processes on this machine"
  std::vector<std::string> notes;  // lost workers
  std::size_t kept = 0;            // results that were there already
  double wall_s = 0.0;
};

/// One suite's verdict at one time.
struct HistoryLine {
  std::string date, suite;
  bool passed = false;
  std::uint64_t runs = 0, bad = 0, clocks = 0, holes = 0;
  double run_s = 0.0;
};

/// JUnit's XML as CI servers read it: a testcase a run, a failure with its whole report, an error for a lost
/// one, and one more case for coverage where it is to be closed.
std::string junit_xml(const RegressReport& report);
std::string summary_json(const RegressReport& report);
/// One page, without a file or a network beside it. `history`: of this suite, oldest first, this run last.
std::string regress_page(const RegressReport& report, const std::vector<HistoryLine>& history);
/// What a person reads in the end.
std::string regress_text(const RegressReport& report, const std::filesystem::path& folder);

HistoryLine history_line(const RegressReport& report);
/// Adds the line to the file, and returns all lines of its suite. What is no line of it is left where it is.
std::vector<HistoryLine> append_history(const std::filesystem::path& file, const HistoryLine& line);

}  // namespace meltstage::app
