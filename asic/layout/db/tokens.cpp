// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/tokens.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

constexpr double kMostNumber = 1e12;

bool is_blank(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

}  // namespace

void Tokens::advance() {
  starts_line_ = place_ == 0;
  while (place_ < text_.size() && (is_blank(text_[place_]) || text_[place_] == '#')) {
    if (text_[place_] == '#')
      place_ = std::min(text_.find('\n', place_), text_.size());
    else
      starts_line_ |= text_[place_++] == '\n';
  }
  start_ = place_;
  if (place_ < text_.size() && text_[place_] == '"') {
    ++place_;
    while (place_ < text_.size() && text_[place_] != '"') ++place_;
    if (place_ < text_.size()) ++place_;
  } else {
    while (place_ < text_.size() && !is_blank(text_[place_])) ++place_;
    // a `;` that is glued to the word before it
    if (place_ - start_ > 1 && text_[place_ - 1] == ';') --place_;
  }
  word_ = text_.substr(start_, place_ - start_);
  const auto is_control = [](char c) {
    return std::iscntrl(static_cast<unsigned char>(c)) != 0 && !is_blank(c);
  };
  if (std::any_of(word_.begin(), word_.end(), is_control)) fail("text without control characters");
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
  while (!take(";")) {
    if (is("END")) fail("; before it");
    next();
  }
}

double Tokens::number() {
  const auto value = number_in(word_, -kMostNumber, kMostNumber);
  if (!value) fail(fmt::format("a number of at most {:g}", kMostNumber));
  advance();
  return *value;
}

double Tokens::number_from_0() {
  const auto value = number_in(word_, 0.0, kMostNumber);
  if (!value) fail(fmt::format("a number from 0 to {:g}", kMostNumber));
  advance();
  return *value;
}

Nm Tokens::length(double scale) {
  constexpr double kMostNm = 1e9;
  const auto value = number_in(word_, -kMostNm / scale, kMostNm / scale);
  if (!value) fail("a length of at most a metre");
  advance();
  return std::llround(*value * scale);
}

Nm Tokens::whole_length(double scale) {
  const auto value = number_in(word_, -kMostNumber, kMostNumber);
  if (value && *value != std::floor(*value)) fail("a whole number of the DEF's units");
  constexpr double kRounding = 0.01;  // of a nanometre; DEF's units leave a twentieth or more
  if (value && std::abs(*value * scale - std::round(*value * scale)) > kRounding)
    fail("a length of whole nanometres");
  return length(scale);
}

Nm Tokens::length_from_0(double scale) {
  const Tokens before = *this;
  const Nm value = length(scale);
  if (value < 0) before.fail("a length not below 0");
  return value;
}

Nm Tokens::length_above_0(double scale) {
  const Tokens before = *this;
  const Nm value = length(scale);
  if (value <= 0) before.fail("a length of a nanometre or more");
  return value;
}

int Tokens::count(int least) {
  constexpr int kMost = 10'000'000;
  const auto value = number_in(word_, least, kMost);
  if (!value) fail(fmt::format("a whole number from {} to {}", least, kMost));
  advance();
  return *value;
}

void Tokens::fail(std::string_view expected) const {
  throw UserError(defect_at(name_, place_of(text_, start_),
                            at_end() ? "the file's end" : fmt::format("\"{}\"", shown(word_)), expected));
}

}  // namespace meltstage::layout
