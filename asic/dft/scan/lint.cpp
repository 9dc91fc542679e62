// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/lint.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <tuple>
#include <utility>

namespace meltstage::dft {

std::vector<std::string> lint(const CycleStream& stream, const TesterProfile& profile) {
  std::vector<std::string> reasons;
  const TestTiming& t = stream.timing;
  const auto complain = [&](std::string text) { reasons.push_back(stream.title + ": " + std::move(text)); };
  if (t.period_ns < profile.least_period_ns)
    complain(
        fmt::format("found a period of {} ns, expected {} ns or more", t.period_ns, profile.least_period_ns));
  const bool pulse = has_pulse(stream), strobe = has_strobe(stream);
  const std::tuple<const char*, bool, double> edges[] = {{"period", true, t.period_ns},
                                                         {"drive edge", true, t.drive_ns},
                                                         {"strobe", strobe, t.strobe_ns},
                                                         {"clock rise", pulse, t.clock_rise_ns},
                                                         {"clock fall", pulse, t.clock_fall_ns}};
  for (const auto& [what, is_there, ns] : edges) {
    if (!is_there) continue;
    const double steps = ns / profile.edge_resolution_ns;
    if (std::abs(steps - std::round(steps)) > 1e-6)
      complain(fmt::format("found the {} at {} ns, expected a multiple of {} ns", what, ns,
                           profile.edge_resolution_ns));
  }
  for (std::string& reason : disorders(stream)) reasons.push_back(std::move(reason));
  if (pulse && t.clock_fall_ns - t.clock_rise_ns < profile.least_pulse_ns)
    complain(fmt::format("found a clock pulse of {} ns, expected {} ns or more",
                         t.clock_fall_ns - t.clock_rise_ns, profile.least_pulse_ns));
  if (stream.signals.size() > profile.pins)
    complain(fmt::format("found {} pins, expected {} or fewer", stream.signals.size(), profile.pins));
  if (stream.cycles.size() > profile.vector_memory)
    complain(
        fmt::format("found {} vectors, expected {} or fewer", stream.cycles.size(), profile.vector_memory));
  std::uint64_t at = 0;
  for (std::size_t i = 0; i < stream.cycles.size(); at += stream.cycles[i++].count) {
    for (std::size_t s = 0; s < stream.signals.size(); ++s) {
      const char c = stream.cycles[i].states[s];
      const std::string_view known = stream.signals[s].is_input ? "01PN" : "HLX";
      if (known.find(c) == std::string_view::npos) {
        complain(fmt::format("cycle {}: found {} on {}, expected {}", at, c, stream.signals[s].name,
                             stream.signals[s].is_input ? "0, 1, P or N" : "H, L or X"));
        return reasons;
      }
    }
  }
  return reasons;
}

}  // namespace meltstage::dft
