// SPDX-License-Identifier: Apache-2.0
#include "base/place.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace meltstage {
namespace {

constexpr std::size_t kMostShown = 80;  // bytes of a file in a message

unsigned byte_at(std::string_view text, std::size_t at) {
  return at < text.size() ? static_cast<unsigned char>(text[at]) : 0U;
}

// Bytes of the character that begins the text; 0 when it is no UTF-8 (RFC 3629: neither overlong nor a
// surrogate).
std::size_t character_bytes(std::string_view text) {
  const unsigned first = byte_at(text, 0), second = byte_at(text, 1);
  const auto continues = [&](std::size_t at) { return (byte_at(text, at) & 0xC0U) == 0x80U; };
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return continues(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    const bool in_range =
        second >= (first == 0xE0 ? 0xA0U : 0x80U) && second <= (first == 0xED ? 0x9FU : 0xBFU);
    return in_range && continues(2) ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const bool in_range =
        second >= (first == 0xF0 ? 0x90U : 0x80U) && second <= (first == 0xF4 ? 0x8FU : 0xBFU);
    return in_range && continues(2) && continues(3) ? 4 : 0;
  }
  return 0;
}

// The control characters of ASCII, and U+0080 to U+009F, which a terminal obeys too.
bool is_control(std::string_view character) {
  const unsigned first = byte_at(character, 0);
  return first < 0x20 || first == 0x7F || (first == 0xC2 && byte_at(character, 1) < 0xA0);
}

}  // namespace

Place place_of(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, std::min(offset, text.size()));
  const std::size_t newline = before.rfind('\n');
  const auto lines = static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
  return {lines + 1, before.size() - (newline == std::string_view::npos ? 0 : newline + 1) + 1};
}

std::string escaped(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t size = character_bytes(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(size, 1));
    if (size != 0 && !is_control(character)) {
      result += character;
    } else {
      for (const char c : character) result += fmt::format("\\x{:02X}", static_cast<unsigned char>(c));
    }
    text.remove_prefix(character.size());
  }
  return result;
}

std::string shown(std::string_view text) {
  if (text.size() <= kMostShown) return escaped(text);
  std::size_t end = kMostShown;
  while (end > kMostShown - 3 && (byte_at(text, end) & 0xC0U) == 0x80U) --end;  // not inside a character
  return escaped(text.substr(0, end)) + "...";
}

std::string defect_at(std::string_view file, Place place, std::string_view found, std::string_view expected) {
  constexpr std::size_t kMostSaid = 300;  // bytes of either side, however much of a file they quote
  const auto said = [](std::string_view words) {
    return words.size() > kMostSaid ? escaped(words.substr(0, kMostSaid)) + "..." : escaped(words);
  };
  return fmt::format("{}:{}:{}: found {}, expected {}", file, place.line, place.column, said(found),
                     said(expected));
}

}  // namespace meltstage
