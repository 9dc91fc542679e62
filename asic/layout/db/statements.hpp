// SPDX-License-Identifier: Apache-2.0
// The statements that a block of LEF or DEF may hold: those that are read, and those that are known and
// skipped. Any other word is refused, as a rule with a misspelt name would else be no rule.
#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asic/layout/db/tokens.hpp"

namespace meltstage::layout {

/// A statement of a block that is read; `Into` is what the block describes.
template <typename Reader, typename Into>
struct Statement {
  std::string_view name;
  void (*read)(Reader&, Into&);  ///< what follows the name
};

/// Refuses the next word: names the block, and the word of `known` that it resembles.
[[noreturn]] void fail_unknown(const Tokens& in, std::span<const std::string_view> known,
                               std::string_view block);

/// Words with one blank between each two.
std::vector<std::string_view> words_of(std::string_view text);
/// VERSION's number, of a format whose last version is 5.8, and `;`.
void read_version(Tokens& in);
/// BUSBITCHARS' text and `;`. Names are compared as they are written, with [] or <> alike.
void read_bus_bit_characters(Tokens& in);
/// NAMESCASESENSITIVE's word and `;`. Names that differ in their case alone are two.
void read_case_sensitivity(Tokens& in);
/// BEGINEXT's text up to and with ENDEXT.
void skip_extension(Tokens& in);

/// Statements of one block: those that are read, and those that have no meaning for a layout.
template <typename Reader, typename Into>
class Block {
 public:
  constexpr Block(std::string_view name, std::span<const Statement<Reader, Into>> read,
                  std::string_view skipped)
      : name_(name), read_(read), skipped_(skipped) {}

  /// Reads or skips the statement that comes next, with its `;`. One that is read and begins on a new line
  /// is no part of one that is skipped: there a `;` is missing.
  void next(Tokens& in, Reader& reader, Into& into) const {
    if (!begins_skipped(in, reader, into)) return;
    while (!in.take(";")) {
      if (in.is("END") || (in.starts_line() && find(in) != nullptr)) in.fail("; before it");
      in.next();
    }
  }
  /// The same of an entry of a DEF section, where a statement ends before the next `+` or `;`.
  void next_clause(Tokens& in, Reader& reader, Into& into) const {
    if (!begins_skipped(in, reader, into)) return;
    while (!in.is("+") && !in.is(";")) {
      if (in.is("-") || in.is("END")) in.fail("; before it");
      in.next();
    }
  }

 private:
  const Statement<Reader, Into>* find(const Tokens& in) const {
    const auto found = std::find_if(read_.begin(), read_.end(), [&](const auto& s) { return in.is(s.name); });
    return found == read_.end() ? nullptr : &*found;
  }
  /// Takes the name; true when what follows is to be skipped.
  bool begins_skipped(Tokens& in, Reader& reader, Into& into) const {
    if (const auto* statement = find(in)) {
      in.next();
      statement->read(reader, into);
      return false;
    }
    std::vector<std::string_view> known = words_of(skipped_);
    if (std::any_of(known.begin(), known.end(), [&](auto name) { return in.take(name); })) return true;
    for (const auto& statement : read_) known.push_back(statement.name);
    fail_unknown(in, known, name_);
  }

  std::string_view name_;
  std::span<const Statement<Reader, Into>> read_;
  std::string_view skipped_;  // words with blanks between
};

}  // namespace meltstage::layout
