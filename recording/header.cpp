// SPDX-License-Identifier: Apache-2.0
#include "recording/header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

namespace meltstage::recording {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

void require(bool condition, const std::string& message) {
  if (!condition) throw std::invalid_argument("vector header: " + message);
}

void validate(const Pin& pin) {
  require(is_identifier(pin.name),
          fmt::format("pin name \"{}\": expected an identifier of at most {} characters", pin.name,
                      kMaxNameBytes));
  require(is_identifier(pin.owner),
          fmt::format("owner \"{}\" of pin {}: expected an identifier of at most {} characters", pin.owner,
                      pin.name, kMaxNameBytes));
  require(pin.width >= 1 && pin.width <= 64,
          fmt::format("width {} of pin {}: expected 1 to 64 bits", pin.width, pin.name));
}

}  // namespace

std::string_view to_string(Direction direction) {
  switch (direction) {
    case Direction::in:
      return "in";
    case Direction::out:
      return "out";
    case Direction::inout:
      return "inout";
  }
  throw std::invalid_argument("vector header: direction is none of in, out, inout");
}

bool is_identifier(std::string_view text) {
  return !text.empty() && text.size() <= kMaxNameBytes && !is_digit(text.front()) &&
         std::all_of(text.begin(), text.end(),
                     [](char c) { return is_letter(c) || is_digit(c) || c == '_'; });
}

bool is_meta_key(std::string_view text) {
  return !text.empty() && text.size() <= kMaxNameBytes && std::all_of(text.begin(), text.end(), [](char c) {
    return is_letter(c) || is_digit(c) || c == '_' || c == '.' || c == '-';
  });
}

bool is_valid_clock(double clock_hz) { return clock_hz >= kMinClock_hz && clock_hz <= kMaxClock_hz; }

void validate(const Header& header) {
  require(!header.pins.empty() && header.pins.size() <= kMaxPins,
          fmt::format("{} pins: expected 1 to {}", header.pins.size(), kMaxPins));
  std::set<std::string_view> names;
  for (const Pin& pin : header.pins) {
    validate(pin);
    to_string(pin.direction);
    require(names.insert(pin.name).second,
            fmt::format("pin {} stands twice: expected unique names", pin.name));
  }
  require(is_valid_clock(header.clock_hz),
          fmt::format("clock {} Hz: expected {} to {} Hz", header.clock_hz, kMinClock_hz, kMaxClock_hz));
  require(!header.origin.empty() && header.origin.size() <= kMaxStringBytes,
          fmt::format("origin of {} bytes: expected 1 to {}", header.origin.size(), kMaxStringBytes));
  for (const auto& [key, value] : header.meta) {
    require(is_meta_key(key), fmt::format("meta key \"{}\": expected letters, digits, '_', '.', '-'", key));
    require(value.size() <= kMaxStringBytes,
            fmt::format("meta {} of {} bytes: expected at most {}", key, value.size(), kMaxStringBytes));
  }
}

std::optional<std::uint32_t> find_pin(const Header& header, std::string_view name) {
  const auto found =
      std::find_if(header.pins.begin(), header.pins.end(), [&](const Pin& p) { return p.name == name; });
  if (found == header.pins.end()) return std::nullopt;
  return static_cast<std::uint32_t>(found - header.pins.begin());
}

}  // namespace meltstage::recording
