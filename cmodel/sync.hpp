// SPDX-License-Identifier: Apache-2.0
// The cells tc_sync and tc_rst_sync.
#pragma once

#include <cstdint>

#include "flops.hpp"

namespace meltstage::chip {

// The chip's two-flop synchroniser, all eight asynchronous pins side by side; rtl/tc_sync.sv as tc_top uses
// it. Only the serial line (bit 0) idles high.
#define TC_SYNC_FLOPS(X)         \
  X(std::uint8_t, stage_q, 8, 1) \
  X(std::uint8_t, out_q, 8, 1)

struct Sync {
  TC_SYNC_FLOPS(TC_DECLARE_FLOP)

  // One rising clock edge; `pins` is the level before it.
  constexpr void step(std::uint8_t pins) {
    out_q = stage_q;
    stage_q = pins;
  }
  constexpr std::uint8_t q() const { return out_q; }

  // Levels of one pin as the blocks see them in the next clock, the one after, and all later ones.
  struct Seen {
    bool first;
    bool second;
    bool later;
  };
  constexpr Seen seen(std::uint8_t pins, unsigned bit) const {
    return {(out_q >> bit & 1) != 0, (stage_q >> bit & 1) != 0, (pins >> bit & 1) != 0};
  }

  // Clocks in which the blocks see what they see now, of the pins in `watched`.
  constexpr std::uint64_t quiet(std::uint8_t pins, std::uint8_t watched) const {
    if (((stage_q ^ out_q) & watched) != 0) return 1;
    return ((pins ^ out_q) & watched) != 0 ? 2 : kForever;
  }
  constexpr void skip(std::uint8_t pins, std::uint64_t clocks) {
    step(pins);
    if (clocks > 1) step(pins);
  }
};

// Reset synchroniser, twin of rtl/tc_rst_sync.sv.
#define TC_RST_SYNC_FLOPS(X)     \
  X(std::uint8_t, stage_q, 1, 0) \
  X(std::uint8_t, out_q, 1, 0)

struct RstSync {
  TC_RST_SYNC_FLOPS(TC_DECLARE_FLOP)

  // The reset pin fell: the output falls without a clock.
  constexpr void assert_reset() { stage_q = out_q = 0; }
  // One rising clock edge with the reset pin high.
  constexpr void step() {
    out_q = stage_q;
    stage_q = 1;
  }
  // Level of the chip's reset, active low.
  constexpr bool rst_n() const { return out_q != 0; }
};

}  // namespace meltstage::chip
