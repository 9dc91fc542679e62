// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/rng.hpp"

namespace meltstage::tb {

// Of a stretch of `quiet` clocks: all of it, just less, or any part, as often short as long. What is longer
// than two milliseconds is skipped in part, and most of it in a small one: each clock is stepped as well.
inline std::uint64_t part_of(Rng& rng, std::uint64_t quiet) {
  const std::uint64_t most = std::min<std::uint64_t>(quiet, rng.below(8) == 0 ? 30'000 : 3'000);
  switch (rng.below(4)) {
    case 0:
      return most;
    case 1:
      return std::max<std::uint64_t>(1, most - 1);
    default:
      return 1 + rng.below(std::min(most, std::uint64_t{1} << rng.below(16)));
  }
}

}  // namespace meltstage::tb
