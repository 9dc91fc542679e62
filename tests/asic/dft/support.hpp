// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "asic/dft/core/bench_file.hpp"
#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/patterns.hpp"

namespace meltstage::dft {

/// A folder that goes away with the test.
class TestFolder {
 public:
  TestFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "meltstage_dft.XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TestFolder() { std::filesystem::remove_all(path_); }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;
  std::filesystem::path file(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline const CellLibrary& mini_library() {
  static const CellLibrary library = read_liberty(MINI_LIB);
  return library;
}
inline Netlist circuit_netlist(const std::string& name) {
  return read_yosys_json(std::filesystem::path(CIRCUITS) / (name + ".json"));
}

inline Circuit bench_circuit(const std::string& text) {
  const TestFolder folder;
  return read_bench(folder.file("circuit.bench", text));
}

/// A circuit of random gates: a few inputs, every gate reads what stands before it.
inline Circuit random_circuit(std::uint64_t seed, std::size_t inputs, std::size_t gates) {
  std::mt19937_64 random(seed);
  const char* names[] = {"AND", "NAND", "OR", "NOR", "XOR", "XNOR", "NOT", "BUF", "MUX"};
  std::string text;
  for (std::size_t i = 0; i < inputs; ++i) text += "INPUT(n" + std::to_string(i) + ")\n";
  for (std::size_t g = 0; g < gates; ++g) {
    const std::size_t kind = random() % 9;
    const std::size_t args = kind == 8 ? 3 : kind >= 6 ? 1 : 2 + random() % 2;
    text += "n" + std::to_string(inputs + g) + " = " + names[kind] + "(";
    for (std::size_t a = 0; a < args; ++a)
      text += (a == 0 ? "n" : ", n") + std::to_string(random() % (inputs + g));
    text += ")\n";
  }
  for (std::size_t o = 0; o < 4; ++o) text += "OUTPUT(n" + std::to_string(inputs + gates - 1 - o) + ")\n";
  return bench_circuit(text);
}

inline std::vector<Pattern> random_patterns(std::uint64_t seed, std::size_t count, std::size_t inputs) {
  std::mt19937_64 random(seed);
  std::vector<Pattern> patterns(count, Pattern(inputs));
  for (Pattern& pattern : patterns) {
    for (std::uint8_t& bit : pattern) bit = random() & 1;
  }
  return patterns;
}

inline std::vector<Pattern> all_patterns(std::size_t inputs) {
  std::vector<Pattern> patterns;
  for (std::size_t value = 0; value < (std::size_t{1} << inputs); ++value) {
    Pattern pattern(inputs);
    for (std::size_t i = 0; i < inputs; ++i) pattern[i] = (value >> i) & 1;
    patterns.push_back(std::move(pattern));
  }
  return patterns;
}

}  // namespace meltstage::dft
