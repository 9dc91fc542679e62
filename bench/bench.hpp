// SPDX-License-Identifier: Apache-2.0
// `meltstage bench NAME`: figures measured now, a row each, with what is wanted beside them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/progress.hpp"

namespace meltstage::app {

struct BenchRow {
  std::string what;
  double value;
  std::string unit;
  std::optional<double> at_least;  // wanted, if anything is
  std::optional<double> at_most;
  bool good() const { return (!at_least || value >= *at_least) && (!at_most || value <= *at_most); }
};

/// One line of a chart; x and y of one length.
struct BenchCurve {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;
};

/// Curves that belong to the rows: part of the JSON, from which bench/pictures/bench_charts.sh draws them.
struct BenchChart {
  std::string name;  // of the picture's file
  std::string x_axis;
  std::string y_axis;
  double y_min;
  double y_max;
  std::vector<BenchCurve> curves;
};

struct BenchOptions {
  bool quick = false;      // shorter measurement; a row that leaves something out says so
  std::uint64_t seed = 1;  // of what is random; benches without chance take no notice
  Progress progress = {};
};

struct Bench {
  const char* name;
  const char* summary;
  std::vector<BenchRow> (*run)(const BenchOptions&);
  std::vector<BenchChart> (*charts)(const Progress&) = nullptr;  // of benches that have some
};

std::span<const Bench> benches();
// Prints the rows as a table or as JSON; exit status 1 when one falls short.
int report_bench(const Bench& bench, BenchOptions options, bool json);

std::vector<BenchRow> bench_bus(const BenchOptions& options);
std::vector<BenchRow> bench_conformal(const BenchOptions& options);
std::vector<BenchChart> conformal_charts(const Progress& progress);
std::vector<BenchRow> bench_control(const BenchOptions& options);
std::vector<BenchChart> control_charts(const Progress& progress);
std::vector<BenchRow> bench_diagnosis(const BenchOptions& options);
std::vector<BenchRow> bench_lockstep(const BenchOptions& options);
std::vector<BenchRow> bench_page(const BenchOptions& options);
std::vector<BenchRow> bench_path(const BenchOptions& options);
std::vector<BenchRow> bench_profile(const BenchOptions& options);
std::vector<BenchRow> bench_proof(const BenchOptions& options);
std::vector<BenchRow> bench_protection(const BenchOptions& options);
std::vector<BenchRow> bench_prp(const BenchOptions& options);
std::vector<BenchChart> prp_charts(const Progress& progress);
std::vector<BenchRow> bench_python(const BenchOptions& options);
std::vector<BenchRow> bench_silicon(const BenchOptions& options);
std::vector<BenchRow> bench_skip(const BenchOptions& options);
std::vector<BenchRow> bench_stage(const BenchOptions& options);
std::vector<BenchRow> bench_upset(const BenchOptions& options);
std::vector<BenchRow> bench_vectors(const BenchOptions& options);
std::vector<BenchRow> bench_vibration(const BenchOptions& options);
std::vector<BenchRow> bench_vision(const BenchOptions& options);
std::vector<BenchChart> vision_charts(const Progress& progress);
std::vector<BenchRow> bench_windows(const BenchOptions& options);

}  // namespace meltstage::app
