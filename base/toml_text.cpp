// SPDX-License-Identifier: Apache-2.0
#include "base/toml_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage {
namespace {

// toml++ asks of a character whether it is a blank, and for many beyond ASCII it has no defined answer:
// U+00E9 and U+FDFF are such. It asks outside of strings, and in a block of lines behind a backslash.
bool is_beyond_ascii(char c) { return static_cast<unsigned char>(c) >= 0x80; }

// Where strings begin is told as the parser does, up to the first mistake, where it stops: a value without
// quotes goes on to a blank, a comma, a closing bracket or a comment, over quotes and all.
class TomlShape {
 public:
  TomlShape(std::string_view text, std::string_view file) : text_(text), file_(file) {}

  void check() {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;  // a byte order mark
    while (at_ < text_.size()) step();
  }

 private:
  void step() {
    const char c = text_[at_];
    if (c == '#') {
      at_ = std::min(text_.find('\n', at_), text_.size());
      in_word_ = false;
    } else if ((c == '"' || c == '\'') && !in_word_) {
      pass_string(c);
    } else {
      if (is_beyond_ascii(c)) fail_here("a character beyond ASCII outside quotes", "it in quotes");
      count_dots(c);
      follow(c);
      ++at_;
    }
  }

  void count_dots(char c) {
    if (c == '.') {
      if (++dots_ > kMostNested) fail_here("a key of more than {} parts", "SECTION.FIELD");
    } else if (c == '\n' || c == '=' || c == ',' || c == '[' || c == ']') {
      dots_ = 0;
    }
  }

  void follow(char c) {
    switch (c) {
      case ' ':
        if (is_between_date_and_time()) {
          at_ += 2;  // whatever stands behind the digit
          break;
        }
        [[fallthrough]];
      case '\t':
      case '\r':
      case '\n':
        in_word_ = false;
        if (c == '\n' && open_.empty()) in_key_ = true;
        break;
      case '=':
      case '.':
        if (in_key_) {
          in_word_ = false;
          in_key_ = c == '.';
        } else {
          go_into_word();
        }
        break;
      case ',':
        in_word_ = false;
        in_key_ = open_.ends_with('{');
        break;
      case '[':
      case '{':
        if (in_word_) break;
        if (open_.size() == kMostNested) fail_here("more than {} brackets in each other", "flatter values");
        open_ += c;
        if (c == '{') in_key_ = true;
        break;
      case ']':
      case '}':
        in_word_ = false;
        if (!open_.empty()) open_.pop_back();
        break;
      default:
        go_into_word();
    }
  }

  void go_into_word() {
    if (!in_word_) word_at_ = at_;
    in_word_ = true;
  }

  // A value such as 2026-11-27 goes on behind a blank, if a digit stands there.
  bool is_between_date_and_time() const {
    if (!in_word_ || in_key_ || at_ + 2 >= text_.size() || text_[at_ + 1] < '0' || text_[at_ + 1] > '9')
      return false;
    std::string word(text_.substr(word_at_, at_ - word_at_));
    std::erase(word, '_');
    return word.size() == 10 && word[4] == '-' && word[7] == '-';
  }

  // To the last character that the backslash speaks for: what it escapes, or blanks and ends of lines.
  void pass_escape(bool block) {
    ++at_;
    if (!block) return;
    const std::size_t behind = std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size());
    if (behind < text_.size() && is_beyond_ascii(text_[behind])) {
      at_ = behind;
      fail_here("a character beyond ASCII right behind a backslash", "it on the line of the text before");
    }
    if (behind > at_) at_ = behind - 1;
  }

  void pass_string(char quote) {
    const bool block = text_.substr(at_, 3) == std::string(3, quote);
    at_ += block ? 3 : 1;
    for (; at_ < text_.size(); ++at_) {
      if (text_[at_] == '\\' && quote == '"') {
        pass_escape(block);
      } else if (text_[at_] == quote) {
        const bool ends = !block || (text_.substr(at_, 3) == std::string(3, quote));
        if (ends) break;
      } else if (text_[at_] == '\n' && !block) {
        return;  // the parser says that it has no end
      }
    }
    at_ += block ? 3 : 1;
    // up to two quotes more are the last of the text
    for (int more = 0; block && more < 2 && at_ < text_.size() && text_[at_] == quote; ++more) ++at_;
  }

  [[noreturn]] void fail_here(const char* found, std::string_view expected) const {
    throw UserError(
        defect_at(file_, place_of(text_, at_), fmt::format(fmt::runtime(found), kMostNested), expected));
  }

  std::string_view text_, file_;
  std::size_t at_ = 0;
  std::string open_;         // brackets, the innermost last
  bool in_key_ = true;       // before the '=' of a line, or of a part of an inline table
  std::size_t word_at_ = 0;  // its beginning, while in_word_
  bool in_word_ = false;     // behind the first character of a bare key or of a value without quotes
  std::size_t dots_ = 0;
};

}  // namespace

std::string read_toml_text(const std::filesystem::path& path, std::string_view wanted) {
  constexpr std::uint64_t kMostTomlBytes = std::uint64_t{1} << 22;
  std::string text = read_file(path, wanted, kMostTomlBytes);
  // single bytes that are no text are told with their place
  if (const auto kind = describe_content(text); kind != "text" && kind != "binary data")
    throw UserError(fmt::format("{}: found {}, expected {}", path.string(), kind, wanted));
  TomlShape(text, path.string()).check();
  return text;
}

}  // namespace meltstage
