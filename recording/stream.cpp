// SPDX-License-Identifier: Apache-2.0
#include "recording/stream.hpp"

#include <fmt/format.h>

#include <bit>
#include <stdexcept>

namespace meltstage::recording {
namespace {

/// LEB128, unsigned: seven bits a byte, low ones first, the top bit says that more follow.
std::uint8_t* put_number(std::uint8_t* at, std::uint64_t number) {
  while (number >= 0x80) {
    *at++ = static_cast<std::uint8_t>(number | 0x80);
    number >>= 7;
  }
  *at++ = static_cast<std::uint8_t>(number);
  return at;
}

}  // namespace

void Stream::begin(const Header& header) {
  check_.begin(header);
  header_ = header;
}

void Stream::change(const Change& change) {
  if (complete_) throw std::invalid_argument("vector stream: change after its end");
  check_.require(change);
  if (change_count_ == 0) first_cycle_ = previous_cycle_ = change.cycle;
  std::uint8_t packed[30];
  std::uint8_t* end = put_number(packed, change.cycle - previous_cycle_);
  end = put_number(end, change.pin);
  end = put_number(end, change.value);
  bytes_.insert(bytes_.end(), packed, end);
  previous_cycle_ = change.cycle;
  ++change_count_;
}

void Stream::end(std::uint64_t final_cycle) {
  if (complete_) throw std::invalid_argument("vector stream: ended twice");
  check_.require_end(final_cycle);
  final_cycle_ = final_cycle;
  complete_ = true;
}

ChangeReader::ChangeReader(const Stream& stream)
    : at_(stream.bytes_.data()), end_(at_ + stream.bytes_.size()), cycle_(stream.first_cycle_) {
  if (!stream.complete()) throw std::invalid_argument("vector stream: read before its end was recorded");
}

std::uint64_t ChangeReader::next_number() {
  std::uint64_t number = *at_ & 0x7f;
  for (unsigned shift = 7; (*at_++ & 0x80) != 0; shift += 7) {
    number |= static_cast<std::uint64_t>(*at_ & 0x7f) << shift;
  }
  return number;
}

bool ChangeReader::next(Change& change) {
  if (at_ == end_) return false;
  cycle_ += next_number();
  change.cycle = cycle_;
  change.pin = static_cast<std::uint32_t>(next_number());
  change.value = next_number();
  return true;
}

Cursor::Cursor(const Stream& stream)
    : reader_(stream),
      has_pending_(reader_.next(pending_)),
      cycle_(stream.first_cycle()),
      final_cycle_(stream.final_cycle()),
      values_(stream.header().pins.size()) {
  apply_pending();
}

std::optional<std::uint64_t> Cursor::next_event_cycle() const {
  return has_pending_ ? std::optional(pending_.cycle) : std::nullopt;
}

bool Cursor::step() {
  if (cycle_ == final_cycle_) return false;
  advance_to(cycle_ + 1);
  return true;
}

bool Cursor::next_event() {
  if (!has_pending_) return false;
  advance_to(pending_.cycle);
  return true;
}

void Cursor::advance_to(std::uint64_t cycle) {
  if (cycle < cycle_ || cycle > final_cycle_) {
    throw std::invalid_argument(fmt::format("vector cursor: cycle {}: expected {} (here) to {} (final)",
                                            cycle, cycle_, final_cycle_));
  }
  cycle_ = cycle;
  changed_.clear();
  apply_pending();
}

void Cursor::apply_pending() {
  while (has_pending_ && pending_.cycle <= cycle_) {
    values_[pending_.pin] = pending_.value;
    changed_.push_back(pending_.pin);
    has_pending_ = reader_.next(pending_);
  }
}

Recorder::Recorder(Sink& sink, const Header& header)
    : sink_(sink),
      values_(header.pins.size()),
      committed_(header.pins.size()),
      touched_((header.pins.size() + 63) / 64) {
  sink_.begin(header);
  // The first commit states every pin, set or not.
  for (std::size_t pin = 0; pin < values_.size(); ++pin) touched_[pin / 64] |= std::uint64_t{1} << (pin % 64);
}

void Recorder::commit_word(std::uint64_t cycle, std::size_t word) {
  for (std::uint64_t bits = touched_[word]; bits != 0; bits &= bits - 1) {
    const auto pin = static_cast<std::uint32_t>(word * 64 + std::countr_zero(bits));
    if (!first_ && values_[pin] == committed_[pin]) continue;  // set and set back before the commit
    committed_[pin] = values_[pin];
    sink_.change({cycle, pin, values_[pin]});
  }
  touched_[word] = 0;
  if (word + 1 == touched_.size()) first_ = false;
}

void copy(const Stream& stream, Sink& sink) {
  ChangeReader reader(stream);
  sink.begin(stream.header());
  for (Change change; reader.next(change);) sink.change(change);
  sink.end(stream.final_cycle());
}

}  // namespace meltstage::recording
