// SPDX-License-Identifier: Apache-2.0
#include "bench/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/terminal.hpp"

namespace meltstage::app {

namespace {

constexpr Bench kBenches[] = {
    {"bus", "how far off a host may be, jitter, glitches, and the time of a poll", bench_bus},
    {"conformal", "measured surfaces: interpolation, touches, five axes, the paper's nine lines",
     bench_conformal, conformal_charts},
    {"control", "temperature loop: published form, bound, autotune, load, peers", bench_control,
     control_charts},
    {"diagnosis", "drawn defects of the chip found again from their fail logs", bench_diagnosis},
    {"lockstep", "clocks per second of RTL, model and both in lockstep", bench_lockstep},
    {"page", "the chip in a page: size, speed in Chromium, the same trace as natively", bench_page},
    {"path", "tours against lower bounds, the paper's ants and chained Lin-Kernighan", bench_path},
    {"profile", "velocity profile: time of a plan, time optimum, promises over random cases", bench_profile},
    {"proof", "the model proved to be the RTL: bits, time, changed gates, area of what is generated",
     bench_proof},
    {"protection", "faults of a head against firmware's rules; healthy jobs without a trip",
     bench_protection},
    {"prp", "alignment stage: nominal, the paper's calibration, full least squares, floor", bench_prp,
     prp_charts},
    {"python", "the model stepped from Python, beside C++", bench_python},
    {"silicon", "the chip's netlist: area, timing at each corner, proof, what safety costs", bench_silicon},
    {"skip", "the model from event to event: a 490 s job, and what its time depends on", bench_skip},
    {"stage", "positioning accuracy before and after compensation, fly-by, droplets in images", bench_stage},
    {"upset", "every flop inverted once in each phase of a job: outcomes a block", bench_upset},
    {"vectors", "test vectors of the chip: coverage, time, speed of grading, replay", bench_vectors},
    {"vibration", "what moves leave behind: anchor plant, and the paper's table on a servo axis",
     bench_vibration},
    {"vision", "centres of marks beside OpenCV's own; the camera's gantry from images", bench_vision,
     vision_charts},
    {"windows", "time-parallel lockstep on two processes against one run from end to end", bench_windows},
};

// Four digits, or all in front of the point.
std::string digits(double value) {
  return std::abs(value) >= 1000.0 && std::abs(value) < 1e12 ? fmt::format("{:.0f}", value)
                                                             : fmt::format("{:.4g}", value);
}

std::string wanted(const BenchRow& row) {
  if (row.at_least && row.at_most) return fmt::format("{}..{}", digits(*row.at_least), digits(*row.at_most));
  if (row.at_least) return ">= " + digits(*row.at_least);
  if (row.at_most) return "<= " + digits(*row.at_most);
  return "";
}

nlohmann::ordered_json json_of(const BenchChart& chart) {
  nlohmann::ordered_json curves = nlohmann::json::array();
  for (const BenchCurve& curve : chart.curves)
    curves.push_back({{"name", curve.name}, {"x", curve.x}, {"y", curve.y}});
  return {{"name", chart.name},   {"x_axis", chart.x_axis}, {"y_axis", chart.y_axis},
          {"y_min", chart.y_min}, {"y_max", chart.y_max},   {"curves", curves}};
}

}  // namespace

std::span<const Bench> benches() { return kBenches; }

int report_bench(const Bench& bench, BenchOptions options, bool json) {
  ProgressLine line;
  options.progress = shown_on(line);
  const std::vector<BenchRow> rows = bench.run(options);
  const bool good = std::all_of(rows.begin(), rows.end(), [](const BenchRow& row) { return row.good(); });
  if (json) {
    nlohmann::ordered_json out = {
        {"bench", bench.name}, {"quick", options.quick}, {"good", good}, {"rows", nlohmann::json::array()}};
    for (const BenchRow& row : rows) {
      nlohmann::ordered_json entry = {
          {"what", row.what}, {"value", row.value}, {"unit", row.unit}, {"good", row.good()}};
      if (row.at_least) entry["at_least"] = *row.at_least;
      if (row.at_most) entry["at_most"] = *row.at_most;
      out["rows"].push_back(entry);
    }
    if (bench.charts != nullptr && !options.quick) {
      for (const BenchChart& chart : bench.charts(options.progress)) out["charts"].push_back(json_of(chart));
    }
    line.clear();
    fmt::print("{}\n", out.dump(2));
  } else {
    line.clear();
    fmt::print("{:<52} {:>12} {:<12} {:<12}\n", bench.name, "value", "unit", "wanted");
    for (const BenchRow& row : rows) {
      fmt::print("{:<52} {:>12} {:<12} {:<12} {}\n", row.what, digits(row.value), row.unit, wanted(row),
                 row.good() ? "" : "SHORT");
    }
  }
  return good ? 0 : 1;
}

}  // namespace meltstage::app
