// SPDX-License-Identifier: Apache-2.0
// Test patterns of a circuit, in blocks of 512 that a simulator works on at once.
#pragma once

#include <algorithm>
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
  /// Lanes first .. first + count - 1.
  void set(std::size_t first, std::size_t count, bool value) {
    for (std::size_t end = first + count; first < end;) {
      const std::size_t last = std::min(end, (first / 64 + 1) * 64);  // within one part
      const std::uint64_t mask = (~std::uint64_t{0} >> (64 - (last - first))) << (first % 64);
      part[first / 64] = value ? part[first / 64] | mask : part[first / 64] & ~mask;
      first = last;
    }
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
    mask.set(0, count, true);
    return mask;
  }
};

/// Patterns picked out of blocks, a bit an input.
class PackedPatterns {
 public:
  explicit PackedPatterns(std::size_t inputs) : inputs_(inputs), stride_((inputs + 63) / 64) {}
  std::size_t size() const { return bits_.size() / stride_; }
  /// Appends these lanes of the block in ascending order.
  void append(const PatternBlock& block, const std::vector<std::uint32_t>& lanes);
  /// A block of these patterns; kSkip leaves a lane at 0.
  static constexpr std::uint32_t kSkip = ~std::uint32_t{0};
  PatternBlock block_of(const std::vector<std::uint32_t>& patterns) const;

 private:
  std::size_t inputs_, stride_;
  std::vector<std::uint64_t> bits_;
};

/// Patterns in order, 512 a block; `compared` is empty or one value for each circuit output of each pattern.
std::vector<PatternBlock> blocks_of(const std::vector<Pattern>& patterns, std::size_t inputs,
                                    const std::vector<Pattern>& compared = {});

}  // namespace meltstage::dft
