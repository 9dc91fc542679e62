// SPDX-License-Identifier: Apache-2.0
// What a STIL file says, before its pattern is expanded into cycles.
#pragma once

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
  enum class Kind { table, condition, fixed, vector, call, macro, shift, loop, stop };
  Kind kind = Kind::stop;
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

struct File {
  std::string_view text;
  std::string name;  ///< for messages
  std::string title;
  std::vector<TestSignal> signals;
  std::vector<ScanChain> chains;
  std::size_t longest_chain = 0;
  std::map<std::string, std::size_t> signal;
  std::map<std::string, std::vector<std::size_t>> groups;
  std::map<std::string, WaveformTable> tables;
  std::map<std::string, std::vector<Statement>> procedures, macros, patterns;
  std::map<std::string, std::vector<Assignment>> bursts;
  std::vector<Assignment> executed;

  /// Signals of a signal or group. Throws StilError.
  const std::vector<std::size_t>& members(const std::string& signal_or_group, std::size_t where) const;
  [[noreturn]] void fail(std::size_t where, const std::string& found, const std::string& expected) const;
};

/// The text must outlive the file. Throws StilError.
File parse(std::string_view text, const std::string& name);

}  // namespace meltstage::dft::stil
