// SPDX-License-Identifier: Apache-2.0
// Values of registers and flops at which a comparison, a carry or a decoder could go wrong: just below a
// power of two, beside what the flop is compared with, one bit away from a command. docs/verify/mutation.md
#pragma once

#include <cstdint>
#include <vector>

#include "base/rng.hpp"
#include "cmodel/chip.hpp"
#include "tb/pins/flop_table.hpp"

namespace meltstage::tb {

// Any value of holding register `index`: as many small as large ones, often an end or the default.
std::uint16_t any_register_value(Rng& rng, unsigned index);

// What a flop may stand beside: the flops of its block, the holding registers that the block reads, and
// itself at another time.
struct Neighbours {
  const FlopBlock& flops;
  const std::vector<unsigned>& registers;
  const chip::Chip& another_time;
};

// Any value of `flop`, wider than it now and then: only its low bits count.
std::uint64_t any_value_of(Rng& rng, const Flop& flop, const Neighbours& beside, const chip::Chip& chip);

}  // namespace meltstage::tb
