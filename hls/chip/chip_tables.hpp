// SPDX-License-Identifier: Apache-2.0
// What each circuit of the chip's model says of itself (hls/interface.hpp): its flops by the names of the
// RTL, and its invariants. A source includes it once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "cmodel/chip.hpp"
#include "cmodel/invariants.hpp"
#include "hls/interface.hpp"

using namespace meltstage::chip;

extern "C" {

void hls_invariants(const Chip* chip, Invariants* hold) { *hold = invariants_of(*chip); }

extern const meltstage::hls::Field hls_invariant_names[] = {
    HLS_FIELD(Invariants, reset_ends_in_order, 1),
    HLS_FIELD(Invariants, telemetry_reads_alone, 1),
    HLS_FIELD(Invariants, frame_count_is_bounded, 1),
    HLS_FIELD(Invariants, product_steps_are_bounded, 1),
};

// Flops as the model's lists have them; a word of an array has a row of its own.
constexpr auto kFlops = [] {
  using meltstage::hls::field;
  constexpr unsigned kFlopCount = 0
#define TC_FLOP(type, name, width, reset) +1
#define TC_ARRAY(type, name, count, width) +(count)
#include "cmodel/for_each_flop.inc"
      ;
  std::array<meltstage::hls::Field, kFlopCount> rows{};
  unsigned row = 0;
#define TC_TEXT(x) #x
#define TC_NAME(instance, name) TC_TEXT(instance) "__DOT__" #name
#define TC_FLOP(type, name, width, reset) \
  rows[row++] = field<type>(TC_NAME(TC_INSTANCE, name), offsetof(Chip, TC_MEMBER.name), width);
#define TC_ARRAY(type, name, count, width)                                                         \
  for (unsigned word = 0; word < (count); ++word) {                                                \
    rows[row] = field<type>(TC_NAME(TC_INSTANCE, name),                                            \
                            offsetof(Chip, TC_MEMBER.name) + word * sizeof(type), width);          \
    rows[row].word = static_cast<std::int32_t>(word);                                              \
    rows[row++].kept =                                                                             \
        meltstage::chip::array_flops<std::remove_cvref_t<decltype(Chip::TC_MEMBER)>>(word, width); \
  }
#include "cmodel/for_each_flop.inc"
  return rows;
}();
extern const std::array<meltstage::hls::Field, kFlops.size()> hls_flops = kFlops;
}
