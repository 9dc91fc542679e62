// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/fault_crosses.hpp"

#include <fmt/format.h>

namespace meltstage::tb {

namespace spec = chip::spec;

void FaultCrosses::observe(const chip::Chip& before, const chip::Chip& after) {
  const std::uint16_t stood = before.guard.fault_q;
  const auto latched = static_cast<std::uint16_t>(after.guard.fault_q & ~unsigned{stood});
  if (latched == 0) return;
  for (std::size_t i = 0; i < spec::kStates.size(); ++i)
    if (spec::kStates[i].code == before.sysctrl.state_q) in_state[i] |= latched;
  for (unsigned fault = 0; fault < spec::kFaultCount; ++fault) {
    if ((latched >> fault & 1) != 0) at_once[fault] |= latched;
    if ((stood >> fault & 1) != 0) while_stands[fault] |= latched;
  }
}

void FaultCrosses::add(const FaultCrosses& other) {
  for (std::size_t i = 0; i < in_state.size(); ++i) in_state[i] |= other.in_state[i];
  for (std::size_t i = 0; i < at_once.size(); ++i) {
    at_once[i] |= other.at_once[i];
    while_stands[i] |= other.while_stands[i];
  }
}

std::vector<std::string> FaultCrosses::holes() const {
  std::vector<std::string> list;
  const auto want = [&](std::uint16_t met, unsigned fault, std::string what) {
    if ((met >> fault & 1) == 0) list.push_back(std::move(what));
  };
  for (unsigned fault = 0; fault < spec::kFaultCount; ++fault) {
    const auto name = spec::kFaults[fault].name;
    for (std::size_t i = 0; i < spec::kStates.size(); ++i)
      want(in_state[i], fault, fmt::format("fault {} in state {}", name, spec::kStates[i].name));
    for (unsigned other = 0; other < spec::kFaultCount; ++other) {
      const auto beside = spec::kFaults[other].name;
      if (other > fault)
        want(at_once[fault], other, fmt::format("faults {} and {} in one clock", name, beside));
      if (other != fault)
        want(while_stands[other], fault, fmt::format("fault {} while {} stands", name, beside));
    }
  }
  return list;
}

}  // namespace meltstage::tb
