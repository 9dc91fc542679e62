// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/files/waveforms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <string_view>
#include <utility>

namespace meltstage::dft {

namespace {

constexpr std::size_t kMostDefects = 100;
constexpr std::size_t kMostShown = 6;  // events in a message

std::optional<PinWave> input_wave(std::span<const PinEvent> events) {
  bool from_low = false;  // or from what the cycle before left
  while (events.size() > 1 && events.front().state == 'P') events = events.subspan(1), from_low = true;
  if (events.empty()) return std::nullopt;
  const auto all = [&](std::string_view states) {
    return std::all_of(events.begin(), events.end(),
                       [&](const PinEvent& e) { return states.find(e.state) != std::string_view::npos; });
  };
  const double first_ns = events.front().ns;
  if (all("D")) return PinWave{'0', first_ns, first_ns};
  if (all("U")) return PinWave{'1', first_ns, first_ns};
  if (all("NZX")) return PinWave{'N', first_ns, first_ns};
  if (events.size() == 3 && events.front().state == 'D') events = events.subspan(1), from_low = true;
  if (from_low && events.size() == 2 && events[0].state == 'U' && events[1].state == 'D' &&
      events[0].ns < events[1].ns)
    return PinWave{'P', events[0].ns, events[1].ns};
  return std::nullopt;
}

std::optional<PinWave> output_wave(std::span<const PinEvent> events, double period_ns) {
  std::optional<PinWave> wave;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const char state = events[i].state;
    if (state == 'X' || state == 'x') continue;
    if (state == 'Z' && !wave) continue;  // the tester's driver goes off, as for a pin of both directions
    const bool compares = std::string_view("HLThlt").find(state) != std::string_view::npos;
    if (!compares || wave) return std::nullopt;
    const bool lasts = std::islower(static_cast<unsigned char>(state)) != 0;
    const double end_ns = !lasts ? events[i].ns : i + 1 == events.size() ? period_ns : events[i + 1].ns;
    wave = {static_cast<char>(std::toupper(static_cast<unsigned char>(state))), events[i].ns, end_ns};
  }
  return wave ? wave : PinWave{'X', 0, 0};
}

// What a letter may do, and how a message says it.
struct Meaning {
  char letter;
  bool of_input;
  std::string_view states, expected;
};
constexpr Meaning kMeanings[] = {
    {'0', true, "0", "the low level, D"},   {'1', true, "1P", "the high level, U, or one pulse: D, U, D"},
    {'P', true, "P", "one pulse: D, U, D"}, {'H', false, "H", "one strobe, H"},
    {'L', false, "L", "one strobe, L"},     {'X', false, "X", "no strobe"}};
constexpr Meaning kAnyInput = {'\0', true, "01PN", "one level, or one pulse: D, U, D"};
constexpr Meaning kAnyOutput = {'\0', false, "LHTX", "one strobe, H or L, or none"};

const Meaning& meaning_of(char letter, bool is_input) {
  for (const Meaning& meaning : kMeanings) {
    if (meaning.letter == letter && meaning.of_input == is_input) return meaning;
  }
  return is_input ? kAnyInput : kAnyOutput;
}

std::string shown(std::span<const PinEvent> events) {
  std::string text;
  for (const PinEvent& event : events.first(std::min(events.size(), kMostShown)))
    text += fmt::format("{}{} at {} ns", text.empty() ? "" : ", ", event.state, event.ns);
  if (events.size() > kMostShown) text += " ...";
  return text.empty() ? "no event" : text;
}

}  // namespace

std::optional<PinWave> wave_of(std::span<const PinEvent> events, bool is_input, double period_ns) {
  return is_input ? input_wave(events) : output_wave(events, period_ns);
}

std::optional<char> UsedWaveforms::add(char letter, const std::string& what, std::size_t where,
                                       std::span<const PinEvent> events, bool is_input, double period_ns,
                                       const void* table) {
  const std::optional<PinWave> wave = wave_of(events, is_input, period_ns);
  const Meaning& meaning = meaning_of(letter, is_input);
  if (!wave || meaning.states.find(wave->state) == std::string_view::npos) {
    if (shapeless_.size() < kMostDefects)
      shapeless_.push_back(
          {where, fmt::format("{}: {}", what, shown(events)), std::string(meaning.expected)});
    return std::nullopt;
  }
  const auto keep = [&](std::optional<Edge>& kept, double ns, const auto& before) {
    if (!kept || before(ns, kept->ns)) kept = Edge{ns, what, where};
  };
  if (wave->state == 'P') {
    keep(rise_, wave->from_ns, std::less<>());
    keep(fall_, wave->to_ns, std::greater<>());
    std::vector<Pulse>& pulses = pulses_[table];
    if (std::none_of(pulses.begin(), pulses.end(), [&](const Pulse& pulse) {
          return pulse.rise.ns == wave->from_ns && pulse.fall_ns == wave->to_ns;
        }))
      pulses.push_back({{wave->from_ns, what, where}, wave->to_ns});
  } else if (is_input) {
    keep(drive_, wave->from_ns, std::greater<>());
  } else if (wave->state != 'X') {
    keep(strobe_, wave->from_ns, std::less<>());
    keep(strobe_end_, wave->to_ns, std::greater<>());
  }
  return wave->state;
}

void UsedWaveforms::set(TestTiming& timing) const {
  for (const auto& [edge, into] : {std::pair{&drive_, &timing.drive_ns},
                                   {&strobe_, &timing.strobe_ns},
                                   {&rise_, &timing.clock_rise_ns},
                                   {&fall_, &timing.clock_fall_ns}}) {
    if (*edge) *into = (*edge)->ns;
  }
}

std::vector<UsedWaveforms::Defect> UsedWaveforms::defects() const {
  std::vector<Defect> result = shapeless_;
  const auto in_order = [&](const std::optional<Edge>& edge, const char* does,
                            const std::optional<Edge>& other, bool is_before, const char* other_does) {
    if (!edge || !other || (is_before ? edge->ns < other->ns : edge->ns > other->ns)) return;
    result.push_back({edge->where, fmt::format("{}: {} at {} ns", edge->what, does, edge->ns),
                      fmt::format("it {} {} ({}: {} ns)", is_before ? "before" : "behind", other_does,
                                  other->what, other->ns)});
  };
  in_order(drive_, "driven", rise_, true, "the clock's pulse");
  in_order(strobe_, "compared", drive_, false, "the last drive edge");
  in_order(strobe_end_, "compared", rise_, true, "the clock's pulse");
  for (const auto& [table, pulses] : pulses_) {
    if (pulses.size() < 2) continue;
    const Pulse &first = pulses[0], &other = pulses[1];
    result.push_back({other.rise.where,
                      fmt::format("{}: high from {} to {} ns", other.rise.what, other.rise.ns, other.fall_ns),
                      fmt::format("one time for all clocks of a cycle ({}: {} to {} ns)", first.rise.what,
                                  first.rise.ns, first.fall_ns)});
  }
  return result;
}

}  // namespace meltstage::dft
