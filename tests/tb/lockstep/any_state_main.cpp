// SPDX-License-Identifier: Apache-2.0
// Lockstep from any state for as long as one likes: any_state --seed N --first TRIAL --trials N. Exit status
// 1 at the first mismatch.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "tb/lockstep/lockstep.hpp"
#include "tb/stimulus/any_state.hpp"

int main(int argc, char** argv) {
  using namespace meltstage::tb;
  CLI::App cli{"Model and RTL in lockstep from changed states of random runs", "any_state"};
  std::uint64_t seed = 1;
  std::uint64_t first = 0;
  std::uint64_t trials = 1'000'000;
  cli.add_option("--seed", seed, "Seed of the runs and of the changes");
  cli.add_option("--first", first, "First trial");
  cli.add_option("--trials", trials, "Number of trials");
  CLI11_PARSE(cli, argc, argv);
  try {
    const Moments moments(seed, kMomentSeeds, kMomentClocks);
    const auto rtl = make_verilated_rtl();
    const TrialCount reached = step_from_any_state(moments, *rtl, seed, first, trials);
    fmt::print(
        "{} events; {} states compared over {} clocks, {} without an invariant left out, 0 mismatches\n",
        moments.of_events().size(), reached.compared, reached.clocks, reached.refused);
  } catch (const Mismatch& error) {
    fmt::print("{}\n", error.what());
    return 1;
  }
  return 0;
}
