// SPDX-License-Identifier: Apache-2.0
// Words, strings and punctuation of a STIL file.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "asic/dft/files/stil_file.hpp"

namespace meltstage::dft::stil {

struct Token {
  enum class Kind { word, string, time, punctuation, end };
  Kind kind = Kind::end;
  std::string text;
  std::size_t where = 0;
};

struct Lexer {
  const File& file;
  std::size_t at = 0;
  std::size_t end = 0;  // of the source

  std::string_view source() const { return std::string_view(file.text).substr(0, end); }

  void skip();
  Token next();
  // Vector data after "=": all up to the semicolon.
  std::string data();
};

}  // namespace meltstage::dft::stil
