// SPDX-License-Identifier: Apache-2.0
// What a STIL file says, before its pattern is expanded into cycles.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "asic/dft/core/cycles.hpp"
#include "asic/dft/files/waveforms.hpp"

namespace meltstage::dft::stil {

/// `where` is the offset in the text that a message names.
struct Assignment {
  std::string signals;
  std::string data;
  std::size_t where = 0;
};

struct Statement {
  enum class Kind { table, condition, fixed, vector, call, macro, shift, loop, stop, note };
  Kind kind = Kind::note;
  std::string name;  ///< table, call, macro
  std::string label;
  std::vector<Assignment> assignments;
  std::vector<Statement> body;  ///< shift, loop
  std::size_t count = 1;        ///< loop
  std::size_t where = 0;
};

struct Waveform {
  char character = 0;
  std::vector<PinEvent> events;
  std::size_t where = 0;
};

struct WaveformTable {
  double period_ns = 0;
  std::vector<Waveform> waveforms;
  std::vector<std::map<char, std::size_t>> of_signal;  ///< its waveform by character
};

using Routines = std::map<std::string, std::vector<Statement>>;  ///< procedures or macros by name

/// What a PatternBurst, or an entry of its PatList, chooses among the named blocks.
struct Choice {
  std::vector<Assignment> procedures, macros;  ///< `signals` is the block's name
};
struct BurstEntry {
  std::string pattern;
  Choice choice;
  std::size_t where = 0;
};
struct Burst {
  Choice choice;
  std::vector<BurstEntry> entries;
};

/// Part of a File's text that was a file of its own.
struct Source {
  std::size_t begin = 0;
  std::string name;  ///< for messages; an Include is looked for beside it
};

struct File {
  std::string text;  ///< the included files behind the first
  std::vector<Source> sources;
  std::string title;
  std::vector<TestSignal> signals;
  std::vector<ScanChain> chains;
  std::size_t longest_chain = 0;
  std::map<std::string, std::size_t> signal;
  std::map<std::string, std::vector<std::size_t>> groups;
  std::map<std::string, WaveformTable> tables;
  Routines patterns;
  std::map<std::string, Routines> procedures, macros;  ///< by the block's name, "" for blocks without
  std::map<std::string, Burst> bursts;
  bool has_exec = false;
  std::vector<Assignment> executed;  ///< of the PatternExec, one at the most

  /// Signals of a signal or group. Throws StilError.
  const std::vector<std::size_t>& members(const std::string& signal_or_group, std::size_t where) const;
  /// The file that this place is in, and the one line of a defect there.
  const Source& source_of(std::size_t where) const;
  std::string defect(std::size_t where, std::string_view found, std::string_view expected) const;
  [[noreturn]] void fail(std::size_t where, const std::string& found, const std::string& expected) const;
};

/// The text of an included file; throws UserError.
using Include = std::function<std::string(const std::filesystem::path&)>;
/// Throws StilError. Without `include` an Include statement is refused.
File parse(std::string_view text, const std::string& name, const Include& include);

}  // namespace meltstage::dft::stil
