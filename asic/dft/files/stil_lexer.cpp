// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/files/stil_lexer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace meltstage::dft::stil {

namespace {

// "Ann {* text *}" may stand anywhere: how long the word and the blanks behind it are; 0 for anything else.
std::size_t annotation_word(std::string_view text) {
  constexpr std::string_view kWord = "Ann";
  if (!text.starts_with(kWord)) return 0;
  const std::size_t end = text.find_first_not_of(" \t\r\n", kWord.size());
  return end != std::string_view::npos && text.substr(end).starts_with("{*") ? end : 0;
}

}  // namespace

void Lexer::skip() {
  const std::string_view text = source();
  while (at < text.size()) {
    if (text.substr(at, 2) == "//") {
      at = std::min(text.find('\n', at), text.size());
    } else if (text.substr(at, 2) == "/*" || text.substr(at, 2) == "{*") {
      const std::string_view close = text[at] == '/' ? "*/" : "*}";
      const std::size_t closed = text.find(close, at + 2);
      if (closed == std::string_view::npos) file.fail(at, "a comment left open", std::string(close));
      at = closed + 2;
    } else if (std::isspace(static_cast<unsigned char>(text[at])) != 0) {
      ++at;
    } else if (const std::size_t word = annotation_word(text.substr(at)); word != 0) {
      at += word;
    } else {
      return;
    }
  }
}

Token Lexer::next() {
  skip();
  const std::string_view text = source();
  Token token{Token::Kind::end, "", at};
  if (at >= text.size()) return token;
  const char c = text[at];
  if (c == '"' || c == '\'') {
    const std::size_t closed = text.find(c, at + 1);
    if (closed == std::string_view::npos)
      file.fail(at, fmt::format("a string left open with {}", c), std::string(1, c));
    token.kind = c == '"' ? Token::Kind::string : Token::Kind::time;
    token.text = text.substr(at + 1, closed - at - 1);
    at = closed + 1;
    return token;
  }
  if (std::string_view("{};:=").find(c) != std::string_view::npos) {
    token.kind = Token::Kind::punctuation;
    token.text = c;
    ++at;
    return token;
  }
  token.kind = Token::Kind::word;
  const std::size_t begin = at;
  while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) == 0 &&
         std::string_view("{};:=\"'").find(text[at]) == std::string_view::npos)
    ++at;
  token.text = text.substr(begin, at - begin);
  return token;
}

std::string Lexer::data() {
  const std::string_view text = source();
  const std::size_t begin = at;
  std::string result;
  for (;;) {
    const std::size_t stop = text.find_first_of(";}/", at);
    if (stop == std::string_view::npos || text[stop] == '}')
      file.fail(begin, "vector data without an end", "\";\"");
    result += text.substr(at, stop - at);
    at = stop + 1;
    if (text[stop] == ';') return result;
    if (text.substr(stop, 2) == "//")  // a comment, to the end of its line
      at = std::min(text.find('\n', stop), text.size());
    else
      result += '/';
  }
}

}  // namespace meltstage::dft::stil
