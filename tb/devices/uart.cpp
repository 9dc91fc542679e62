// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/uart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "cmodel/spec.hpp"

namespace meltstage::tb {
namespace {

bool parity_bit(unsigned data, UartParity parity) {
  const bool odd_ones = (std::popcount(data) & 1) != 0;
  return parity == UartParity::even ? odd_ones : !odd_ones;
}

void check_line(const UartLine& line) {
  if (std::isfinite(line.bit_cycles()) && line.bit_cycles() >= 2.0) return;
  throw std::invalid_argument(fmt::format("UART: {} baud at a {} Hz clock, expected at least 2 clocks a bit",
                                          line.baud, line.clock_hz));
}

}  // namespace

UartFormat uart_format(std::uint16_t format_register) {
  namespace spec = chip::spec;
  const spec::CharacterInfo& character =
      spec::kCharacters[spec::field_of(format_register, spec::kFormatCharacterMask)];
  const UartParity parity = character.parity == 'E'   ? UartParity::even
                            : character.parity == 'O' ? UartParity::odd
                                                      : UartParity::none;
  return {parity, character.stop_bits};
}

UartTransmitter::UartTransmitter(const UartLine& line, const UartTiming& timing, Rng jitter)
    : line_(line),
      timing_(timing),
      jitter_(jitter),
      bit_cycles_(line.bit_cycles() / (1.0 + timing.baud_error_ratio)) {
  check_line(line);
  if (!(timing.jitter_bits >= 0.0 && timing.jitter_bits < 0.5)) {
    throw std::invalid_argument(
        fmt::format("UART: jitter_bits is {}, expected 0 <= jitter < 0.5", timing.jitter_bits));
  }
}

void UartTransmitter::send(const UartChar& character) {
  queue_.push_back(character);
  if (!sending_) next_event_ = 0;
}

void UartTransmitter::glitch(std::uint64_t cycle, std::uint64_t length_cycles) {
  const Glitch glitch{cycle, cycle + length_cycles};
  const auto later = [](const Glitch& a, const Glitch& b) { return a.begin < b.begin; };
  glitches_.insert(std::upper_bound(glitches_.begin(), glitches_.end(), glitch, later), glitch);
  next_event_ = std::min(next_event_, cycle);
}

void UartTransmitter::load(double start_cycle) {
  const UartChar character = queue_.front();
  queue_.pop_front();
  frame_bits_ = static_cast<unsigned>(character.data) << 1;
  int used = 9;
  if (line_.format.parity != UartParity::none) {
    const bool parity = parity_bit(character.data, line_.format.parity) != character.wrong_parity;
    frame_bits_ |= (parity ? 1U : 0U) << used++;
  }
  if (!character.missing_stop) frame_bits_ |= ((1U << line_.format.stop_bits) - 1U) << used;
  start_cycle_ = start_cycle + character.gap_bits * bit_cycles_;
  sending_ = true;
  edge_ = 0;
  schedule_edge();
}

void UartTransmitter::schedule_edge() {
  const double jitter =
      timing_.jitter_bits > 0.0 ? (2.0 * jitter_.uniform() - 1.0) * timing_.jitter_bits * bit_cycles_ : 0.0;
  const double at = start_cycle_ + edge_ * bit_cycles_ + jitter;
  edge_cycle_ = at <= 0.0 ? 0 : static_cast<std::uint64_t>(std::llround(at));
}

void UartTransmitter::advance(std::uint64_t cycle) {
  if (!sending_ && !queue_.empty()) load(static_cast<double>(cycle));
  while (edge_cycle_ <= cycle) {
    if (edge_ < line_.format.bits()) {
      line_level_ = (frame_bits_ >> edge_ & 1U) != 0;
      ++edge_;
      schedule_edge();
      continue;
    }
    line_level_ = true;
    last_end_cycle_ = edge_cycle_;
    sending_ = false;
    edge_cycle_ = kNoEvent;
    if (!queue_.empty()) load(start_cycle_ + line_.format.bits() * bit_cycles_);
  }
  while (!glitches_.empty() && glitches_.front().end <= cycle) glitches_.pop_front();
  const bool inverted = !glitches_.empty() && glitches_.front().begin <= cycle;
  level_ = line_level_ != inverted;
  next_event_ = edge_cycle_;
  if (!glitches_.empty()) {
    next_event_ = std::min(next_event_, inverted ? glitches_.front().end : glitches_.front().begin);
  }
}

UartReceiver::UartReceiver(const UartLine& line) : line_(line) { check_line(line); }

std::optional<UartByte> UartReceiver::take() {
  if (received_.empty()) return std::nullopt;
  const UartByte byte = received_.front();
  received_.pop_front();
  return byte;
}

void UartReceiver::advance(std::uint64_t cycle, bool level) {
  while (next_event_ < cycle) sample(level_);
  const bool fell = level_ && !level;
  level_ = level;
  if (next_event_ == cycle) {
    sample(level);
  } else if (fell && !receiving()) {
    start_cycle_ = cycle;
    bit_ = 0;
    bits_ = 0;
    next_event_ = cycle + static_cast<std::uint64_t>(0.5 * line_.bit_cycles());
  }
}

void UartReceiver::sample(bool level) {
  if (bit_ == 0 && level) {
    ++false_starts_;
    next_event_ = kNoEvent;
    return;
  }
  bits_ |= (level ? 1U : 0U) << bit_++;
  const int checked =
      line_.format.bits() - line_.format.stop_bits + 1;  // a receiver looks at one stop bit only
  if (bit_ < checked) {
    next_event_ = start_cycle_ + static_cast<std::uint64_t>((bit_ + 0.5) * line_.bit_cycles());
    return;
  }
  const auto data = static_cast<std::uint8_t>(bits_ >> 1);
  const UartParity parity = line_.format.parity;
  const bool parity_error =
      parity != UartParity::none && (bits_ >> 9 & 1U) != (parity_bit(data, parity) ? 1U : 0U);
  received_.push_back({data, parity_error, !level, start_cycle_,
                       start_cycle_ + static_cast<std::uint64_t>(std::llround(line_.char_cycles()))});
  next_event_ = kNoEvent;
}

}  // namespace meltstage::tb
