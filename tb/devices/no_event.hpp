// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "cmodel/flops.hpp"

namespace meltstage::tb {

/// The clock cycle of an event that does not come: later than any other, the chip's too.
inline constexpr std::uint64_t kNoEvent = chip::kForever;

}  // namespace meltstage::tb
