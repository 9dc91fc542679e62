// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/register_ends.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace meltstage::tb {

namespace {

namespace spec = chip::spec;

struct End {
  RegisterEnd end;
  const char* name;
};
constexpr End kEnds[] = {{RegisterEnd::lowest, "at its lowest"},
                         {RegisterEnd::highest, "at its highest"},
                         {RegisterEnd::below, "below its lowest refused"},
                         {RegisterEnd::above, "above its highest refused"}};

constexpr std::uint8_t bit(RegisterEnd end) {
  return static_cast<std::uint8_t>(1u << static_cast<unsigned>(end));
}

std::int32_t highest(unsigned index) {
  const std::int32_t max = spec::kHolding[index].max;
  return index == spec::kRegSetpoint
             ? std::min(max, spec::kHolding[spec::kRegTMax].max - spec::kSetpointMargin)
             : max;
}

std::int32_t value_of(unsigned index, RegisterEnd end) {
  switch (end) {
    case RegisterEnd::lowest:
      return spec::kHolding[index].min;
    case RegisterEnd::highest:
      return highest(index);
    case RegisterEnd::below:
      return spec::kHolding[index].min - 1;
    case RegisterEnd::above:
      return highest(index) + 1;
  }
  return 0;
}

bool writes_one(const chip::Uartc& uart) {
  return uart.cmd_fc() == spec::kFcWriteSingle ||
         (uart.cmd_fc() == spec::kFcWriteMultiple && uart.cmd_b() == 1);
}

}  // namespace

std::optional<std::uint16_t> end_word(unsigned index, RegisterEnd end) {
  const bool is_signed = spec::kHolding[index].is_signed;
  const std::int32_t value = value_of(index, end);
  if (value < (is_signed ? INT16_MIN : 0) || value > (is_signed ? INT16_MAX : UINT16_MAX))
    return std::nullopt;
  return static_cast<std::uint16_t>(value);
}

void RegisterEnds::meet(unsigned index, RegisterEnd end, std::uint16_t word) {
  if (end_word(index, end) == word) met[index] |= bit(end);
}

void RegisterEnds::observe(const chip::Chip& now) {
  if (now.sysctrl.state_q == spec::kStWrParam && now.paramc.store()) {
    meet(now.paramc.index_q, RegisterEnd::lowest, now.paramc.value_q);
    meet(now.paramc.index_q, RegisterEnd::highest, now.paramc.value_q);
  }
  if (now.sysctrl.cmd_done_q == 0 || !writes_one(now.uartc) || now.paramc.rsp_kind_q != spec::kRspException ||
      now.paramc.rsp_exc_q != spec::kExcValue)
    return;
  const unsigned index = now.uartc.cmd_a() - spec::kHoldingBase;
  if (now.uartc.cmd_a() < spec::kHoldingBase || index == spec::kRegCmd || index >= spec::kHoldingCount)
    return;
  const bool single = now.uartc.cmd_fc() == spec::kFcWriteSingle;
  const std::uint16_t word = single ? now.uartc.cmd_b() : now.uartc.cmd_word(0);
  meet(index, RegisterEnd::below, word);
  meet(index, RegisterEnd::above, word);
}

void RegisterEnds::add(const RegisterEnds& other) {
  for (std::size_t i = 0; i < met.size(); ++i) met[i] |= other.met[i];
}

std::vector<std::string> RegisterEnds::holes() const {
  std::vector<std::string> list;
  for (unsigned index = spec::kRegCmd + 1u; index < spec::kHoldingCount; ++index)
    for (const auto& [end, name] : kEnds)
      if ((met[index] & bit(end)) == 0 && end_word(index, end))
        list.push_back(fmt::format("{} {}", spec::kHolding[index].name, name));
  return list;
}

}  // namespace meltstage::tb
