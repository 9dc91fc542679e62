// SPDX-License-Identifier: Apache-2.0
// Bad input for as long as one likes: bus_soak --first SEED --seeds N --segments M sends N x M random
// segments, each followed by a valid request. Exit status 1 at the first broken promise. bus_soak --corpus
// FOLDER writes the fuzzer's seed programs instead.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>

#include "random_bus_run.hpp"

int main(int argc, char** argv) {
  using namespace meltstage::tb;
  CLI::App cli{"Random input on the serial line", "bus_soak"};
  std::uint64_t first = 1;
  std::uint64_t seeds = 1000;
  std::uint64_t segments = 1000;
  std::filesystem::path corpus;
  cli.add_option("--first", first, "First seed");
  cli.add_option("--seeds", seeds, "Number of seeds");
  cli.add_option("--segments", segments, "Segments of each");
  cli.add_option("--corpus", corpus, "Folder to write the fuzzer's seed programs to");
  CLI11_PARSE(cli, argc, argv);

  if (!corpus.empty()) {
    std::filesystem::create_directories(corpus);
    const std::vector<Bytes> programs = seed_programs();
    for (std::size_t i = 0; i < programs.size(); ++i) {
      std::ofstream file(corpus / fmt::format("seed{:03}", i), std::ios::binary);
      for (const std::uint8_t byte : programs[i]) file.put(static_cast<char>(byte));
    }
    fmt::print("{} programs in {}\n", programs.size(), corpus.string());
    return 0;
  }
  BusCount all;
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    try {
      all = sum(all, random_bus_run(seed, segments));
    } catch (const Violation& violation) {
      fmt::print("seed {}: {}\n", seed, violation.what());
      return 1;
    }
  }
  fmt::print(
      "{} segments: {} sound frames accepted ({} exceptions), {} left open, {} registers changed; 0 "
      "violations\n",
      all.segments, all.accepted, all.exceptions, all.possible, all.written);
  return 0;
}
