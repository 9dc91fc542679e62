// SPDX-License-Identifier: Apache-2.0
// Words of a LEF or DEF file with the line that each stands in.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "asic/layout/db/geometry.hpp"

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
  /// Skips up to and with the next `;`.
  void skip_statement();
  double number();
  /// A number times `scale`, rounded to the nearest integer.
  Nm length(double scale);
  /// Throws UserError: "<file>:<line>: found <next word>, expected <what>".
  [[noreturn]] void fail(std::string_view expected) const;

 private:
  void advance();

  std::string_view text_;
  std::string name_;
  std::size_t place_ = 0;
  std::size_t line_ = 1;
  std::string_view word_;
};

/// The whole file. Throws UserError when it can't be read.
std::string read_text(const std::filesystem::path& path, std::string_view wanted);

}  // namespace meltstage::layout
