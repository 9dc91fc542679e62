// SPDX-License-Identifier: Apache-2.0
// `meltstage bench NAME`: figures measured now, a row each, with what is wanted beside them.
#pragma once

#include <cstdint>
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
  bool quick = false;      // shorter measurement; a row that leaves something out says so
  std::uint64_t seed = 1;  // of what is random; benches without chance take no notice
};

struct Bench {
  const char* name;
  const char* summary;
  std::vector<BenchRow> (*run)(const BenchOptions&);
};

std::span<const Bench> benches();
// Prints the rows as a table or as JSON; exit status 1 when one falls short.
int report_bench(const Bench& bench, const BenchOptions& options, bool json);

std::vector<BenchRow> bench_bus(const BenchOptions& options);
std::vector<BenchRow> bench_control(const BenchOptions& options);
std::vector<BenchRow> bench_lockstep(const BenchOptions& options);
std::vector<BenchRow> bench_path(const BenchOptions& options);
std::vector<BenchRow> bench_profile(const BenchOptions& options);
std::vector<BenchRow> bench_protection(const BenchOptions& options);
std::vector<BenchRow> bench_skip(const BenchOptions& options);
std::vector<BenchRow> bench_stage(const BenchOptions& options);
std::vector<BenchRow> bench_upset(const BenchOptions& options);
std::vector<BenchRow> bench_vibration(const BenchOptions& options);
std::vector<BenchRow> bench_windows(const BenchOptions& options);

}  // namespace meltstage::app
