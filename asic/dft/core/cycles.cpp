// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/cycles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/error.hpp"

namespace meltstage::dft {

bool is_plain_name(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return c > ' ' && c <= '~' && std::string_view("\"'\\%`").find(c) == std::string_view::npos;
  });
}

std::vector<std::uint8_t> ScanChain::inverses() const {
  std::vector<std::uint8_t> result(cells.size() + 1, 0);
  for (const std::size_t first : inversions) {
    for (std::size_t cell = first; cell < result.size(); ++cell) result[cell] ^= 1U;
  }
  return result;
}

bool leaves_inputs_open(const CycleStream& stream) {
  return std::any_of(stream.cycles.begin(), stream.cycles.end(), [&](const TestCycle& cycle) {
    for (std::size_t s = 0; s < cycle.states.size(); ++s)
      if (stream.signals[s].is_input && is_open_input(cycle.states[s])) return true;
    return false;
  });
}

CycleStream with_open_inputs(CycleStream stream, const std::function<char()>& level) {
  for (TestCycle& cycle : stream.cycles)
    for (std::size_t s = 0; s < cycle.states.size(); ++s)
      if (stream.signals[s].is_input && is_open_input(cycle.states[s])) cycle.states[s] = level();
  return stream;
}

std::uint64_t cycle_count(const CycleStream& stream) {
  std::uint64_t count = 0;
  for (const TestCycle& cycle : stream.cycles) count += cycle.count;
  return count;
}

CycleStream unrolled(CycleStream stream) {
  const std::uint64_t total = cycle_count(stream);
  if (total > std::min(kMostCycles, kMostStates / std::max<std::size_t>(1, stream.signals.size())))
    throw UserError(fmt::format("{}: found {} cycles of {} signals, expected at most {} cycles and {} states",
                                stream.title, total, stream.signals.size(), kMostCycles, kMostStates));
  std::vector<TestCycle> single;
  single.reserve(total);
  for (TestCycle& cycle : stream.cycles) {
    const std::uint64_t count = std::exchange(cycle.count, 1);
    single.push_back(cycle);
    cycle.label.clear();
    for (std::uint64_t i = 1; i < count; ++i) single.push_back(cycle);
  }
  stream.cycles = std::move(single);
  return stream;
}

namespace {

bool has_state(const CycleStream& stream, bool of_inputs, std::string_view states) {
  for (std::size_t s = 0; s < stream.signals.size(); ++s) {
    if (stream.signals[s].is_input != of_inputs) continue;
    for (const TestCycle& cycle : stream.cycles) {
      if (states.find(cycle.states[s]) != std::string_view::npos) return true;
    }
  }
  return false;
}

}  // namespace

bool has_pulse(const CycleStream& stream) { return has_state(stream, true, "P"); }
bool has_strobe(const CycleStream& stream) { return has_state(stream, false, "HL"); }

std::vector<std::string> disorders(const CycleStream& stream) {
  if (!stream.timing_defects.empty()) return stream.timing_defects;
  const TestTiming& t = stream.timing;
  const bool pulse = has_pulse(stream);
  std::vector<std::string> reasons;
  if (has_strobe(stream) && (t.strobe_ns <= t.drive_ns || (pulse && t.strobe_ns >= t.clock_rise_ns)))
    reasons.push_back(fmt::format(
        "{}: found the strobe at {} ns, expected it behind the drive edge ({} ns){}", stream.title,
        t.strobe_ns, t.drive_ns, pulse ? fmt::format(" and before the clock ({} ns)", t.clock_rise_ns) : ""));
  if (pulse && (t.drive_ns >= t.clock_rise_ns || t.clock_rise_ns >= t.clock_fall_ns))
    reasons.push_back(
        fmt::format("{}: found the drive edge at {} ns and the clock from {} to {} ns, expected these times "
                    "in this order",
                    stream.title, t.drive_ns, t.clock_rise_ns, t.clock_fall_ns));
  return reasons;
}

void require_levels(const CycleStream& stream) {
  std::uint64_t at = 0;
  for (const TestCycle& cycle : stream.cycles) {
    for (std::size_t s = 0; s < cycle.states.size(); ++s)
      if (!stream.signals[s].is_input && cycle.states[s] == 'T')
        throw UserError(fmt::format(
            "{}: cycle {}: found T on {}, expected H, L or X; a strobe for high impedance can't be "
            "run here",
            stream.title, at, stream.signals[s].name));
    at += cycle.count;
  }
}

void require_runnable(const CycleStream& stream) {
  const std::vector<std::string> reasons = disorders(stream);
  if (!reasons.empty()) throw UserError(reasons.front());
  require_levels(stream);
}

bool same_cycles(const CycleStream& a, const CycleStream& b) {
  if (a.signals != b.signals || a.timing != b.timing || cycle_count(a) != cycle_count(b)) return false;
  std::uint64_t left_a = 0, left_b = 0;
  for (std::size_t i = 0, k = 0;;) {
    if (i == a.cycles.size() || k == b.cycles.size()) return true;  // as many cycles: both end here
    if (a.cycles[i].states != b.cycles[k].states) return false;
    if (left_a == 0) left_a = a.cycles[i].count;
    if (left_b == 0) left_b = b.cycles[k].count;
    const std::uint64_t both = std::min(left_a, left_b);
    if ((left_a -= both) == 0) ++i;
    if ((left_b -= both) == 0) ++k;
  }
}

}  // namespace meltstage::dft
