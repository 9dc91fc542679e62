// SPDX-License-Identifier: Apache-2.0
// `meltstage bench NAME`: figures measured now, a row each, with what is wanted beside them.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace meltstage::app {

struct BenchRow {
  std::string what;
  double value;
  std::string unit;
  std::optional<double> at_least;  // wanted, if anything is
  std::optional<double> at_most;
  bool good() const { return (!at_least || value >= *at_least) && (!at_most || value <= *at_most); }
};

struct BenchOptions {
  bool quick = false;  // shorter measurement; a row that leaves something out says so
};

struct Bench {
  const char* name;
  const char* summary;
  std::vector<BenchRow> (*run)(const BenchOptions&);
};

std::span<const Bench> benches();
// Prints the rows as a table or as JSON; exit status 1 when one falls short.
int report_bench(const Bench& bench, const BenchOptions& options, bool json);

std::vector<BenchRow> bench_lockstep(const BenchOptions& options);
std::vector<BenchRow> bench_path(const BenchOptions& options);
std::vector<BenchRow> bench_skip(const BenchOptions& options);
std::vector<BenchRow> bench_windows(const BenchOptions& options);

}  // namespace meltstage::app
