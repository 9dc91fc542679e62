// SPDX-License-Identifier: Apache-2.0
// The tests that a regression draws seeds for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "tb/lockstep/coverage.hpp"
#include "tb/lockstep/lockstep.hpp"
#include "tb/regress/suites.hpp"

namespace meltstage::tb {

// What a run has shown.
struct RunResult {
  RegressRun run;
  bool good = false;
  std::string report;  // of a run that is not good
  Compared compared;   // zeros but clocks where the model is compared with itself
  Coverage coverage;   // nothing where the test looks at none
  double wall_s = 0.0;
  std::string host;
};

struct RegressTest {
  std::string_view name;
  std::string_view unit;  // of the amount: "clocks", "trials"
  std::string_view about;
  // What a mismatch leaves lies in `failures`. Throws Mismatch or SafetyViolation.
  void (*run)(const RegressRun& run, const std::filesystem::path& failures, RunResult& result);
};

// All of them.
std::span<const RegressTest> regress_tests();
// None of this name: nullptr.
const RegressTest* find_test(std::string_view name);
// "random, late_pins, ...".
std::string test_names();

// Command that repeats a run alone.
std::string repeat_command(const RegressRun& run);

// Whether a run of this test can be recorded: its stimulus is that of pins.
bool has_pins(const RegressRun& run);

// Writes the pins of the model under the run's stimulus from power-up, its reset first; the number of clocks.
// What a run in lockstep puts into the flops (settings to begin with, a later time, upsets) does not happen.
// Throws what recording::TextWriter does.
std::uint64_t record_from_power_up(const RegressRun& run, const std::filesystem::path& file);

// The result of a run that took too long.
RunResult overlong_run(const RegressRun& run, double limit_min);

// Runs it to its end; a mismatch, a broken promise or any other exception is in the result.
RunResult do_run(const RegressRun& run, const std::filesystem::path& failures);

}  // namespace meltstage::tb
