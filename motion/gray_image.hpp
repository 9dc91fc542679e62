// SPDX-License-Identifier: Apache-2.0
// What cameras give.
#pragma once

#include <cstdint>
#include <vector>

namespace meltstage::motion {

/// Eight-bit grey image, rows from top to bottom.
struct GrayImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

}  // namespace meltstage::motion
