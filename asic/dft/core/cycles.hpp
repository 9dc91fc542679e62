// SPDX-License-Identifier: Apache-2.0
// What a tester does, cycle by cycle: the one stream that every pattern format is written from and read into.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace meltstage::dft {

struct TestSignal {
  std::string name;
  bool is_input = true;
  friend bool operator==(const TestSignal&, const TestSignal&) = default;
};

/// A name that may go into Verilog, a shell and a terminal: printed without blanks, quotes, backslash, % and
/// `.
bool is_plain_name(std::string_view name);

/// Times within a cycle, in ns. Inputs change at `drive_ns`, outputs are compared at `strobe_ns`, the clock
/// is high in between.
struct TestTiming {
  double period_ns = 100, drive_ns = 0, strobe_ns = 40, clock_rise_ns = 50, clock_fall_ns = 80;
  friend bool operator==(const TestTiming&, const TestTiming&) = default;
};

/// One tester cycle: a character a signal. Inputs: 0, 1, P (clock pulse), in what was read N for one that is
/// left open; outputs: L, H, X (not compared).
struct TestCycle {
  std::string states;
  std::string label;        ///< of the pattern that begins here; not compared
  std::uint64_t count = 1;  ///< so many cycles like this one in a row
};

/// A chain from its input to its output: flop names in shift order.
struct ScanChain {
  std::string name;
  std::string in, out;  ///< port bits
  std::vector<std::string> cells;
  /// Where it inverts what moves: before the cell of this number; their number: before the output.
  std::vector<std::size_t> inversions = {};

  /// By cell, whether it holds the inverse of what is shifted in for it; last, whether the output shows the
  /// inverse of what was shifted in.
  std::vector<std::uint8_t> inverses() const;
};

struct CycleStream {
  std::string title;
  std::vector<TestSignal> signals;
  TestTiming timing;
  std::vector<TestCycle> cycles;
  std::vector<ScanChain> chains;  ///< empty where the format has none
  /// What the file does that these cycles don't say, by its timing: a line each, with its place.
  std::vector<std::string> timing_defects = {};
};

/// Whether a clock pulses in a cycle.
bool has_pulse(const CycleStream& stream);
/// Whether an output is compared.
bool has_strobe(const CycleStream& stream);
/// Why the stream is not inputs, strobe, pulse in each cycle, a line a reason; empty when it is.
std::vector<std::string> disorders(const CycleStream& stream);
/// Throws UserError for a strobe that expects high impedance (STIL's T): no simulation here has such a level.
void require_levels(const CycleStream& stream);
/// Throws UserError with the first of disorders(), and what require_levels() does. Whoever runs a stream asks
/// this.
void require_runnable(const CycleStream& stream);

/// Entries that a reader or unrolled() makes at the most, and states of all signals in them.
inline constexpr std::size_t kMostCycles = 50'000'000;
inline constexpr std::size_t kMostStates = 1'000'000'000;
/// Cycles with their counts that a reader takes.
inline constexpr std::uint64_t kMostCounted = 10'000'000'000;

/// Cycles with their counts.
std::uint64_t cycle_count(const CycleStream& stream);

/// Whether a cycle's state leaves an input open: it is neither a level nor a pulse.
inline bool is_open_input(char state) { return state != '0' && state != '1' && state != 'P'; }
bool leaves_inputs_open(const CycleStream& stream);
/// The stream with what `level` gives, '0' or '1', wherever it leaves an input open.
CycleStream with_open_inputs(CycleStream stream, const std::function<char()>& level);
/// Each cycle by itself, all counts 1. Throws UserError when they are more than kMostCycles or kMostStates.
CycleStream unrolled(CycleStream stream);
/// Same signals, timing and states of all cycles, however they are counted.
bool same_cycles(const CycleStream& a, const CycleStream& b);

}  // namespace meltstage::dft
