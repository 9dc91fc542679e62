// SPDX-License-Identifier: Apache-2.0
#include "app/live/reading.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "cmodel/spec.hpp"
#include "tb/pins/fault_sentence.hpp"

namespace meltstage::app::live {
namespace {

namespace spec = chip::spec;

std::vector<const host::Register*> registers_that(bool (*wanted)(const host::Register&)) {
  std::vector<const host::Register*> found;
  for (const host::Register& reg : host::registers())
    if (wanted(reg)) found.push_back(&reg);
  return found;
}

double value_of(std::span<const std::uint16_t> polled, spec::In reg) {
  return host::to_unit(*polled_registers()[reg], polled[reg]);
}

bool has(std::uint16_t status, spec::StatusBit bit) { return (status >> bit & 1U) != 0; }

std::vector<std::string_view> fault_list(std::uint16_t faults) {
  std::vector<std::string_view> names;
  for (std::size_t bit = 0; bit < spec::kFaults.size(); ++bit)
    if ((faults >> bit & 1U) != 0) names.push_back(spec::kFaults[bit].name);
  return names;
}

}  // namespace

std::span<const host::Register* const> polled_registers() {
  static const auto polled =
      registers_that([](const host::Register& reg) { return reg.address < spec::kTelemetryWords; });
  return polled;
}

std::span<const host::Register* const> readable_registers() {
  static const auto readable = registers_that([](const host::Register& reg) { return reg.readable; });
  return readable;
}

Sample sample_of(double time_s, std::span<const std::uint16_t> polled) {
  return {time_s,
          polled[spec::kInPv] == spec::kPvNone ? std::numeric_limits<double>::quiet_NaN()
                                               : value_of(polled, spec::kInPvFine),
          value_of(polled, spec::kInSpWork), value_of(polled, spec::kInDuty)};
}

std::string reading_json(double time_s, std::span<const std::uint16_t> polled) {
  const Sample sample = sample_of(time_s, polled);
  const std::uint16_t status = polled[spec::kInStatus];
  constexpr unsigned kStateMask = 0xFF;
  return nlohmann::json{
      {"time_s", time_s},
      {"temperature", sample.temperature_degc},  // NaN becomes null
      {"setpoint", sample.setpoint_degc},
      {"duty", sample.duty_percent},
      {"state", spec::state_name(static_cast<std::uint8_t>(polled[spec::kInFirstFault] & kStateMask))},
      {"run", has(status, spec::kStatusRun)},
      {"at_temperature", has(status, spec::kStatusAtTemperature)},
      {"locked", has(status, spec::kStatusLocked)},
      {"latched", fault_list(polled[spec::kInFault])},
      {"present", fault_list(polled[spec::kInCause])},
      {"watchdog_s", value_of(polled, spec::kInWdLeft)}}
      .dump();
}

std::uint16_t Registers::operator[](std::string_view name) const {
  const auto all = readable_registers();
  const auto at =
      std::find_if(all.begin(), all.end(), [&](const host::Register* reg) { return reg->name == name; });
  return at == all.end() ? std::uint16_t{0} : words_[static_cast<std::size_t>(at - all.begin())];
}

std::string Registers::json() const {
  nlohmann::json values;
  for (std::size_t i = 0; i < words_.size(); ++i) {
    const host::Register& reg = *readable_registers()[i];
    const std::string meaning = host::meaning(reg, words_[i]);
    values[std::string(reg.name)] = {host::value_text(reg, words_[i]), meaning};
  }
  return values.dump();
}

std::vector<std::string> Registers::faults() const {
  const tb::FaultRegisters registers{[&](spec::In reg) { return (*this)[spec::kInput[reg].name]; },
                                     [&](spec::Reg reg) { return (*this)[spec::kHolding[reg].name]; }, "Now"};
  const std::uint16_t latched = registers.input(spec::kInFault);
  const std::string first = tb::latched_fault(registers);
  std::vector<std::string> sentences;
  if (!first.empty()) sentences.push_back(first);
  for (std::size_t bit = 0; bit < spec::kFaults.size(); ++bit) {
    if ((latched >> bit & 1U) == 0) continue;
    std::string sentence = tb::fault_sentence(static_cast<spec::Fault>(bit), registers);
    if (sentence != first) sentences.push_back(std::move(sentence));
  }
  return sentences;
}

std::vector<std::string> Registers::changed_since(const Registers& before) const {
  std::vector<std::string> changed;
  for (std::size_t i = 0; i < words_.size(); ++i) {
    const host::Register& reg = *readable_registers()[i];
    if (reg.writable && words_[i] != before.words_[i])
      changed.push_back(fmt::format("{} {} -> {}{}{}", reg.name, host::value_text(reg, before.words_[i]),
                                    host::value_text(reg, words_[i]), reg.unit.empty() ? "" : " ", reg.unit));
  }
  return changed;
}

std::string is_now(const host::Register& reg, std::uint16_t word) {
  return fmt::format("{} is {}{}{}", reg.name, host::value_text(reg, word), reg.unit.empty() ? "" : " ",
                     reg.unit);
}

}  // namespace meltstage::app::live
