// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/text_encoding.hpp"

#include <fmt/format.h>
#include <iconv.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <system_error>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {
namespace {

using namespace std::string_view_literals;

/// `ended_at`: how many bytes were read; less than all where one of them does not fit the encoding.
struct Conversion {
  std::string text;
  std::size_t ended_at = 0;
};

Conversion convert(std::string_view content, const char* encoding) {
  const iconv_t converter = iconv_open("UTF-8", encoding);
  if (converter == reinterpret_cast<iconv_t>(-1))
    throw std::system_error(errno, std::generic_category(), encoding);
  Conversion result;
  char* in = const_cast<char*>(content.data());  // iconv() reads it only
  std::size_t left = content.size();
  for (bool ended = false; !ended;) {
    std::array<char, 4096> part;
    char* out = part.data();
    std::size_t room = part.size();
    ended = iconv(converter, &in, &left, &out, &room) != static_cast<std::size_t>(-1) || errno != E2BIG;
    result.text.append(part.data(), out);
  }
  iconv_close(converter);
  result.ended_at = content.size() - left;
  return result;
}

bool is_ascii(char c) { return static_cast<unsigned char>(c) < 0x80; }

/// Micro, degree, square, diameter and the letters with accents of Windows-1252.
bool is_western(char c) {
  constexpr std::string_view kSigns = "\xB5\xB0\xB1\xB2\xB3"sv, kNoLetters = "\xD0\xD7\xDE\xF0\xF7\xFE"sv;
  constexpr unsigned char kFirstLetter = 0xC0;
  return kSigns.find(c) != std::string_view::npos ||
         (static_cast<unsigned char>(c) >= kFirstLetter && kNoLetters.find(c) == std::string_view::npos);
}

/// The first byte beyond ASCII that may be part of another encoding than Windows-1252.
std::size_t find_ambiguous(std::string_view text) {
  constexpr char kSharpS = '\xDF';  // "ß" behind an umlaut, as in "Größe"
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (is_ascii(text[at])) continue;
    const std::size_t end =
        at + (at + 1 < text.size() && text[at + 1] == kSharpS && text[at] != kSharpS ? 2U : 1U);
    const bool alone = end == text.size() || is_ascii(text[end]);
    const auto joins = [&](std::size_t i) {
      return i < text.size() && std::isalnum(static_cast<unsigned char>(text[i])) != 0;
    };
    if (!alone || !is_western(text[at]) || !(joins(end) || (at > 0 && joins(at - 1)))) return at;
    at = end;
  }
  return text.size();
}

[[noreturn]] void fail_at(const std::filesystem::path& path, std::string_view content, std::size_t at,
                          std::string_view found) {
  fail(path,
       fmt::format("row {}: found {}, expected UTF-8; save the file with that encoding",
                   1 + std::count(content.begin(), content.begin() + static_cast<std::ptrdiff_t>(at), '\n'),
                   found));
}

}  // namespace

std::optional<std::string> converted_to_utf8(const std::filesystem::path& path, std::string_view content) {
  for (const auto& [mark, encoding] : {std::pair{"\xFF\xFE"sv, "UTF-16LE"}, {"\xFE\xFF"sv, "UTF-16BE"}}) {
    if (!content.starts_with(mark)) continue;
    content.remove_prefix(mark.size());
    Conversion whole = convert(content, encoding);
    if (whole.ended_at != content.size())
      fail_at(path, whole.text, whole.text.size(), "UTF-16 text that breaks off or is damaged");
    return std::move(whole.text);
  }
  if (std::all_of(content.begin(), content.end(), is_ascii)) return std::nullopt;
  const std::size_t utf8 = convert(content, "UTF-8").ended_at;
  if (utf8 == content.size()) return std::nullopt;
  if (const std::size_t at = find_ambiguous(content); at != content.size())
    fail_at(path, content, at, "letters of an encoding that the file does not tell");
  return convert(content, "WINDOWS-1252").text;
}

}  // namespace meltstage::motion::detail
