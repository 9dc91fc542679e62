// SPDX-License-Identifier: Apache-2.0
// Random lockstep for as long as one likes: soak --first SEED --seeds N --clocks M. Exit status 1 at the
// first mismatch, whose seed belongs into tests/seeds/random.txt.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "tb/stimulus/random_run.hpp"

int main(int argc, char** argv) {
  using namespace meltstage::tb;
  CLI::App cli{"Random runs of model and RTL in lockstep", "soak"};
  std::uint64_t first = 1;
  std::uint64_t seeds = 100;
  std::uint64_t clocks = 1'000'000;
  cli.add_option("--first", first, "First seed");
  cli.add_option("--seeds", seeds, "Number of seeds");
  cli.add_option("--clocks", clocks, "Clocks of each run");
  CLI11_PARSE(cli, argc, argv);

  Coverage all;
  std::uint64_t compared = 0;
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    try {
      const RandomRun run = random_run(
          in_lockstep(random_start(seed),
                      {"random", seed, fmt::format("soak --first {} --seeds 1 --clocks {}", seed, clocks)}),
          seed, clocks);
      all.add(run.coverage);
      compared += run.compared.clocks;
    } catch (const std::exception& error) {
      fmt::print("seed {}: {}\n", seed, error.what());
      return 1;
    }
  }
  fmt::print("{} seeds, {} clocks in lockstep, 0 mismatches\n", seeds, compared);
  for (const std::string& hole : all.holes()) fmt::print("not covered: {}\n", hole);
  return 0;
}
