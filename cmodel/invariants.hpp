// SPDX-License-Identifier: Apache-2.0
// What holds in every state that the chip reaches, and without which model and RTL need not agree: proved of
// both sides by induction (docs/verify/proof.md).
#pragma once

#include <cstdint>

#include "chip.hpp"

namespace meltstage::chip {

struct Invariants {
  std::uint8_t reset_ends_in_order;
  std::uint8_t telemetry_reads_alone;
  std::uint8_t frame_count_is_bounded;
  std::uint8_t product_steps_are_bounded;
};

// 1 for each that holds in this state, otherwise 0.
inline Invariants invariants_of(const Chip& chip) {
  const Uartc& uartc = chip.uartc;
  Invariants hold{};
  // RST_SYNC's second flop follows its first.
  hold.reset_ends_in_order = chip.rst_sync.out_q == 0 || chip.rst_sync.stage_q != 0;
  // UARTC reads one register a clock, and of a telemetry frame only those that can stand in one.
  hold.telemetry_reads_alone = uartc.rd_tlm_q == 0 || (uartc.rd_rsp_q == 0 && uartc.rd_addr_q < 32);
  // The counter of a frame's bytes stays at the first number that is too long.
  hold.frame_count_is_bounded = uartc.frame.count_q <= 257;
  // PWMC multiplies by a bit of the duty a clock.
  hold.product_steps_are_bounded = chip.pwmc.mul_left_q <= 17;
  return hold;
}

}  // namespace meltstage::chip
