// SPDX-License-Identifier: Apache-2.0
#include "host/register_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/place.hpp"
#include "cmodel/spec.hpp"
#include "host/errors.hpp"
#include "host/register_word.hpp"

namespace meltstage::host {

namespace {

namespace spec = chip::spec;

constexpr std::size_t kCount = spec::kInputCount + spec::kHoldingCount;

constexpr std::array<Register, kCount> make_registers() {
  std::array<Register, kCount> all{};
  for (std::size_t i = 0; i < spec::kInputCount; ++i) {
    const spec::InputInfo& r = spec::kInput[i];
    all[i] = {r.name, r.unit, static_cast<std::uint16_t>(i), r.scale, r.is_signed, true, false, 0, 0};
  }
  for (std::size_t i = 0; i < spec::kHoldingCount; ++i) {
    const spec::RegisterInfo& r = spec::kHolding[i];
    all[spec::kInputCount + i] = {r.name,  r.unit,      static_cast<std::uint16_t>(spec::kHoldingBase + i),
                                  r.scale, r.is_signed, r.readable,
                                  true,    r.min,       r.max};
  }
  return all;
}
constexpr std::array<Register, kCount> kRegisters = make_registers();

bool is(const Register& reg, spec::In input) { return reg.address == input; }

std::string capitals(std::string_view text) {
  std::string upper(text);
  std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) { return std::toupper(c); });
  return upper;
}

// Edits (insert, remove, replace a letter) from one word to the other (Levenshtein).
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] != b[j - 1] ? 1 : 0);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, replaced}));
    }
  }
  return row.back();
}

std::string near_names(std::string_view name) {
  constexpr std::size_t kShown = 3;
  std::vector<std::string_view> names;
  for (const Register& r : kRegisters) names.push_back(r.name);
  std::stable_sort(names.begin(), names.end(),
                   [&](std::string_view a, std::string_view b) { return edits(name, a) < edits(name, b); });
  names.resize(kShown);
  return fmt::format("{}", fmt::join(names, ", "));
}

bool has_bits(const Register& reg) {
  return is(reg, spec::kInStatus) || is(reg, spec::kInFault) || is(reg, spec::kInCause) ||
         is(reg, spec::kInFirstFault);
}

template <class Names>
std::string names_of_bits(std::uint16_t word, const Names& name_of, std::size_t count) {
  std::string text;
  for (std::size_t bit = 0; bit < count; ++bit) {
    if ((word >> bit & 1U) == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(name_of(bit));
  }
  return text;
}

}  // namespace

std::span<const Register> registers() { return kRegisters; }

const Register& find_register(std::string_view name) {
  const std::string wanted = capitals(name);
  for (const Register& r : kRegisters) {
    if (r.name == wanted) return r;
  }
  throw UserError(
      fmt::format("{}: found no register of that name, expected one of docs/chip/registers.md such as {}",
                  shown(name), near_names(wanted)));
}

bool is_no_value(const Register& reg, std::uint16_t raw) {
  return is(reg, spec::kInPv) && raw == spec::kPvNone;
}

double to_unit(const Register& reg, std::uint16_t raw) {
  return (reg.is_signed ? static_cast<double>(static_cast<std::int16_t>(raw)) : static_cast<double>(raw)) *
         reg.scale;
}

std::uint16_t to_raw(const Register& reg, double value) {
  if (!reg.writable) throw UserError(fmt::format("{}: is read only, expected a holding register", reg.name));
  const RegisterWord held = register_word(reg, value);
  if (!held.expected.empty())
    throw UserError(fmt::format("{}: found {:.9g}, expected {}", reg.name, value, held.expected));
  return held.word;
}

std::string value_text(const Register& reg, std::uint16_t raw) {
  if (has_bits(reg)) return fmt::format("0x{:04X}", raw);
  return fmt::format("{:.{}f}", to_unit(reg, raw), decimals(reg.scale));
}

std::string fault_names(std::uint16_t faults) {
  return names_of_bits(
      faults, [](std::size_t bit) { return spec::kFaults[bit].name; }, spec::kFaultCount);
}

std::string meaning(const Register& reg, std::uint16_t raw) {
  if (is(reg, spec::kInStatus))
    return names_of_bits(
        raw, [](std::size_t bit) { return spec::kStatusBits[bit]; }, spec::kStatusBits.size());
  if (is_no_value(reg, raw)) return "no sample yet";
  if (is(reg, spec::kInFault) || is(reg, spec::kInCause)) return raw == 0 ? "none" : fault_names(raw);
  if (is(reg, spec::kInFirstFault)) {
    const auto fault = spec::first_fault(raw);
    const std::string_view none = spec::field_of(raw, spec::kFirstFaultCodeMask) == 0 ? "none" : "unknown";
    const auto state = static_cast<std::uint8_t>(spec::field_of(raw, spec::kFirstFaultStateMask));
    return fmt::format("{}, state {}", fault ? spec::kFaults[*fault].name : none, spec::state_name(state));
  }
  return {};
}

}  // namespace meltstage::host
