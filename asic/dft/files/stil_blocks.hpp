// SPDX-License-Identifier: Apache-2.0
// Reads the blocks of a STIL file. What each block says is read in a file of its own: stil_signals.cpp
// (Signals, SignalGroups), stil_timing.cpp, stil_structures.cpp (ScanStructures), stil_bursts.cpp
// (PatternBurst, PatternExec) and stil_statements.cpp (Pattern, Procedures, MacroDefs).
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "asic/dft/files/stil_file.hpp"
#include "asic/dft/files/stil_lexer.hpp"

namespace meltstage::dft::stil {

inline constexpr std::size_t kMostNested = 16;  ///< Loop and Shift in each other, and Includes

class Reader {
 public:
  // Of the file's last source. `including`: the paths of the files that led here.
  Reader(File& file, const Include& include, std::vector<std::filesystem::path> including);

  void read();

 private:
  // Words, whatever the block.
  [[noreturn]] void fail(std::size_t where, const std::string& found, const std::string& expected) const {
    file_.fail(where, found, expected);
  }
  void advance() { token_ = lexer_.next(); }
  bool is(std::string_view punctuation) const {
    return token_.kind == Token::Kind::punctuation && token_.text == punctuation;
  }
  bool is_word(std::string_view word) const {
    return token_.kind == Token::Kind::word && token_.text == word;
  }
  std::string found() const;
  void expect(std::string_view punctuation);
  void expect_word(std::string_view word);
  std::string take_word();
  std::string take_name();
  std::size_t number(std::string_view of);
  void skip_block();
  void skip_to_end();
  // TYPE { ... } or TYPE;
  void skip_to_block_or_end();

  void read_version();
  void top_block();
  // Include "file" IfNeed BLOCK; the condition is left to what can't be defined twice.
  void read_include();
  void read_header();

  // Signals and SignalGroups.
  void read_signals();
  // Signals of an expression 'a + b - c'.
  std::vector<std::size_t> expression(const std::string& text, std::size_t where);
  // A signal, a group, a range or an expression in single quotes: the name of the group that it is.
  std::string take_signals();
  // Makes a group of a range such as q[3..0], where the name is one.
  void know_range(const std::string& name, std::size_t where);
  void know(const std::string& name, std::vector<std::size_t> members, std::size_t where);
  void read_groups();
  // What a signal or group says of itself. Base and WFCMap give its data another meaning.
  void read_attributes();

  // Timing.
  // '100ns', '5 ns + 0.1us': times that are added and subtracted.
  double time_ns(const Token& token) const;
  [[noreturn]] void fail_time(const Token& token) const;
  void read_timing();
  void read_waveforms(WaveformTable& table);

  // ScanStructures.
  void read_chains();
  // Names and marks, as "a" ! "b"; or { "a"; ! "b"; } - and in braces an end is not asked for.
  void read_cells(std::vector<std::string>& cells, std::vector<std::size_t>& inversions);

  // PatternBurst and PatternExec.
  // One statement of a PatternBurst or of an entry of its PatList, but for the PatList.
  void read_choice(Choice& choice);
  Burst read_burst();
  // IEEE 1450-1999: a PatternExec is one test, with one PatternBurst. A file may hold several;
  // which one is run is chosen outside of it.
  void read_exec(std::size_t at_exec);

  // Pattern, Procedures and MacroDefs.
  void read_routines(std::string_view kind, Routines& into);
  // Up to and with the closing brace.
  std::vector<Statement> statements(std::size_t depth = 0);
  void assignments(Statement& statement);

  File& file_;
  const Include& include_;
  std::vector<std::filesystem::path> including_;
  Lexer lexer_;
  Token token_;
  std::size_t ranged_ = 0;  // signals of ranges and expressions
};

}  // namespace meltstage::dft::stil
