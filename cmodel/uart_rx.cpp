// SPDX-License-Identifier: Apache-2.0
#include "uart_rx.hpp"

#include <algorithm>

#include "spec.hpp"
#include "uart_line.hpp"

namespace meltstage::chip {
namespace {

// tick_q counts the ticks gone by in this bit: the n-th tick comes while tick_q is n - 1.
constexpr std::uint8_t kFirstSample = 6;
constexpr std::uint8_t kSecondSample = 7;
constexpr std::uint8_t kThirdSample = 8;

constexpr std::uint16_t kGapTicks = 576;    // 3.5 characters of 11 bits, less 2.5 bits
constexpr std::uint16_t kGapTicks10 = 520;  // the same of 10 bits
constexpr std::uint16_t kStopRest = 8;      // from the middle of the stop bit to its end
constexpr std::uint16_t kSecondStop = 16;
constexpr std::uint16_t kQuietClocks = spec::kClkHz / 4000 * 7;  // 1.75 ms: 4000 Hz is 0.25 ms

constexpr std::uint16_t ticks_from_stop_to_gap(std::uint8_t format) {
  if (format == spec::kFormat8N2) return kGapTicks + kStopRest + kSecondStop;
  return (char_bits(format) == 10 ? kGapTicks10 : kGapTicks) + kStopRest;
}

}  // namespace

void UartRx::step(std::uint8_t rx, std::uint16_t baud, std::uint8_t format, bool pause) {
  valid_q = 0;
  const std::uint8_t state = state_q;
  // Silence is counted, also under a start bit not yet sure.
  const bool listening = state == kIdle || state == kStart;
  if (listening && quiet_q != 0) --quiet_q;

  bool judged = false;
  std::uint8_t level = 0;
  if (state != kIdle || gap_q != 0) {
    const BaudStep next = baud_step(acc_q, baud);
    acc_q = next.acc;
    if (next.tick) {
      // One or two samples are in high_q, the last is on the line. A stop bit is sure after two that are
      // high.
      level = (high_q & 2u) != 0 || ((high_q & 1u) != 0 && rx != 0);
      judged = tick_q == kThirdSample || (state == kStop && tick_q == kSecondSample && level != 0);
      sample(rx);
      if (listening && gap_q != 0) --gap_q;
    }
  }

  if (judged) {
    judge(level, format, pause);
  }
  if (state == kIdle) {
    if (rx == 0) {
      state_q = kStart;
      acc_q = 0;
      tick_q = 0;
    }
  } else if (state == kBreak) {
    if (rx != 0) state_q = kIdle;
  } else if (state != kStart && state != kData && state != kParity && state != kStop) {
    state_q = kIdle;
  }
}

// A tick: two samples are counted, the third is judged at once.
void UartRx::sample(std::uint8_t rx) {
  if (tick_q == kFirstSample)
    high_q = rx;
  else if (tick_q == kSecondSample)
    high_q = (high_q + rx) & 3u;
  tick_q = (tick_q + 1u) & 15u;
}

std::uint64_t UartRx::quiet(std::uint8_t rx, std::uint16_t baud) const {
  const auto before = [&](unsigned tick) {
    return clocks_to_tick(acc_q, baud, ((tick - tick_q) & 15u) + 1u);
  };
  const std::uint64_t silence = quiet_q != 0 ? quiet_q : kForever;
  switch (state_q) {
    case kIdle:
      if (rx == 0) return 0;
      // The clock that ends a silence only counts; the one after it sees the silence.
      if (gap_q == 0) return silence;
      return std::min(silence,
                      clocks_to_tick(acc_q, baud, gap_q < kGiveUpLeft ? gap_q : gap_q - kGiveUpLeft + 1u));
    case kStart:
    case kData:
    case kParity:
      return before(kThirdSample);
    case kStop:
      return std::min(before(kSecondSample), before(kThirdSample));
    case kBreak:
      return rx != 0 || !ticks_evenly(acc_q, baud) ? 0 : kForever;
    default:
      return 0;
  }
}

void UartRx::skip(std::uint8_t rx, std::uint16_t baud, std::uint64_t clocks) {
  const bool listening = state_q == kIdle || state_q == kStart;
  if (listening) quiet_q = static_cast<std::uint16_t>(quiet_q - std::min<std::uint64_t>(quiet_q, clocks));
  if (state_q == kIdle && gap_q == 0) return;
  const BaudRun run = baud_run(acc_q, baud, clocks);
  acc_q = run.acc;
  if (listening) gap_q = static_cast<std::uint16_t>(gap_q - std::min<std::uint64_t>(gap_q, run.ticks));
  // The last 16 ticks leave their samples, and end where they began; those before only move tick_q.
  if (run.ticks > 16) tick_q = static_cast<std::uint8_t>((tick_q + run.ticks) & 15u);
  for (unsigned i = 0; i < 16 && i < run.ticks; ++i) sample(rx);
}

// The bit that has just been sampled.
void UartRx::judge(std::uint8_t level, std::uint8_t format, bool pause) {
  switch (state_q) {
    case kStart:
      state_q = level != 0 ? kIdle : kData;
      bit_q = 0;
      parity_bad_q = 0;
      break;
    case kData:
      shift_q = static_cast<std::uint8_t>(level << 7 | shift_q >> 1);
      if (bit_q == 7) state_q = has_parity(format) ? kParity : kStop;
      bit_q = (bit_q + 1u) & 7u;
      break;
    case kParity:
      state_q = kStop;
      parity_bad_q = level != ninth_bit(format, shift_q);
      break;
    case kStop:
      state_q = level != 0 ? kIdle : kBreak;
      valid_q = 1;
      error_q = parity_bad_q | (level ^ 1u);
      gap_q = ticks_from_stop_to_gap(format);
      quiet_q = pause ? kQuietClocks : 0;
      break;
    default:
      break;
  }
}

}  // namespace meltstage::chip
