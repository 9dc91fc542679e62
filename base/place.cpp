// SPDX-License-Identifier: Apache-2.0
#include "base/place.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace meltstage {

namespace {

constexpr std::size_t kMostShown = 80;  // bytes of a file in a message

}  // namespace

Place place_of(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, offset);
  const std::size_t newline = before.rfind('\n');
  const auto lines = static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
  return {lines + 1, before.size() - (newline == std::string_view::npos ? 0 : newline + 1) + 1};
}

std::string shown(std::string_view text) {
  std::string result;
  for (const char c : text.substr(0, kMostShown)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F)
      result += fmt::format("\\x{:02X}", byte);
    else
      result += c;
  }
  return text.size() > kMostShown ? result + "..." : result;
}

std::string defect_at(std::string_view file, Place place, std::string_view found, std::string_view expected) {
  return fmt::format("{}:{}:{}: found {}, expected {}", file, place.line, place.column, found, expected);
}

}  // namespace meltstage
