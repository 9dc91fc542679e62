// SPDX-License-Identifier: Apache-2.0
// One stream of pins over clock cycles: what every recording, replay and vector file of the project is made
// of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "recording/change_check.hpp"
#include "recording/header.hpp"

namespace meltstage::recording {

/// Takes a recording: one begin, its changes in order, one end. Every format writer is a Sink, and so is
/// Stream.
///
/// The order is one for all sinks, so that equal behaviour gives equal bytes:
/// - cycles never go backwards; within a cycle pins come in header order, each once at the most;
/// - the first cycle states every pin (no value is left to a default);
/// - after it a change is a real one: the value differs from what the pin had.
/// A call that breaks this throws std::invalid_argument. Recorder keeps the order by itself.
class Sink {
 public:
  Sink() = default;
  Sink(const Sink&) = default;
  Sink& operator=(const Sink&) = default;
  Sink(Sink&&) = default;
  Sink& operator=(Sink&&) = default;
  virtual ~Sink() = default;

  virtual void begin(const Header& header) = 0;
  virtual void change(const Change& change) = 0;
  /// `final_cycle` is the last cycle recorded, whether or not a pin changed in it.
  virtual void end(std::uint64_t final_cycle) = 0;
};

/// A whole recording in memory, a few bytes a change: (cycle step, pin, value) as LEB128 numbers. Another
/// recording goes into another Stream.
class Stream final : public Sink {
 public:
  void begin(const Header& header) override;
  void change(const Change& change) override;
  void end(std::uint64_t final_cycle) override;

  const Header& header() const { return header_; }
  std::uint64_t first_cycle() const { return first_cycle_; }
  std::uint64_t final_cycle() const { return final_cycle_; }
  std::uint64_t change_count() const { return change_count_; }
  /// True once end() was called: only then may it be read.
  bool complete() const { return complete_; }
  std::size_t size_bytes() const { return bytes_.size(); }

  /// Same header, same changes, same last cycle.
  friend bool operator==(const Stream& a, const Stream& b) {
    return a.header_ == b.header_ && a.first_cycle_ == b.first_cycle_ && a.final_cycle_ == b.final_cycle_ &&
           a.bytes_ == b.bytes_;
  }

 private:
  friend class ChangeReader;

  Header header_;
  ChangeCheck check_;
  std::vector<std::uint8_t> bytes_;
  std::uint64_t first_cycle_ = 0;
  std::uint64_t previous_cycle_ = 0;
  std::uint64_t final_cycle_ = 0;
  std::uint64_t change_count_ = 0;
  bool complete_ = false;
};

/// Walks the changes of a complete stream once, first to last. The stream must outlive it and stay unchanged.
/// Throws std::invalid_argument on a stream that was never ended.
class ChangeReader {
 public:
  explicit ChangeReader(const Stream& stream);
  /// The next change in `change` and true, or false behind the last one (`change` is then untouched).
  bool next(Change& change);

 private:
  std::uint64_t next_number();

  const std::uint8_t* at_;
  const std::uint8_t* end_;
  std::uint64_t cycle_;
};

/// Walks a complete stream by cycles or by events and holds the pin values of the cycle it stands on.
/// Starts on the first cycle. The stream must outlive it and stay unchanged.
class Cursor {
 public:
  explicit Cursor(const Stream& stream);

  std::uint64_t cycle() const { return cycle_; }
  std::uint64_t final_cycle() const { return final_cycle_; }
  std::uint64_t value(std::uint32_t pin) const { return values_[pin]; }
  std::span<const std::uint64_t> values() const { return values_; }
  /// Pins that changed in the last move, in order; advance_to() over several events can name a pin
  /// repeatedly.
  std::span<const std::uint32_t> changed() const { return changed_; }
  /// Cycle of the next event ahead, if there is one: up to it the pins stand still.
  std::optional<std::uint64_t> next_event_cycle() const;

  /// One cycle on; false (and no move) on the final cycle.
  bool step();
  /// To the next cycle that has a change; false (and no move) when there is none.
  bool next_event();
  /// To `cycle`, applying every change up to and including it. Throws std::invalid_argument when it lies
  /// behind the cursor or past the final cycle.
  void advance_to(std::uint64_t cycle);

 private:
  void apply_pending();

  ChangeReader reader_;
  Change pending_;
  bool has_pending_;
  std::uint64_t cycle_;
  std::uint64_t final_cycle_;
  std::vector<std::uint64_t> values_;
  std::vector<std::uint32_t> changed_;
};

/// Feeds a sink from a simulation: set pins in any order, then commit the cycle; only real changes get
/// through, in header order. Pins that were never set are 0. A commit without a set pin costs a few
/// nanoseconds.
class Recorder {
 public:
  /// Calls sink.begin(header). The sink must outlive the recorder.
  Recorder(Sink& sink, const Header& header);

  /// Level of a pin from the cycle that is committed next. `pin` is an index into header.pins.
  void set(std::uint32_t pin, std::uint64_t value) {
    if (values_[pin] == value) return;
    values_[pin] = value;
    touched_[pin / 64] |= std::uint64_t{1} << (pin % 64);
  }
  /// Writes what was set as the change of `cycle`; cycles grow from call to call and may leave gaps where all
  /// pins stand still.
  void commit(std::uint64_t cycle) {
    for (std::size_t word = 0; word < touched_.size(); ++word) {
      if (touched_[word] != 0) commit_word(cycle, word);
    }
  }
  /// Calls sink.end(final_cycle).
  void finish(std::uint64_t final_cycle) { sink_.end(final_cycle); }

 private:
  void commit_word(std::uint64_t cycle, std::size_t word);

  Sink& sink_;
  std::vector<std::uint64_t> values_;
  std::vector<std::uint64_t> committed_;
  std::vector<std::uint64_t> touched_;  // one bit a pin: set since the last commit
  bool first_ = true;
};

/// Plays a complete stream into a sink.
void copy(const Stream& stream, Sink& sink);

}  // namespace meltstage::recording
