// SPDX-License-Identifier: Apache-2.0
// Words of a LEF or DEF file with the place of each.
#pragma once

#include <string>
#include <string_view>

#include "asic/layout/db/geometry.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

/// Reads words one after the other: blanks part them, `#` starts a comment, a quoted text is one word.
class Tokens {
 public:
  Tokens(std::string_view text, std::string name) : text_(text), name_(std::move(name)) { advance(); }

  bool at_end() const { return word_.empty(); }
  std::string_view peek() const { return word_; }
  /// True when the next word is this one, whatever its case.
  bool is(std::string_view word) const;
  std::string_view next();
  /// Takes the word when it comes next.
  bool take(std::string_view word);
  void expect(std::string_view word);
  /// True when the next word is the first of its line.
  bool starts_line() const { return starts_line_; }
  /// Skips up to and with the next `;`; an END before it is refused.
  void skip_statement();
  /// Finite, at most 1e12 either way.
  double number();
  /// The same, not below 0.
  double number_from_0();
  /// A number times `scale`, rounded to the nearest integer; at most a metre either way.
  Nm length(double scale);
  /// The same of a whole number ("-320.0" is one), as DEF has them, that makes whole nanometres.
  Nm whole_length(double scale);
  /// A length(), not below 0.
  Nm length_from_0(double scale);
  /// A length() above 0.
  Nm length_above_0(double scale);
  /// A whole number from `least` to 10 million.
  int count(int least = 1);
  /// Of the next word.
  Place place() const { return place_of(text_, start_); }
  /// Throws UserError: "<file>:<line>:<column>: found <next word>, expected <what>".
  [[noreturn]] void fail(std::string_view expected) const;

 private:
  void advance();

  std::string_view text_;
  std::string name_;
  std::size_t place_ = 0;  // behind the word
  std::size_t start_ = 0;  // of the word
  std::string_view word_;
  bool starts_line_ = true;
};

}  // namespace meltstage::layout
