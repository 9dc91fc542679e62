// SPDX-License-Identifier: Apache-2.0
// The chip as silicon: netlist, area, timing, proof, from the flow of asic/flow run now (its finished steps
// are kept), in the user's SG13G2 when PDK_ROOT is set, else in the library that Debian ships.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <stdexcept>
#include <string>

#include "bench/bench.hpp"
#include "bench/data_file.hpp"

namespace meltstage::app {

namespace {

struct Wanted {
  std::optional<double> at_least;
  std::optional<double> at_most;
};

constexpr double kPaperDie_um2 = 740.0 * 740.0;  // Xie et al. 2023: the whole die
constexpr double kPeriod_ns = 20.0;              // 50 MHz

// Wanted of every layout.
const std::map<std::string, Wanted> kWantedOfLayout{
    {"nets not routed", {{}, 0.0}},      {"open nets", {{}, 0.0}},  {"nets in conflict", {{}, 0.0}},
    {"antenna rules broken", {{}, 0.0}}, {"DRC errors", {{}, 0.0}}, {"LVS errors", {{}, 0.0}},
};

// Wanted of the whole chip in SG13G2; the rows' names are those of asic/flow/summary.py.
const std::map<std::string, Wanted> kWantedOfChip{
    {"area of the die", {{}, kPaperDie_um2}},
    {"current at 12 MHz and 1.2 V, no glitches", {{}, 0.5}},
    {"setup slack, slow", {0.2 * kPeriod_ns, {}}},
    {"setup slack, typ", {0.2 * kPeriod_ns, {}}},
    {"setup slack, fast", {0.2 * kPeriod_ns, {}}},
    {"hold slack, slow", {0.0, {}}},
    {"hold slack, typ", {0.0, {}}},
    {"hold slack, fast", {0.0, {}}},
};

// Runs a make command and calls made(target) for each target that it says it updates. Returns its status.
int trace_make(const std::string& command, const std::function<void(const std::string&)>& made) {
  static const std::regex kUpdate(R"(^\S+:\d+: (?:update )?target '([^']*)'.*\n?)");
  const auto close = [](std::FILE* pipe) { pclose(pipe); };
  std::unique_ptr<std::FILE, decltype(close)> output(popen((command + " --trace").c_str(), "r"), close);
  if (!output) throw std::runtime_error("bench silicon: the shell cannot be run");
  std::array<char, 4096> line;
  std::cmatch match;
  while (std::fgets(line.data(), line.size(), output.get()) != nullptr) {
    if (std::regex_match(line.data(), match, kUpdate)) made(std::filesystem::path(match[1].str()).filename());
  }
  return pclose(output.release());
}

// Makes what is not made yet. The share told is that of the targets.
void make(const std::string& command, const Progress& progress) {
  std::size_t all = 0, begun = 0;
  trace_make(command + " -n", [&](const std::string&) { ++all; });
  const int status = trace_make(command, [&](const std::string& target) {
    tell(progress, "making " + target, begun, std::max(all, begun));
    ++begun;
  });
  if (status != 0)
    throw std::runtime_error(fmt::format("the flow stopped (its line is above); by hand: {}", command));
}

}  // namespace

std::vector<BenchRow> bench_silicon(const BenchOptions& options) {
  const std::filesystem::path root = checkout_with("asic/flow/Makefile");
  const std::filesystem::path flow = root / "asic/flow", build = root / "build/silicon";
  const std::string tech = std::getenv("PDK_ROOT") != nullptr ? "sg13g2" : "osu018";
  // quick: one block, from RTL to a layout that is checked
  const std::string top = options.quick ? "tc_sysctrl" : "tc_top";
  const std::string goals = !options.quick     ? "routed blocks features summary"
                            : tech == "osu018" ? "layout"
                                               : "netlist summary";
  const std::string command =
      fmt::format("make -s -C '{}' TECH={} TOP={} {}", flow.string(), tech, top, goals);
  make(command, options.progress);

  const std::filesystem::path summary = build / tech / top / "summary.json";
  std::ifstream file(summary);
  const nlohmann::json found = nlohmann::json::parse(file);
  std::vector<BenchRow> rows;
  for (const auto& table : found.at("tables")) {
    const std::string title = table.at("title");
    const std::string part = title.substr(0, title.find(','));
    for (const auto& row : table.at("rows")) {
      const std::string what = row.at("what");
      const bool proof = row.at("value") == "proved";
      if (!proof && !row.at("value").is_number()) continue;  // a size, for people
      Wanted wanted;
      if (proof) wanted.at_least = 1.0;
      if (kWantedOfLayout.contains(what)) wanted = kWantedOfLayout.at(what);
      if (top == "tc_top" && tech == "sg13g2" && kWantedOfChip.contains(what))
        wanted = kWantedOfChip.at(what);
      rows.push_back({fmt::format("{}, {}, {}: {}", top, tech, part, what),
                      proof ? 1.0 : row.at("value").get<double>(),
                      proof ? "proved" : row.at("unit").get<std::string>(), wanted.at_least, wanted.at_most});
    }
  }
  return rows;
}

}  // namespace meltstage::app
