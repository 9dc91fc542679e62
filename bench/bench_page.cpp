// SPDX-License-Identifier: Apache-2.0
// The chip in a page: its size, how fast it runs in Chromium beside the same run natively, and whether both
// have the same trace.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "bench/bench.hpp"
#include "bench/process_output.hpp"
#include "tb/scenario/scripted_run.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kMostBytes = 400'000;
constexpr double kLeastRatio = 100;  // chip time over real time

struct Measured {
  std::string trace;
  double seconds;
};

Measured native_run(const std::string& scenario, double for_s) {
  tb::ScriptedRun run(tb::parse_scenario(scenario).scenario);
  const Clock::time_point began = Clock::now();
  run.until(static_cast<std::uint64_t>(std::llround(for_s * chip::spec::kClkHz)));
  const std::chrono::duration<double> took = Clock::now() - began;
  return {trace_text(run), took.count()};
}

// Characters that an address may not have, as %XX.
std::string in_address(const std::string& text) {
  std::string address;
  for (const char c : text) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_';
    address += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return address;
}

// Chromium with the page, from its start to its end. Its own clock stands while the page is busy.
Measured page_run(const fs::path& page, const std::string& scenario, double for_s) {
  const std::string command = fmt::format(
      "chromium --headless=new --no-sandbox --disable-gpu --virtual-time-budget=600000 --dump-dom "
      "'file://{}#{}' "
      "2> /dev/null",
      page.string(), in_address(fmt::format("trace={}&{}", for_s, scenario)));
  const Clock::time_point began = Clock::now();
  const std::string document = output_of(command);
  const std::chrono::duration<double> took = Clock::now() - began;
  const std::string_view mark = "<pre id=\"trace\" hidden=\"\">";
  const std::size_t begin = document.find(mark);
  if (begin == document.npos)
    throw UserError(
        fmt::format("bench page: found no page in what this prints, expected Chromium: {}", command));
  const std::size_t text = begin + mark.size();
  return {document.substr(text, document.find("</pre>", text) - text), took.count()};
}

}  // namespace

std::vector<BenchRow> bench_page(const BenchOptions& options) {
  const fs::path program = fs::read_symlink("/proc/self/exe").replace_filename("meltstage-page");
  if (!fs::exists(program))
    throw UserError(fmt::format(
        "{}: isn't there, expected it beside this program; ./run --build meltstage-page", program.string()));
  const fs::path page = fs::temp_directory_path() / fmt::format("chip_page_{}.html", getpid());
  output_of(fmt::format("'{}' page --out '{}'", program.string(), page.string()));
  const double for_s = options.quick ? 60 : 600;
  const std::string scenario = fmt::format("seed {};1 set SETPOINT 110;1.2 run", options.seed);
  const int rounds = options.quick ? 1 : 3;
  std::vector<BenchRow> rows{{"page", static_cast<double>(fs::file_size(page)), "bytes", {}, kMostBytes}};
  double native_s = INFINITY, page_s = INFINITY;
  bool equal = true;
  for (int round = 0; round < rounds; ++round) {
    tell(options.progress, "heating", static_cast<std::uint64_t>(round), static_cast<std::uint64_t>(rounds));
    const Measured natively = native_run(scenario, for_s), in_page = page_run(page, scenario, for_s);
    native_s = std::min(native_s, natively.seconds);
    page_s = std::min(page_s, in_page.seconds - page_run(page, scenario, 0.1).seconds);
    equal = equal && natively.trace == in_page.trace;
  }
  fs::remove(page);
  rows.push_back({"chip time over real time, in Chromium", for_s / page_s, "", kLeastRatio, {}});
  rows.push_back({"the same natively", for_s / native_s, "", {}, {}});
  rows.push_back({"speed of the page, native = 1", native_s / page_s, "", {}, {}});
  rows.push_back({"traces equal, every change of a pin in them", equal ? 1.0 : 0.0, "", 1.0, {}});
  return rows;
}

}  // namespace meltstage::app
