// SPDX-License-Identifier: Apache-2.0
// The active parameter set as the blocks see it.
#pragma once

#include <array>
#include <cstdint>

#include "spec.hpp"

namespace meltstage::chip {

// Raw register values, indexed by spec::Reg; entry 0 (CMD) is not stored and stays 0.
struct Params {
  std::array<std::uint16_t, spec::kHoldingCount> value{};

  constexpr std::uint16_t operator[](spec::Reg reg) const { return value[reg]; }
  constexpr std::int16_t s16(spec::Reg reg) const { return static_cast<std::int16_t>(value[reg]); }
  constexpr bool bit(spec::Reg reg, unsigned index) const { return ((value[reg] >> index) & 1u) != 0; }
};

}  // namespace meltstage::chip
