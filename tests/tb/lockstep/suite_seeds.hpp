// SPDX-License-Identifier: Apache-2.0
// The random runs that together cover the specification.
#pragma once

#include <cstdint>
#include <fstream>
#include <vector>

namespace meltstage::tb {

// Seeds that once failed, or reach what the others leave out, run first, for ever.
inline std::vector<std::uint64_t> suite_seeds() {
  std::vector<std::uint64_t> list;
  std::ifstream file(MELTSTAGE_SOURCE_DIR "/tests/seeds/random.txt");
  for (std::uint64_t seed; file >> seed;) list.push_back(seed);
  for (std::uint64_t seed = 1; seed <= 63; ++seed) list.push_back(seed);
  return list;
}

}  // namespace meltstage::tb
