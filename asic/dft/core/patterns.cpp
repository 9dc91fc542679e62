// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/patterns.hpp"

#include <utility>

namespace meltstage::dft {

namespace {

// Bit c of word r becomes bit r of word c. After H. S. Warren, "Hacker's Delight", 2nd ed. 2012, section 7-3.
void transpose(std::array<std::uint64_t, 64>& rows) {
  std::uint64_t mask = 0x00000000FFFFFFFFU;
  for (std::size_t half = 32; half != 0; half /= 2, mask ^= mask << half) {
    for (std::size_t r = 0; r < 64; r = ((r | half) + 1) & ~half) {
      const std::uint64_t swapped = ((rows[r] >> half) ^ rows[r | half]) & mask;
      rows[r] ^= swapped << half;
      rows[r | half] ^= swapped;
    }
  }
}

}  // namespace

void PackedPatterns::append(const PatternBlock& block, const std::vector<std::uint32_t>& lanes) {
  const std::size_t first = bits_.size();
  bits_.resize(first + lanes.size() * stride_);
  std::array<std::uint64_t, 64> rows;
  for (std::size_t k = 0; k < lanes.size();) {
    const std::size_t part = lanes[k] / 64;
    std::size_t end = k;
    while (end < lanes.size() && lanes[end] / 64 == part) ++end;
    for (std::size_t column = 0; column < stride_; ++column) {
      rows.fill(0);
      for (std::size_t r = 0; r < 64 && 64 * column + r < inputs_; ++r)
        rows[r] = block.inputs[64 * column + r].part[part];
      transpose(rows);
      for (std::size_t i = k; i < end; ++i) bits_[first + i * stride_ + column] = rows[lanes[i] % 64];
    }
    k = end;
  }
}

PatternBlock PackedPatterns::block_of(const std::vector<std::uint32_t>& patterns) const {
  PatternBlock block{std::vector<Word>(inputs_), patterns.size(), {}};
  std::array<std::uint64_t, 64> rows;
  for (std::size_t part = 0; 64 * part < patterns.size(); ++part) {
    for (std::size_t column = 0; column < stride_; ++column) {
      rows.fill(0);
      for (std::size_t lane = 0; lane < 64 && 64 * part + lane < patterns.size(); ++lane) {
        const std::uint32_t pattern = patterns[64 * part + lane];
        if (pattern != kSkip) rows[lane] = bits_[pattern * stride_ + column];
      }
      transpose(rows);
      for (std::size_t r = 0; r < 64 && 64 * column + r < inputs_; ++r)
        block.inputs[64 * column + r].part[part] = rows[r];
    }
  }
  return block;
}

std::vector<PatternBlock> blocks_of(const std::vector<Pattern>& patterns, std::size_t inputs,
                                    const std::vector<Pattern>& compared) {
  std::vector<PatternBlock> blocks;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    if (i % kLanes == 0)
      blocks.push_back(
          {std::vector<Word>(inputs), 0, std::vector<Word>(compared.empty() ? 0 : compared[0].size())});
    PatternBlock& block = blocks.back();
    for (std::size_t k = 0; k < inputs; ++k) block.inputs[k].set(block.count, patterns[i][k] != 0);
    for (std::size_t k = 0; k < block.compared.size(); ++k)
      block.compared[k].set(block.count, compared[i][k] != 0);
    ++block.count;
  }
  return blocks;
}

}  // namespace meltstage::dft
