// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/mutator.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

namespace meltstage {

namespace {

constexpr std::size_t kLongest = 64 * 1024;

constexpr std::array<std::string_view, 22> kWords = {
    "0",      "-1",       "1e999", "nan", "inf", "99999999999999999999",
    "1e-999", "\x1b[31m", "\"",    "'",   "(",   ")",
    "{",      "}",        "[",     "]",   "\n",  ";",
    "=",      ",",        "\\",    "\xFF"};

std::size_t place_in(const std::string& text, Rng& random) { return random.below(text.size() + 1); }

void change(std::string& text, const std::vector<std::string>& corpus, Rng& random) {
  const std::size_t at = place_in(text, random);
  const std::size_t length = random.below(std::min<std::size_t>(text.size() - at, 64) + 1);
  switch (random.below(7)) {
    case 0:
      if (at < text.size()) text[at] = static_cast<char>(random.below(256));
      return;
    case 1:
      text.erase(at, length);
      return;
    case 2:
      text.insert(place_in(text, random), text.substr(at, length));
      return;
    case 3:
      text.insert(at, kWords[random.below(kWords.size())]);
      return;
    case 4: {  // the next number
      const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
      const auto begin = std::find_if(text.begin() + static_cast<std::ptrdiff_t>(at), text.end(), is_digit);
      const auto end = std::find_if_not(begin, text.end(), is_digit);
      const std::string_view word = kWords[random.below(7)];
      text.replace(begin, end, word.begin(), word.end());
      return;
    }
    case 5: {  // a piece of another
      const std::string& other = corpus[random.below(corpus.size())];
      const std::size_t from = place_in(other, random);
      text.insert(at, other, from, random.below(256));
      return;
    }
    default: {  // the same many times
      const std::string piece = text.substr(at, std::min<std::size_t>(length, 12));
      for (std::uint64_t n = random.below(300); n != 0 && text.size() < kLongest; --n) text.insert(at, piece);
      return;
    }
  }
}

}  // namespace

std::string mutated(const std::vector<std::string>& corpus, Rng& random) {
  std::string text = corpus[random.below(corpus.size())];
  for (std::uint64_t n = 1 + random.below(8); n != 0; --n) change(text, corpus, random);
  return text.substr(0, kLongest);
}

}  // namespace meltstage
