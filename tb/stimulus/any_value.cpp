// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/any_value.hpp"

#include <algorithm>
#include <array>

#include "cmodel/spec.hpp"
#include "tb/stimulus/random_requests.hpp"

namespace meltstage::tb {

namespace {

// One less, the number itself or one more.
std::uint64_t beside(Rng& rng, std::uint64_t value) { return value + 1 - rng.below(3); }

// What a counter or a temperature is compared with: a register as it is, in sixteen clocks, or as 1/64 degC
// of its 0.1 degC, on either side of zero.
std::uint64_t near_a_register(Rng& rng, const std::vector<unsigned>& read, const chip::Chip& chip) {
  const std::uint64_t index =
      read.empty() || one_in(rng, 4) ? 1 + rng.below(spec::kHoldingCount - 1) : read[rng.below(read.size())];
  const auto value = chip.params().s16(static_cast<spec::Reg>(index));
  const std::array<std::int64_t, 4> scaled{static_cast<std::uint16_t>(value),
                                           16 * std::int64_t{static_cast<std::uint16_t>(value)},
                                           std::int64_t{value} * 32 / 5, -std::int64_t{value} * 32 / 5};
  return beside(rng, static_cast<std::uint64_t>(scaled[rng.below(scaled.size())]));
}

// Another flop's value, as often as not on another scale: with more bits behind the point, or fewer.
std::uint64_t near_a_flop(Rng& rng, const FlopBlock& flops, const chip::Chip& chip) {
  const FlopWords& others = flops[rng.below(flops.size())];
  const Flop& other = others[rng.below(others.size())];
  const std::uint64_t value = beside(rng, other.get(chip, other.word));
  switch (rng.below(4)) {
    case 0:
      return value << rng.below(12);
    case 1:
      return value >> rng.below(12);
    default:
      return value;
  }
}

// A command, or what only one bit keeps from being it.
std::uint64_t near_a_command(Rng& rng) {
  const std::uint64_t command = spec::kCommands[rng.below(spec::kCommands.size())];
  return one_in(rng, 4) ? command : command ^ std::uint64_t{1} << rng.below(16);
}

// Where the time base, the silences of the line and a tuning end.
std::uint64_t near_a_time(Rng& rng) {
  constexpr std::array<std::uint64_t, 4> kEnds{spec::kClkHz / 10, spec::kClkHz / 1000,
                                               spec::kClkHz / 4000 * 7, spec::kTuneLimit};
  return beside(rng, kEnds[rng.below(kEnds.size())]);
}

// Just below it, at it, or above it by as many small as large numbers: what a counter carries into, and what
// a comparison takes for small without its top bit.
std::uint64_t near_a_power_of_two(Rng& rng, unsigned width) {
  const std::uint64_t power = std::uint64_t{1} << rng.below(width + 1);
  return one_in(rng, 2) ? power - rng.below(3) : power + ((rng.bits() & (power - 1)) >> rng.below(width));
}

}  // namespace

std::uint16_t any_register_value(Rng& rng, unsigned index) {
  const spec::RegisterInfo& info = spec::kHolding[index];
  const auto span = static_cast<std::uint64_t>(info.max - info.min);
  switch (rng.below(8)) {
    case 0:
      return static_cast<std::uint16_t>(info.min);
    case 1:
      return static_cast<std::uint16_t>(info.max);
    case 2:
      return static_cast<std::uint16_t>(info.reset);
    case 3: {
      const auto near = static_cast<std::int64_t>(beside(rng, std::uint64_t{1} << rng.below(16)));
      return static_cast<std::uint16_t>(std::clamp<std::int64_t>(near, info.min, info.max));
    }
    default: {
      const std::uint64_t above = span == 0 ? 0 : std::min(span, rng.bits() >> (48 + rng.below(16)));
      const auto offset = static_cast<std::int32_t>(above);
      return static_cast<std::uint16_t>(one_in(rng, 4) ? info.max - offset : info.min + offset);
    }
  }
}

std::uint64_t any_value_of(Rng& rng, const Flop& flop, const Neighbours& beside, const chip::Chip& chip) {
  switch (rng.below(12)) {
    case 0:
      return near_a_power_of_two(rng, flop.width);
    case 1:
      return flop.get(chip, flop.word) ^ std::uint64_t{1} << rng.below(flop.width);
    case 2:
    case 3:
      return near_a_register(rng, beside.registers, chip);
    case 4:
      return near_a_flop(rng, beside.flops, chip);
    case 5:
      return near_a_command(rng);
    case 6:
      return near_a_time(rng);
    case 7:
      return rng.bits();
    case 10:
    case 11:
      return flop.get(beside.another_time, flop.word);
    default: {  // as many small as large ones; half of them with the top bit, without which they are small
      const std::uint64_t value = (rng.bits() & ones(flop.width)) >> rng.below(flop.width);
      return one_in(rng, 2) ? value : value ^ std::uint64_t{1} << (flop.width - 1);
    }
  }
}

}  // namespace meltstage::tb
