// SPDX-License-Identifier: Apache-2.0
// A block's flops are one list, X(type, name, width in bits, reset value), under the names of the RTL.
// Declaration, lockstep comparison, save/restore and reports are made from that list.
//
// Idle time. Each block has, beside step(in),
//   quiet(in): so many coming clocks at least, with these inputs, in which step(in) would do nothing but
//   count; kForever: all; skip(in, clocks), clocks <= quiet(in): what that many step(in) do, in closed form.
// chip::Chip joins them; advance.hpp is the loop around it.
#pragma once

#include <cstdint>

namespace meltstage::chip {
inline constexpr std::uint64_t kForever = ~std::uint64_t{0};
}

#define TC_DECLARE_FLOP(type, name, width, reset) type name = reset;
#define TC_DECLARE_ARRAY(type, name, count, width) std::array<type, count> name{};
