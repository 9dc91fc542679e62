// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/decision_edge.hpp"

#include <utility>

namespace meltstage::tb {

void set_flop(const Flop& flop, std::uint64_t value, chip::Chip& chip) {
  const std::uint64_t now = flop.get(chip, flop.word);
  flop.set(chip, flop.word, (value & flop.changeable) | (now & ~flop.changeable));
  chip.mem.refresh_params();
}

std::uint64_t way_of_block(const FlopBlock& block, const chip::Chip& before, const chip::Chip& after) {
  constexpr std::uint64_t kPrime = 0x100000001B3U;
  std::uint64_t way = 0xCBF29CE484222325U;  // FNV-1a
  for (const FlopWords& words : block) {
    const Flop& flop = words[0];
    if (flop.is_array) continue;
    const std::uint64_t value = flop.get(after, flop.word);
    way = (way ^ (is_narrow(flop) ? value : value == flop.get(before, flop.word))) * kPrime;
  }
  return way;
}

bool set_at_decision_edge(Rng& rng, const FlopBlock& block, const Flop& flop, std::uint64_t low,
                          std::uint64_t high, const chip::Inputs& in, chip::Chip& chip) {
  chip::Chip changed = chip;
  const auto way_from = [&](std::uint64_t value) {
    set_flop(flop, value, changed);
    chip::Chip stepped = changed;
    stepped.step(in);
    return way_of_block(block, changed, stepped);
  };
  if (low > high) std::swap(low, high);
  const std::uint64_t way = way_from(low);
  if (way_from(high) == way) return false;
  while (high - low > 1) {
    const std::uint64_t middle = low + (high - low) / 2;
    (way_from(middle) == way ? low : high) = middle;
  }
  set_flop(flop, one_in(rng, 2) ? low : high, chip);
  return true;
}

}  // namespace meltstage::tb
