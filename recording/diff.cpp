// SPDX-License-Identifier: Apache-2.0
#include "recording/diff.hpp"

#include <algorithm>
#include <limits>
#include <unordered_map>
#include <utility>

namespace meltstage::recording {
namespace {

constexpr std::uint32_t kNoPair = std::numeric_limits<std::uint32_t>::max();

/// A pin of both streams and since when its two values differ.
struct Pair {
  std::uint32_t pin_a;
  std::uint32_t pin_b;
  bool differs = false;
  std::uint64_t since = 0;
  std::uint64_t cycles = 0;
};

struct Pairing {
  std::vector<Pair> pairs;              // in a's order
  std::vector<std::uint32_t> of_pin_a;  // index into pairs, or no_pair
  std::vector<std::uint32_t> of_pin_b;
};

Pairing pair_pins(const Header& a, const Header& b, DiffReport& report) {
  Pairing pairing{{}, std::vector(a.pins.size(), kNoPair), std::vector(b.pins.size(), kNoPair)};
  std::unordered_map<std::string_view, std::uint32_t> pins_of_b;
  for (std::uint32_t pin = 0; pin < b.pins.size(); ++pin) pins_of_b.emplace(b.pins[pin].name, pin);
  for (std::uint32_t pin_a = 0; pin_a < a.pins.size(); ++pin_a) {
    const auto found = pins_of_b.find(a.pins[pin_a].name);
    if (found == pins_of_b.end() || b.pins[found->second].width != a.pins[pin_a].width) {
      report.only_in_a.push_back(a.pins[pin_a].name);
      continue;
    }
    pairing.of_pin_a[pin_a] = pairing.of_pin_b[found->second] =
        static_cast<std::uint32_t>(pairing.pairs.size());
    pairing.pairs.push_back({pin_a, found->second});
  }
  for (std::uint32_t pin_b = 0; pin_b < b.pins.size(); ++pin_b) {
    if (pairing.of_pin_b[pin_b] == kNoPair) report.only_in_b.push_back(b.pins[pin_b].name);
  }
  return pairing;
}

class Comparison {
 public:
  Comparison(const Stream& a, const Stream& b) : a_(a), b_(b), names_(a.header()) {
    report_.same_span = a.first_cycle() == b.first_cycle() && a.final_cycle() == b.final_cycle();
    pairing_ = pair_pins(a.header(), b.header(), report_);
    report_.pins_compared = pairing_.pairs.size();
  }

  DiffReport run(std::uint64_t start, std::uint64_t final) {
    a_.advance_to(start);
    b_.advance_to(start);
    for (std::uint32_t pair = 0; pair < pairing_.pairs.size(); ++pair) look_at(pair, start);
    for (auto cycle = next_event_cycle(); cycle && *cycle <= final; cycle = next_event_cycle()) {
      move(a_, pairing_.of_pin_a, *cycle);
      move(b_, pairing_.of_pin_b, *cycle);
      look_at_touched(*cycle);
    }
    close(final);
    report_.cycles_compared = final - start + 1;
    return std::move(report_);
  }

  DiffReport nothing_in_common() { return std::move(report_); }

 private:
  std::optional<std::uint64_t> next_event_cycle() const {
    const auto next_a = a_.next_event_cycle();
    const auto next_b = b_.next_event_cycle();
    if (!next_a || !next_b) return next_a ? next_a : next_b;
    return std::min(*next_a, *next_b);
  }

  void move(Cursor& cursor, const std::vector<std::uint32_t>& pair_of_pin, std::uint64_t cycle) {
    if (cursor.next_event_cycle() != cycle) return;
    cursor.next_event();
    for (const std::uint32_t pin : cursor.changed()) {
      if (pair_of_pin[pin] != kNoPair) touched_.push_back(pair_of_pin[pin]);
    }
  }

  void look_at_touched(std::uint64_t cycle) {
    // The first difference is the first pin in a's order, and b's pins may come in another.
    std::sort(touched_.begin(), touched_.end());
    for (const std::uint32_t pair : touched_) look_at(pair, cycle);
    touched_.clear();
  }

  void look_at(std::uint32_t index, std::uint64_t cycle) {
    Pair& pair = pairing_.pairs[index];
    const std::uint64_t value_a = a_.value(pair.pin_a);
    const std::uint64_t value_b = b_.value(pair.pin_b);
    if (pair.differs) pair.cycles += cycle - pair.since;
    pair.differs = value_a != value_b;
    pair.since = cycle;
    if (pair.differs && !report_.first)
      report_.first = {cycle, names_.pins[pair.pin_a].name, value_a, value_b};
  }

  void close(std::uint64_t final) {
    for (Pair& pair : pairing_.pairs) {
      if (pair.differs) pair.cycles += final - pair.since + 1;
      if (pair.cycles > 0) report_.pins.push_back({names_.pins[pair.pin_a].name, pair.cycles});
    }
  }

  Cursor a_;
  Cursor b_;
  const Header& names_;
  Pairing pairing_;
  std::vector<std::uint32_t> touched_;
  DiffReport report_;
};

}  // namespace

bool DiffReport::same() const {
  return !first && only_in_a.empty() && only_in_b.empty() && same_span && cycles_compared > 0 &&
         pins_compared > 0;
}

DiffReport diff(const Stream& a, const Stream& b) {
  Comparison comparison(a, b);
  const std::uint64_t start = std::max(a.first_cycle(), b.first_cycle());
  const std::uint64_t final = std::min(a.final_cycle(), b.final_cycle());
  return start <= final ? comparison.run(start, final) : comparison.nothing_in_common();
}

}  // namespace meltstage::recording
