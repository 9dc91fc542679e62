// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "asic/dft/files/stil.hpp"
#include "asic/dft/files/stil_blocks.hpp"
#include "base/byte_order_mark.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::dft::stil {

Reader::Reader(File& file, const Include& include, std::vector<std::filesystem::path> including)
    : file_(file),
      include_(include),
      including_(std::move(including)),
      lexer_{file, file.sources.back().begin, file.text.size()} {
  advance();
}

void Reader::read() {
  if (including_.size() == 1 || is_word("STIL")) read_version();
  while (token_.kind != Token::Kind::end) top_block();
}

std::string Reader::found() const {
  return token_.kind == Token::Kind::end ? "the end of the file" : fmt::format("\"{}\"", shown(token_.text));
}

void Reader::expect(std::string_view punctuation) {
  if (!is(punctuation)) fail(token_.where, found(), fmt::format("\"{}\"", punctuation));
  advance();
}

void Reader::expect_word(std::string_view word) {
  if (!is_word(word)) fail(token_.where, found(), std::string(word));
  advance();
}

std::string Reader::take_word() {
  if (token_.kind != Token::Kind::word) fail(token_.where, found(), "a word");
  std::string word = token_.text;
  advance();
  return word;
}

std::string Reader::take_name() {
  if (token_.kind != Token::Kind::word && token_.kind != Token::Kind::string)
    fail(token_.where, found(), "a name");
  std::string word = token_.text;
  advance();
  return word;
}

std::size_t Reader::number(std::string_view of) {
  const std::size_t where = token_.where;
  const std::string text = take_word();
  const auto value = number_in<std::size_t>(text, 0, kMostCounted);
  if (!value)
    fail(where, fmt::format("{} \"{}\"", of, shown(text)),
         fmt::format("a whole number of at most {}", kMostCounted));
  return *value;
}

void Reader::skip_block() {
  const std::size_t where = token_.where;
  expect("{");
  for (std::size_t depth = 1; depth != 0; advance()) {
    if (token_.kind == Token::Kind::end) fail(where, "a block left open", "\"}\"");
    if (is("{")) ++depth;
    if (is("}") && --depth == 0) break;
  }
  expect("}");
}

void Reader::skip_to_end() {
  while (!is(";") && !is("}") && token_.kind != Token::Kind::end) advance();
  expect(";");
}

void Reader::skip_to_block_or_end() {
  while (!is(";") && !is("{") && !is("}") && token_.kind != Token::Kind::end) advance();
  if (is("{"))
    skip_block();
  else
    expect(";");
}

void Reader::read_version() {
  expect_word("STIL");
  const std::size_t where = token_.where;
  const std::string version = take_word();
  if (!version.starts_with("0.") && !version.starts_with("1."))
    fail(where, fmt::format("version {}", shown(version)), "STIL 1.0");
  if (is("{"))
    skip_block();
  else
    expect(";");
}

void Reader::top_block() {
  const std::size_t where = token_.where;
  const std::string word = take_word();
  if (word == "Signals") {
    read_signals();
  } else if (word == "SignalGroups") {
    if (!is("{")) take_name();
    read_groups();
  } else if (word == "Timing") {
    if (!is("{")) take_name();
    read_timing();
  } else if (word == "ScanStructures") {
    if (!is("{")) take_name();
    read_chains();
  } else if (word == "PatternBurst") {
    const std::string name = take_name();
    if (!file_.bursts.emplace(name, read_burst()).second)
      fail(where, fmt::format("PatternBurst \"{}\" again", shown(name)), "each once");
  } else if (word == "PatternExec") {
    if (!is("{")) take_name();
    read_exec(where);
  } else if (word == "Procedures" || word == "MacroDefs") {
    const std::string name = is("{") ? std::string() : take_name();
    if (word == "Procedures")
      read_routines("procedure", file_.procedures[name]);
    else
      read_routines("macro", file_.macros[name]);
  } else if (word == "Pattern") {
    const std::string name = take_name();
    expect("{");
    if (!file_.patterns.emplace(name, statements()).second)
      fail(where, fmt::format("pattern \"{}\" again", shown(name)), "each once");
  } else if (word == "Header") {
    read_header();
  } else if (word == "Include") {
    read_include();
  } else if (word == "Ann" || word == "UserKeywords" || word == "Spec" || word == "Selector" ||
             word == "Environment") {
    while (!is("{") && !is(";") && token_.kind != Token::Kind::end) advance();
    if (is("{"))
      skip_block();
    else
      expect(";");
  } else {
    fail(where, fmt::format("\"{}\"", word), "a block of STIL (Signals, SignalGroups, Timing, Pattern ...)");
  }
}

void Reader::read_include() {
  const std::size_t where = token_.where;
  const std::string name = take_name();
  while (!is(";") && token_.kind != Token::Kind::end) advance();
  expect(";");
  if (!include_)
    fail(where, fmt::format("Include \"{}\"", shown(name)), "no other file to be needed by this text");
  const std::filesystem::path path =
      (std::filesystem::path(file_.source_of(where).name).parent_path() / name).lexically_normal();
  if (std::find(including_.begin(), including_.end(), path) != including_.end())
    fail(where, fmt::format("Include of \"{}\" from within itself", shown(name)), "another file");
  if (including_.size() >= kMostNested)
    fail(where, fmt::format("Include {} deep", including_.size()), fmt::format("at most {}", kMostNested));
  std::string text;
  try {
    text = include_(path);
  } catch (const UserError& error) {
    fail(where, error.what(), "a file that can be read");
  }
  file_.sources.push_back({file_.text.size(), path.string()});
  file_.text += without_byte_order_mark(text);
  std::vector<std::filesystem::path> including = including_;
  including.push_back(path);
  Reader(file_, include_, std::move(including)).read();
}

void Reader::read_header() {
  expect("{");
  while (!is("}")) {
    if (token_.kind == Token::Kind::end) fail(token_.where, found(), "\"}\"");
    const bool title = is_word("Title");
    advance();
    if (title && token_.kind == Token::Kind::string) file_.title = shown(token_.text);
    if (is("{")) skip_block();
  }
  expect("}");
}

const std::vector<std::size_t>& File::members(const std::string& signal_or_group, std::size_t where) const {
  const auto found = groups.find(signal_or_group);
  if (found == groups.end())
    fail(where, fmt::format("signal or group \"{}\"", shown(signal_or_group)),
         "one that is defined in Signals or SignalGroups");
  return found->second;
}

const Source& File::source_of(std::size_t where) const {
  const auto behind =
      std::upper_bound(sources.begin(), sources.end(), where,
                       [](std::size_t at, const Source& source) { return at < source.begin; });
  return *std::prev(behind);
}

namespace {

// Where `where` lies in its own file. A place at the end of a file that another one follows is the other's
// first.
Place place_in(const File& file, std::size_t where) {
  const std::size_t begin = file.source_of(where).begin;
  return place_of(std::string_view(file.text).substr(begin), where - begin);
}

}  // namespace

std::string File::defect(std::size_t where, std::string_view found, std::string_view expected) const {
  return defect_at(source_of(where).name, place_in(*this, where), found, expected);
}

void File::fail(std::size_t where, const std::string& found, const std::string& expected) const {
  throw StilError(defect(where, found, expected), place_in(*this, where).line);
}

File parse(std::string_view text, const std::string& name, const Include& include) {
  File file;
  file.text = without_byte_order_mark(text);
  file.sources = {{0, name}};
  Reader(file, include, {std::filesystem::path(name).lexically_normal()}).read();
  return file;
}

}  // namespace meltstage::dft::stil
