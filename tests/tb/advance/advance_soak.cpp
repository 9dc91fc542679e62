// SPDX-License-Identifier: Apache-2.0
// advance() against step() for as long as one likes: advance_soak --first SEED --clocks TOTAL. Exit status 1
// at the first difference, whose seed belongs into tests/seeds/advance.txt.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "twins.hpp"

int main(int argc, char** argv) {
  using namespace meltstage::tb;
  CLI::App cli{"Twins of the chip model, one stepped, one advanced", "advance_soak"};
  std::uint64_t first = 1;
  std::uint64_t clocks = 100'000'000;
  std::uint64_t clocks_a_seed = 20'000'000;
  cli.add_option("--first", first, "First seed");
  cli.add_option("--clocks", clocks, "Clocks in all");
  cli.add_option("--clocks-a-seed", clocks_a_seed, "Clocks of each run");
  CLI11_PARSE(cli, argc, argv);

  TwinCount all;
  std::uint64_t seed = first;
  for (; all.clocks < clocks; ++seed) {
    try {
      const TwinCount run = run_twins(seed, clocks_a_seed);
      all.clocks += run.clocks;
      all.stops += run.stops;
      all.pin_changes += run.pin_changes;
      all.looks += run.looks;
    } catch (const TwinsDiffer& difference) {
      fmt::print("{}\n", difference.what());
      return 1;
    }
  }
  fmt::print(
      "seeds {} to {}: {} clocks, {} stops, {} pin changes, 0 differences; one clock in {:.0f} was looked "
      "at\n",
      first, seed - 1, all.clocks, all.stops, all.pin_changes,
      static_cast<double>(all.clocks) / static_cast<double>(all.looks));
  return 0;
}
