// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/tokens.hpp"

#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>

#include "base/error.hpp"

namespace meltstage::layout {

namespace {

bool is_blank(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

}  // namespace

void Tokens::advance() {
  while (place_ < text_.size() && (is_blank(text_[place_]) || text_[place_] == '#')) {
    if (text_[place_] == '#') {
      while (place_ < text_.size() && text_[place_] != '\n') ++place_;
    } else {
      line_ += text_[place_] == '\n' ? 1 : 0;
      ++place_;
    }
  }
  const std::size_t start = place_;
  if (place_ < text_.size() && text_[place_] == '"') {
    ++place_;
    while (place_ < text_.size() && text_[place_] != '"') ++place_;
    if (place_ < text_.size()) ++place_;
  } else {
    while (place_ < text_.size() && !is_blank(text_[place_])) ++place_;
    // a `;` that is glued to the word before it
    if (place_ - start > 1 && text_[place_ - 1] == ';') --place_;
  }
  word_ = text_.substr(start, place_ - start);
}

bool Tokens::is(std::string_view word) const {
  return word_.size() == word.size() &&
         std::equal(word.begin(), word.end(), word_.begin(), [](char a, char b) {
           return std::toupper(static_cast<unsigned char>(a)) == std::toupper(static_cast<unsigned char>(b));
         });
}

std::string_view Tokens::next() {
  if (at_end()) fail("more");
  const std::string_view word = word_;
  advance();
  return word;
}

bool Tokens::take(std::string_view word) {
  if (!is(word)) return false;
  advance();
  return true;
}

void Tokens::expect(std::string_view word) {
  if (!take(word)) fail(word);
}

void Tokens::skip_statement() {
  while (next() != ";") {
  }
}

double Tokens::number() {
  double value = 0.0;
  const char* end = word_.data() + word_.size();
  const auto [stop, problem] = std::from_chars(word_.data(), end, value);
  if (at_end() || problem != std::errc() || stop != end) fail("a number");
  advance();
  return value;
}

Nm Tokens::length(double scale) { return std::llround(number() * scale); }

void Tokens::fail(std::string_view expected) const {
  throw UserError(fmt::format("{}:{}: found {}, expected {}", name_, line_,
                              at_end() ? "the file's end" : "\"" + std::string(word_) + "\"", expected));
}

std::string read_text(const std::filesystem::path& path, std::string_view wanted) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  if (!stream) throw UserError(fmt::format("{}: can't be read, expected {}", path.string(), wanted));
  return text.str();
}

}  // namespace meltstage::layout
