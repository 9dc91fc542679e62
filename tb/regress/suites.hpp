// SPDX-License-Identifier: Apache-2.0
// Suites of runs, said once in TOML: which test, which seeds, how much of it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace meltstage::tb {

// A run is told by its test and seed, and repeats exactly.
struct RegressRun {
  std::string test;
  std::uint64_t seed = 0;
  std::uint64_t amount = 0;  // clocks or trials, as the test says

  friend bool operator==(const RegressRun&, const RegressRun&) = default;
};

// "random.17".
std::string name_of(const RegressRun& run);
// The test and seed of such a name, without an amount. Throws UserError for a name of another form or a test
// that isn't there.
RegressRun run_of(std::string_view name);

struct Suite {
  std::string name;
  std::string about;
  bool coverage_closed = false;  // what the runs together don't meet is a fault
  double limit_min = 60.0;       // a run that takes longer is ended, and is not good
  std::vector<RegressRun> runs;
};

// The project's own.
std::vector<Suite> standard_suites();
// Those of a person's file. Throws UserError, "FILE:LINE:COLUMN: ...".
std::vector<Suite> read_suites(const std::filesystem::path& path);
// Throws UserError that lists the names when there is none of this name.
const Suite& find_suite(const std::vector<Suite>& suites, std::string_view name);
const Suite& find_suite(std::vector<Suite>&& suites,
                        std::string_view name) = delete;  // would outlive its list

// The suite with other seeds: those of each test begin `by` later.
Suite with_seeds_moved(Suite suite, std::uint64_t by);

// Runs that have failed before, a line each: "random.17 300000"; what follows a '#' is a note. A file that
// isn't there holds none.
std::vector<RegressRun> read_failed(const std::filesystem::path& path);

}  // namespace meltstage::tb
