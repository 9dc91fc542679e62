// SPDX-License-Identifier: Apache-2.0
// Numbers of a person's file.
#pragma once

#include <charconv>
#include <concepts>
#include <optional>
#include <string_view>

namespace meltstage {

/// The whole text as a number from `least` to `most`, whatever the locale. Nothing for any other text: of no
/// number, of one with something behind it, of inf or nan, of one out of range.
template <class Number>
requires std::integral<Number> || std::floating_point<Number> std::optional<Number> number_in(
    std::string_view text, Number least, Number most) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [stop, problem] = std::from_chars(text.data(), end, value);
  if (problem != std::errc() || stop != end || !(value >= least && value <= most)) return std::nullopt;
  return value;
}

}  // namespace meltstage
