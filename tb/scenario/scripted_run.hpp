// SPDX-License-Identifier: Apache-2.0
// The model of the chip on its heated head, run by a scenario. What a person wants to see of it is kept: a
// row each tenth of a second, what went over the serial line, and every change of a pin.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "cmodel/advance.hpp"
#include "tb/scenario/scenario.hpp"

namespace meltstage::tb {

/// A row of the trace; all doubles, as a page reads them in one piece.
struct TraceRow {
  double time_s;
  double set_point_degc;  ///< the working set-point
  double reading_degc;    ///< of the chip; NaN before the first sample
  double block_degc;
  double heater_degc;
  double duty_percent;
  double state;        ///< code of the main state machine
  double faults;       ///< bits that are latched
  double pin_changes;  ///< so far
  double pins_hash;    ///< of all of them, their levels and clocks: FNV-1a, 32 bits
};

/// What went over the serial line, was done to the bench, or latched.
struct LogEntry {
  double time_s;
  std::string what;
  std::string answer;                          ///< empty where nothing answers
  std::vector<std::uint8_t> request, reply{};  ///< bytes on the line
  bool failed = false;   ///< asked of the chip without `try`, and refused or not answered
  std::size_t line = 0;  ///< of the scenario that asked, 0 where none did
};

/// Levels of all pins from a clock on; bits in the order of chip_pin_bits().
struct PinChange {
  std::uint64_t cycle;
  std::uint64_t pins;
};

/// Name and lowest bit of each pin in PinChange, as spec/ has them.
struct PinBits {
  std::string_view name;
  unsigned first, width;
};
std::vector<PinBits> chip_pin_bits();

/// The chip's address on its serial line, with its strap pins low.
inline constexpr std::uint8_t kChipAddress = 1;

class ScriptedRun {
 public:
  /// From power-up. The chip is reset, and the host sets SENS_TYPE, and TS as long as the part converts.
  explicit ScriptedRun(Scenario scenario);
  ScriptedRun(const ScriptedRun&) = delete;
  ScriptedRun& operator=(const ScriptedRun&) = delete;

  /// Done at its time, or at once when that is over.
  void add(Event event);
  /// On to that clock since power-up.
  void until(std::uint64_t cycle);

  std::uint64_t cycle() const { return run_.cycle; }
  double now_s() const;
  const chip::Chip& chip() const { return run_.chip; }
  /// States of the main state machine that it was in since the last call, a bit each in the order of
  /// spec::kStates.
  std::uint32_t take_states_seen();
  /// The fault that latched first, in a sentence with values, limits and what to do; empty without one.
  std::string fault() const;

  /// The last rows, oldest first.
  const std::vector<TraceRow>& rows() const { return rows_; }
  /// The last entries, and the number of those no longer kept.
  const std::deque<LogEntry>& log() const { return log_; }
  std::uint64_t log_dropped() const { return log_dropped_; }
  /// What events asked of the chip without `try` and it refused or did not answer, at the times of the
  /// events: the first ones, and the number of all.
  static constexpr std::size_t kMostFailures = 20;
  const std::vector<LogEntry>& failures() const { return failures_; }
  std::uint64_t failed() const { return failed_; }
  /// What events asked without `try` and got no answer so far, as if the run ended now.
  std::vector<LogEntry> unanswered() const;
  /// Events whose time hasn't come.
  const std::deque<Event>& events_to_come() const { return events_; }
  /// Changes of pins from `begin` to `end`; the first one has the levels at `begin`, or those of the oldest
  /// change that is kept.
  std::vector<PinChange> pins(std::uint64_t begin, std::uint64_t end) const;

  // What events do.
  Head& head() { return head_; }
  chip::Chip& chip() { return run_.chip; }
  void send(std::string what, ModbusRequest request);
  void poll(bool on) { polls_ = on; }
  void run_clock(bool on) { clock_runs_ = on; }
  /// Droplets a second, and the heat that each takes; 0 a second for none.
  void drop(double rate_hz, double energy_j);

 private:
  struct Sent {
    std::string what;
    std::vector<std::uint8_t> request;
    std::uint64_t cycle;        // when it was asked; the line may be busy then
    bool must_be_done = false;  // asked by an event without `try`
    std::size_t line = 0;
  };

  void set_sensor(std::string_view part);
  void do_what_is_due();
  std::uint64_t next_stop(std::uint64_t end) const;
  void advance(std::uint64_t until);
  void see(std::uint64_t cycle, const chip::Inputs& in, const chip::Outputs& out);
  void take_answers();
  void note_fault();
  void add_row();
  void log(LogEntry entry);

  Head head_;
  chip::Run run_;
  std::deque<Event> events_;
  bool polls_ = true;
  bool clock_runs_ = true;
  std::uint64_t next_poll_;
  std::uint64_t next_row_ = 0;
  std::uint64_t drop_period_ = 0;
  double drop_energy_j_ = 0.0;
  std::uint64_t next_drop_ = 0;
  std::deque<Sent> sent_;  // no answer so far
  std::uint8_t first_fault_ = 0;
  std::uint32_t states_seen_ = 0;

  std::vector<TraceRow> rows_;
  std::deque<LogEntry> log_;
  std::uint64_t log_dropped_ = 0;
  std::vector<LogEntry> failures_;
  std::uint64_t failed_ = 0;
  std::vector<PinChange> changes_;  // a ring
  std::size_t oldest_change_ = 0;
  std::uint64_t change_count_ = 0;
  std::uint32_t pins_hash_ = 2166136261U;
};

/// The rows as text: a line of names, then a line a row. Temperatures in 0.001 degC.
std::string trace_text(const ScriptedRun& run);

}  // namespace meltstage::tb
