// SPDX-License-Identifier: Apache-2.0
// A short slice of fuzzing in ./check: each reader takes its corpus and random changes of it. The seed is
// drawn at run time and printed; MELTSTAGE_FUZZ_SEED repeats one.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <ostream>
#include <random>

#include "base/file.hpp"
#include "base/number.hpp"
#include "base/place.hpp"
#include "tests/fuzz/mutator.hpp"

// extern "C" int fuzz_READER(const std::uint8_t*, std::size_t) of each reader
#include "fuzz_entries.hpp"

namespace meltstage {
namespace {

struct FuzzedReader {
  const char* name;
  int (*entry)(const std::uint8_t*, std::size_t);
  friend std::ostream& operator<<(std::ostream& out, const FuzzedReader& reader) {
    return out << reader.name;
  }
};

const FuzzedReader kReaders[] = {FUZZED_READERS};

class Fuzz : public testing::TestWithParam<FuzzedReader> {};

std::uint64_t drawn_seed() {
  const char* const given = std::getenv("MELTSTAGE_FUZZ_SEED");
  if (given != nullptr) return number_in<std::uint64_t>(given, 0, ~std::uint64_t{0}).value();
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

TEST_P(Fuzz, CorpusAndChangesOfItAreReadOrRefused) {
  constexpr std::size_t kChanges = 3000;
  constexpr std::chrono::milliseconds kTime{800};
  const auto& [name, entry] = GetParam();
  std::vector<std::filesystem::path> paths;
  for (const auto& file :
       std::filesystem::directory_iterator(std::string(MELTSTAGE_SOURCE_DIR "/tests/fuzz/corpus/") + name))
    paths.push_back(file.path());
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> corpus;
  for (const auto& path : paths) corpus.push_back(read_file(path, "a piece of the corpus"));
  ASSERT_FALSE(corpus.empty());
  const auto give = [&](const std::string& text) {
    try {
      entry(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    } catch (const std::exception& error) {
      ADD_FAILURE() << name << ": " << error.what() << " for\n" << text;
    }
  };
  give("");
  for (const std::string& text : corpus) give(text);
  const std::uint64_t seed = drawn_seed();
  std::fprintf(stderr, "%s: seed %llu\n", name, static_cast<unsigned long long>(seed));
  Rng random = stream(seed, name);
  const auto start = std::chrono::steady_clock::now();
  std::size_t done = 0;
  for (; done < kChanges && std::chrono::steady_clock::now() - start < kTime && !HasFailure(); ++done)
    give(mutated(corpus, random));
  std::fprintf(stderr, "%s: %zu changes\n", name, done);
}

INSTANTIATE_TEST_SUITE_P(Readers, Fuzz, testing::ValuesIn(kReaders),
                         [](const auto& reader) { return std::string(reader.param.name); });

}  // namespace
}  // namespace meltstage
