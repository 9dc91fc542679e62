// SPDX-License-Identifier: Apache-2.0
// What the block tests share.
#pragma once

#include <cmath>
#include <cstdint>

#include "cmodel/params.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::chip {

// The parameter set after reset.
inline Params reset_params() {
  Params p;
  for (unsigned i = 1; i < spec::kHoldingCount; ++i)
    p.value[i] = static_cast<std::uint16_t>(spec::kHolding[i].reset);
  return p;
}

// Temperature as the chip holds it, 1/64 degC.
inline std::int16_t temp(double degc) { return static_cast<std::int16_t>(std::lround(degc * 64)); }

}  // namespace meltstage::chip
