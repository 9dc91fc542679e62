// SPDX-License-Identifier: Apache-2.0
// The model's flops by name, each to be read and set as a number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"

namespace meltstage::tb {

// A flop, or a word of an array, as a value without sign.
struct Flop {
  std::string name;
  unsigned width = 0;
  std::uint64_t changeable = 0;  // bits that are flops
  unsigned word = 0;
  bool is_array = false;
  std::uint64_t (*get)(const chip::Chip&, unsigned word) = nullptr;
  void (*set)(chip::Chip&, unsigned word, std::uint64_t value) = nullptr;
  std::size_t place = 0;  // in flops_in_order()
  std::size_t block = 0;  // in flop_blocks()
};

// A flop, or the words of an array, which stand together so that an array is drawn as often as a flop.
using FlopWords = std::vector<Flop>;
using FlopBlock = std::vector<FlopWords>;

// All of them, block by block.
const std::vector<FlopBlock>& flop_blocks();

#define TC_FLOP(type, name, width, reset) +1
#define TC_ARRAY(type, name, count, width) +(count)
inline constexpr std::size_t kFlopPlaces = 0
#include "cmodel/for_each_flop.inc"
    ;

// As they stand in cmodel/for_each_flop.inc; nullptr for a word of which no bit is a flop.
const std::vector<const Flop*>& flops_in_order();

// Calls take(flop) for each that differs.
void for_each_changed(const chip::Chip& was, const chip::Chip& is,
                      const std::function<void(const Flop&)>& take);

// Flags, states, steps of a computation; wider ones are values and counters.
inline constexpr unsigned kNarrowBits = 6;
inline bool is_narrow(const Flop& flop) { return !flop.is_array && flop.width <= kNarrowBits; }

// The low bits of a flop.
constexpr std::uint64_t ones(unsigned width) { return ~std::uint64_t{0} >> (64 - width); }

// "mem.active_q[3]"; the word of an array only.
std::string name_of(const Flop& flop);

// A line for each flop that differs.
std::string list_differences(const chip::Chip& was, const chip::Chip& is);

}  // namespace meltstage::tb
