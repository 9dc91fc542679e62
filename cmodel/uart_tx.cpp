// SPDX-License-Identifier: Apache-2.0
#include "uart_tx.hpp"

#include "math.hpp"

namespace meltstage::chip {
namespace {

// What follows the character being sent.
enum Next : std::uint8_t { kNextData = 0, kNextCrcLow = 1, kNextCrcHigh = 2, kNextEnd = 3 };

constexpr std::uint16_t kMark = 0x7FF;
constexpr std::uint8_t kLeadBits = 3;

}  // namespace

void UartTx::step(const UartTxIn& in, std::uint16_t baud, std::uint8_t format) {
  take_q = 0;
  if (busy_q == 0) {
    if (in.valid) {
      busy_q = 1;
      acc_q = 0;
      tick_q = 0;
      bits_q = kLeadBits - 1;
      next_q = kNextData;
      crc_q = 0xFFFF;
    }
    return;
  }
  const BaudStep next = baud_step(acc_q, baud);
  acc_q = next.acc;
  if (!next.tick) return;
  tick_q = (tick_q + 1u) & 15u;
  if (tick_q != 0) return;
  if (bits_q == 0) {
    next_char(in, format);
  } else {
    --bits_q;
    shift_q = static_cast<std::uint16_t>(0x400u | shift_q >> 1);
  }
}

std::uint64_t UartTx::quiet(std::uint16_t baud) const {
  return busy_q == 0 ? kForever : clocks_to_tick(acc_q, baud, 16u - tick_q);
}

void UartTx::skip(std::uint16_t baud, std::uint64_t clocks) {
  if (busy_q == 0) return;
  const BaudRun run = baud_run(acc_q, baud, clocks);
  acc_q = run.acc;
  tick_q = static_cast<std::uint8_t>(tick_q + run.ticks);
}

void UartTx::next_char(const UartTxIn& in, std::uint8_t format) {
  std::uint8_t byte = in.data;
  if (next_q == kNextCrcLow)
    byte = static_cast<std::uint8_t>(crc_q & 0xFFu);
  else if (next_q == kNextCrcHigh)
    byte = static_cast<std::uint8_t>(crc_q >> 8);

  bits_q = static_cast<std::uint8_t>(char_bits(format) - 1u);
  shift_q = static_cast<std::uint16_t>(0x400u | ninth_bit(format, byte) << 9 | byte << 1);
  switch (next_q) {
    case kNextData:
      take_q = 1;
      crc_q = crc16_byte(crc_q, in.data);
      if (in.last) next_q = kNextCrcLow;
      break;
    case kNextCrcLow:
      next_q = kNextCrcHigh;
      break;
    case kNextCrcHigh:
      next_q = kNextEnd;
      break;
    default:
      busy_q = 0;
      shift_q = kMark;
      break;
  }
}

}  // namespace meltstage::chip
