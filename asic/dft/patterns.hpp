// SPDX-License-Identifier: Apache-2.0
// Test patterns of a circuit, in blocks of 512 that a simulator works on at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace meltstage::dft {

inline constexpr std::size_t kLanes = 512;

/// One bit of each of 512 patterns.
struct Word {
  alignas(64) std::array<std::uint64_t, kLanes / 64> part{};

  bool bit(std::size_t lane) const { return ((part[lane / 64] >> (lane % 64)) & 1U) != 0; }
  void set(std::size_t lane, bool value) {
    const std::uint64_t mask = std::uint64_t{1} << (lane % 64);
    part[lane / 64] = value ? part[lane / 64] | mask : part[lane / 64] & ~mask;
  }
  bool any() const {
    std::uint64_t all = 0;
    for (const std::uint64_t p : part) all |= p;
    return all != 0;
  }
  /// First lane with a 1; kLanes when there is none.
  std::size_t first() const {
    for (std::size_t i = 0; i < part.size(); ++i) {
      if (part[i] != 0) return 64 * i + static_cast<std::size_t>(__builtin_ctzll(part[i]));
    }
    return kLanes;
  }
  friend bool operator==(const Word&, const Word&) = default;
};

/// A pattern: one value for each circuit input.
using Pattern = std::vector<std::uint8_t>;

/// Up to 512 patterns, input by input.
struct PatternBlock {
  std::vector<Word> inputs;         ///< by circuit input
  std::size_t count = 0;            ///< patterns in use, lanes 0 .. count - 1
  std::vector<Word> compared = {};  ///< by circuit output: in which patterns it is compared; empty: in all

  Word used() const {
    Word mask;
    for (std::size_t lane = 0; lane < count; ++lane) mask.set(lane, true);
    return mask;
  }
};

/// Patterns in order, 512 a block; `compared` is empty or one value for each circuit output of each pattern.
std::vector<PatternBlock> blocks_of(const std::vector<Pattern>& patterns, std::size_t inputs,
                                    const std::vector<Pattern>& compared = {});

}  // namespace meltstage::dft
