// SPDX-License-Identifier: Apache-2.0
#include "tb/regress/tests.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <utility>

#include "tb/lockstep/bench.hpp"
#include "tb/lockstep/pin_recording.hpp"
#include "tb/regress/failing_case.hpp"
#include "tb/stimulus/any_skip.hpp"
#include "tb/stimulus/any_state.hpp"
#include "tb/stimulus/end_writes.hpp"
#include "tb/stimulus/late_pins.hpp"
#include "tb/stimulus/random_run.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLeastEvents = 500;  // new values of the chip's flags, states and steps

std::unique_ptr<Device> start_of(const chip::Chip& start, const RegressRun& run, const fs::path& failures) {
  return in_lockstep(start, {run.test, run.seed, repeat_command(run)}, failures);
}

void run_on(std::unique_ptr<Device> device, const RegressRun& run, RunResult& result) {
  const RandomRun ran = random_run(std::move(device), run.seed, run.amount);
  result.compared = ran.compared;
  result.coverage = ran.coverage;
}

void run_random(const RegressRun& run, const fs::path& failures, RunResult& result) {
  run_on(start_of(random_start(run.seed), run, failures), run, result);
}

void run_late_pins(const RegressRun& run, const fs::path& failures, RunResult& result) {
  run_on(with_late_pins(start_of(random_start(run.seed), run, failures), run.seed), run, result);
}

void run_register_ends(const RegressRun& run, const fs::path& failures, RunResult& result) {
  const EndWrites ran =
      write_register_ends(start_of(end_writes_start(), run, failures), run.seed, run.amount);
  result.compared = ran.compared;
  result.coverage = ran.coverage;
}

void run_any_state(const RegressRun& run, const fs::path&, RunResult& result) {
  const Moments moments(run.seed, kMomentSeeds, kMomentClocks);
  const auto rtl = make_verilated_rtl();
  const TrialCount reached = step_from_any_state(moments, *rtl, run.seed, 0, run.amount);
  if (moments.events() < kLeastEvents)
    throw std::runtime_error(fmt::format("reached too little: found {} events of the model, expected {}",
                                         moments.events(), kLeastEvents));
  if (4 * reached.compared < 3 * run.amount)
    throw std::runtime_error(
        fmt::format("reached too little: found {} of {} states compared ({} without an invariant), expected "
                    "three quarters",
                    reached.compared, run.amount, reached.refused));
  result.compared.clocks = reached.clocks;
  result.compared.pin_values = reached.clocks * spec::kOutputPins;
  result.compared.flop_values = reached.clocks * rtl->flop_bits();
  result.coverage.toggles = reached.toggles;
  result.coverage.crosses = reached.crosses;
}

void run_skip(const RegressRun& run, const fs::path&, RunResult& result) {
  const Moments moments(run.seed, kMomentSeeds, kMomentClocks);
  const SkipCount reached = skip_from_any_state(moments, run.seed, run.amount);
  if (20 * reached.skipped < run.amount || 100 * reached.whole < run.amount)
    throw std::runtime_error(
        fmt::format("reached too little: {} stretches skipped of {} trials, {} to their end", reached.skipped,
                    run.amount, reached.whole));
  result.compared.clocks = reached.clocks;
}

constexpr std::array<RegressTest, 5> kTests = {
    {{"random", "clocks", "model and RTL in lockstep under a random host, sensor, head and upsets",
      run_random},
     {"late_pins", "clocks",
      "the same, each change of a pin at once or a clock later, as synchronisers see it", run_late_pins},
     {"register_ends", "passes", "each register's lowest and highest value, and one beyond, over the bus",
      run_register_ends},
     {"any_state", "trials", "model and RTL in lockstep for some clocks from changed states", run_any_state},
     {"skip", "trials", "the model's closed forms of idle time against stepping, from changed states",
      run_skip}}};

// Writes the mismatch as a case of its own; lines for the report.
std::string shrunk(const FailedStretch& stretch, const RegressRun& run, const fs::path& failures) {
  const auto failing = shrink(stretch, name_of(run), *make_verilated_rtl());
  if (!failing) return "  not shrunk: its last clocks alone don't fail\n";
  const fs::path path = failures / (name_of(run) + ".json");
  try {
    fs::create_directories(failures);
    write_case(path, *failing);
  } catch (const std::exception& error) {
    return fmt::format("  not shrunk: {}\n", error.what());
  }
  return fmt::format("  shrunk to {}  alone: meltstage regress case {}\n", describe(*failing), path.string());
}

std::string host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

}  // namespace

std::span<const RegressTest> regress_tests() { return kTests; }

const RegressTest* find_test(std::string_view name) {
  const auto* found =
      std::find_if(kTests.begin(), kTests.end(), [&](const RegressTest& t) { return t.name == name; });
  return found == kTests.end() ? nullptr : found;
}

std::string test_names() {
  std::string names;
  for (const RegressTest& test : kTests) names += fmt::format("{}{}", names.empty() ? "" : ", ", test.name);
  return names;
}

std::string repeat_command(const RegressRun& run) {
  return fmt::format("meltstage regress one {} --amount {}", name_of(run), run.amount);
}

bool has_pins(const RegressRun& run) { return run.test == "random"; }

std::uint64_t record_from_power_up(const RegressRun& run, const fs::path& file) {
  constexpr int kResetClocks = 20;
  auto device = std::make_unique<PinRecording>(file, "regress record " + name_of(run));
  for (int clock = 0; clock < kResetClocks; ++clock) device->step({.rst_n = false});
  return random_run(std::move(device), run.seed, run.amount).compared.clocks;
}

RunResult overlong_run(const RegressRun& run, double limit_min) {
  RunResult result;
  result.run = run;
  result.host = host_name();
  result.wall_s = limit_min * 60.0;
  result.report = fmt::format(
      "ended after {} min, the suite's limit_min: it hangs, or its amount is too large\n", limit_min);
  return result;
}

RunResult do_run(const RegressRun& run, const fs::path& failures) {
  RunResult result;
  result.run = run;
  result.host = host_name();
  const auto begin = std::chrono::steady_clock::now();
  try {
    find_test(run.test)->run(run, failures, result);
    result.good = result.compared.clocks > 0;
    if (!result.good) result.report = "nothing was compared\n";
  } catch (const Mismatch& mismatch) {
    result.report = mismatch.what();
    if (mismatch.stretch) result.report += shrunk(*mismatch.stretch, run, failures);
  } catch (const std::exception& error) {
    result.report = error.what();
  }
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace meltstage::tb
