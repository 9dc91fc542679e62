// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "asic/dft/files/stil_blocks.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::dft::stil {

namespace {

constexpr std::size_t kMostMembers = 100'000;  // of a group

/// The names of "q[3..0]": q[3], q[2], q[1], q[0] (IEEE 1450-1999, 6.10). Empty for a name that is no range;
/// of a range too long, the first names, one more than a group holds.
std::vector<std::string> names_of_range(std::string_view text) {
  const std::size_t open = text.rfind('['), dots = text.rfind("..");
  if (open == std::string_view::npos || dots == std::string_view::npos || dots < open || !text.ends_with(']'))
    return {};
  const auto first = number_in<std::size_t>(text.substr(open + 1, dots - open - 1), 0, kMostCounted);
  const auto last = number_in<std::size_t>(text.substr(dots + 2, text.size() - dots - 3), 0, kMostCounted);
  if (!first || !last) return {};
  std::vector<std::string> names;
  for (std::size_t i = *first;; i = *first < *last ? i + 1 : i - 1) {
    names.push_back(fmt::format("{}[{}]", text.substr(0, open), i));
    if (i == *last || names.size() > kMostMembers) return names;
  }
}

}  // namespace

void Reader::read_signals() {
  if (!file_.tables.empty()) fail(token_.where, "Signals after Timing", "all signals before it");
  expect("{");
  while (!is("}")) {
    const std::size_t where = token_.where;
    const std::string name = take_name();
    if (!is_plain_name(name))
      fail(where, fmt::format("signal \"{}\"", shown(name)), "a name without blanks, quotes, \\, % and `");
    const std::string direction = take_word();
    if (direction != "In" && direction != "Out")
      fail(where, fmt::format("signal \"{}\" {}", name, direction), "In or Out");
    const std::vector<std::string> range = names_of_range(name);
    if (file_.signals.size() + range.size() > kMostMembers)
      fail(where, "more signals than this program takes", fmt::format("at most {}", kMostMembers));
    for (const std::string& one : range.empty() ? std::vector{name} : range) {
      if (!file_.signal.emplace(one, file_.signals.size()).second)
        fail(where, fmt::format("signal \"{}\" again", one), "each signal once");
      file_.groups[one] = {file_.signals.size()};
      file_.signals.push_back({one, direction == "In"});
    }
    know_range(name, where);
    if (is("{"))
      read_attributes();
    else
      expect(";");
  }
  expect("}");
}

void Reader::know_range(const std::string& name, std::size_t where) {
  if (file_.groups.contains(name)) return;
  std::vector<std::size_t> members;
  for (const std::string& one : names_of_range(name)) members.push_back(file_.members(one, where).front());
  if (!members.empty()) know(name, std::move(members), where);
}

void Reader::know(const std::string& name, std::vector<std::size_t> members, std::size_t where) {
  ranged_ += members.size();
  constexpr std::size_t kMostRanged = 10'000'000;
  if (ranged_ > kMostRanged)
    fail(where, "more signals in ranges and expressions than this program takes",
         fmt::format("at most {}", kMostRanged));
  file_.groups.emplace(name, std::move(members));
}

std::string Reader::take_signals() {
  const std::size_t where = token_.where;
  if (token_.kind != Token::Kind::time) {
    const std::string name = take_name();
    know_range(name, where);
    return name;
  }
  const std::string quoted = "'" + token_.text + "'";  // no name has quotes
  if (!file_.groups.contains(quoted)) {
    std::vector<std::size_t> members = expression(token_.text, where);
    if (members.empty()) fail(where, fmt::format("no signal in {}", shown(quoted)), "at least one");
    know(quoted, std::move(members), where);
  }
  advance();
  return quoted;
}

std::vector<std::size_t> Reader::expression(const std::string& text, std::size_t where) {
  std::vector<std::size_t> result;
  char sign = '+';
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (std::isspace(static_cast<unsigned char>(c)) != 0) {
      ++i;
    } else if (c == '+' || c == '-') {
      sign = c;
      ++i;
    } else {
      const bool quote = c == '"';
      const std::size_t begin = quote ? i + 1 : i;
      std::size_t end = begin;
      const auto ends_name = [&](unsigned char letter) {
        return quote ? letter == '"' : letter == '+' || letter == '-' || std::isspace(letter) != 0;
      };
      while (end < text.size() && !ends_name(static_cast<unsigned char>(text[end]))) ++end;
      know_range(text.substr(begin, end - begin), where);
      for (const std::size_t s : file_.members(text.substr(begin, end - begin), where)) {
        if (sign == '+')
          result.push_back(s);
        else
          result.erase(std::remove(result.begin(), result.end(), s), result.end());
      }
      if (result.size() > kMostMembers)
        fail(where, "a group of more signals than this program takes",
             fmt::format("at most {}", kMostMembers));
      i = quote ? end + 1 : end;
    }
  }
  return result;
}

void Reader::read_groups() {
  expect("{");
  while (!is("}")) {
    const std::size_t where = token_.where;
    const std::string name = take_name();
    expect("=");
    if (token_.kind != Token::Kind::time) fail(token_.where, found(), "signals in single quotes");
    const auto [group, is_new] = file_.groups.emplace(name, expression(token_.text, where));
    if (!is_new && group->second != expression(token_.text, where))
      fail(where, fmt::format("group \"{}\" again with other signals", shown(name)), "each once");
    advance();
    if (is("{"))
      read_attributes();
    else
      expect(";");
  }
  expect("}");
}

void Reader::read_attributes() {
  const std::size_t where = token_.where;
  expect("{");
  for (std::size_t depth = 1; depth != 0; advance()) {
    if (token_.kind == Token::Kind::end) fail(where, "a block left open", "\"}\"");
    if (is_word("Base") || is_word("WFCMap"))
      fail(token_.where, found(), "data that has a waveform character a signal");
    if (is("{")) ++depth;
    if (is("}") && --depth == 0) break;
  }
  expect("}");
}

}  // namespace meltstage::dft::stil
