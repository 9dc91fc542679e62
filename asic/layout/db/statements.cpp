// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/statements.hpp"

#include <fmt/format.h>

#include <cctype>
#include <numeric>

namespace meltstage::layout {

namespace {

constexpr std::size_t kMostMistakes = 2;
constexpr std::size_t kLongestWord = 40;

/// Letters to change, add or leave out between two words (Levenshtein), whatever their case.
std::size_t mistakes(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t k = 0; k < b.size(); ++k) {
      const bool is_same =
          std::toupper(static_cast<unsigned char>(a[i])) == std::toupper(static_cast<unsigned char>(b[k]));
      const std::size_t changed = diagonal + (is_same ? 0 : 1);
      diagonal = row[k + 1];
      row[k + 1] = std::min({changed, row[k] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

void fail_unknown(const Tokens& in, std::span<const std::string_view> known, std::string_view block) {
  if (in.at_end()) in.fail("more");
  std::string_view nearest;
  std::size_t least = kMostMistakes + 1;
  for (const std::string_view word : known) {
    if (in.peek().size() > kLongestWord) break;
    const std::size_t here = mistakes(in.peek(), word);
    if (here < least && 2 * here < word.size()) {
      least = here;
      nearest = word;
    }
  }
  in.fail(fmt::format("a statement of {}{}{}", block, nearest.empty() ? "" : ", perhaps ", nearest));
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  while (!text.empty()) {
    const std::size_t blank = std::min(text.find(' '), text.size());
    words.push_back(text.substr(0, blank));
    text.remove_prefix(std::min(blank + 1, text.size()));
  }
  return words;
}

void read_version(Tokens& in) {
  const std::string_view word = in.peek();
  if (word.size() != 3 || !word.starts_with("5.") || word[2] < '0' || word[2] > '8')
    in.fail("a version from 5.0 to 5.8");
  in.next();
  in.expect(";");
}

void read_bus_bit_characters(Tokens& in) {
  if (!in.take("\"[]\"") && !in.take("\"<>\"")) in.fail("\"[]\" or \"<>\"");
  in.expect(";");
}

void read_case_sensitivity(Tokens& in) {
  if (!in.take("ON")) in.fail("ON, as names that differ in their case alone are two");
  in.expect(";");
}

void skip_extension(Tokens& in) {
  while (!in.take("ENDEXT")) in.next();
}

}  // namespace meltstage::layout
