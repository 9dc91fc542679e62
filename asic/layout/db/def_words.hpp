// SPDX-License-Identifier: Apache-2.0
// Words of DEF, in the order of what they stand for.
#pragma once

#include <array>

namespace meltstage::layout {

inline constexpr std::array<const char*, 4> kOrientationWords{"N", "S", "FN", "FS"};
inline constexpr std::array<const char*, 4> kUseWords{"SIGNAL", "CLOCK", "POWER", "GROUND"};
inline constexpr std::array<const char*, 3> kDirectionWords{"INPUT", "OUTPUT", "INOUT"};

template <typename Enum, std::size_t N>
const char* text_of(Enum value, const std::array<const char*, N>& names) {
  return names[static_cast<std::size_t>(value)];
}

}  // namespace meltstage::layout
