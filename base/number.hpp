// SPDX-License-Identifier: Apache-2.0
// Numbers of a person's file.
#pragma once

#include <cerrno>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

namespace meltstage {

namespace detail {

// std::from_chars; LLVM's C++ library of version 14 has it for whole numbers alone. What runs with that has
// no locale but C.
template <class Number>
std::from_chars_result from_text(const char* begin, const char* end, Number& value) {
#ifndef __cpp_lib_to_chars
  if constexpr (std::floating_point<Number>) {
    const std::string text(begin, end);
    char* stop = nullptr;
    errno = 0;
    value = std::strtod(text.c_str(), &stop);
    const bool decimal = text.find_first_not_of("0123456789.eE+-") == text.npos && !text.starts_with('+');
    if (!decimal || stop == text.c_str()) return {begin, std::errc::invalid_argument};
    if (errno == ERANGE) return {begin, std::errc::result_out_of_range};
    return {begin + (stop - text.c_str()), std::errc()};
  } else
#endif
    return std::from_chars(begin, end, value);
}

}  // namespace detail

/// The whole text as a number from `least` to `most`, whatever the locale. Nothing for any other text: of no
/// number, of one with something behind it, of inf or nan, of one out of range.
template <class Number>
requires std::integral<Number> || std::floating_point<Number> std::optional<Number> number_in(
    std::string_view text, Number least, Number most) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [stop, problem] = detail::from_text(text.data(), end, value);
  if (problem != std::errc() || stop != end || !(value >= least && value <= most)) return std::nullopt;
  if constexpr (std::floating_point<Number>) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  return value;
}

}  // namespace meltstage
