// SPDX-License-Identifier: Apache-2.0
// The one thread that talks to the chip: polls it, does one command at a time, and tells what comes of it. A
// line that is lost is opened again; nothing that was asked before is sent then.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "app/live/answers.hpp"
#include "app/live/feed.hpp"
#include "app/live/reading.hpp"
#include "app/live/source.hpp"

namespace meltstage::app::live {

class Bench {
 public:
  static constexpr std::size_t kMostWaiting = 32;
  static constexpr std::chrono::milliseconds kPollPeriod{250};

  /// `keep` is called with each sample by the bench's thread. All must outlive the bench.
  Bench(Source& source, Feed& feed, std::function<void(const Sample&)> keep);
  /// Ends what is being done, and refuses what waits.
  ~Bench();
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  /// Queues the command, waits for its answer for so long, and returns it, or one that is `waiting`. A stop
  /// goes ahead of all that wait, and they are refused. A command with the id of an earlier one isn't done;
  /// its answer is the earlier one's. Nothing when too many wait.
  std::optional<Answer> ask(const Command& command, std::chrono::milliseconds patience);

 private:
  using Clock = std::chrono::steady_clock;

  void work();
  void try_to_connect();
  void tell_changes(const Registers& before, std::string_view what);
  void lose(const std::string& reason);
  void poll();
  void read_registers();
  void carry_out(const Command& command);
  void let_stop_ahead();
  void refuse_waiting(const std::string& why);
  void answer(const Command& command, Outcome outcome, const std::string& text);
  void put_and_tell(const Answer& answer);
  std::optional<Command> next_command();
  void wait_until(Clock::time_point time);
  bool ends();

  Source& source_;
  Feed& feed_;
  std::function<void(const Sample&)> keep_;

  // of the thread alone
  std::optional<Registers> registers_;  // as last read
  std::optional<std::uint16_t> samples_;
  Clock::time_point next_poll_{};
  Clock::time_point next_registers_{};
  std::string told_faults_, told_around_;

  std::mutex mutex_;
  std::condition_variable asked_, answered_;
  std::deque<Command> waiting_;
  Answers answers_;
  std::string lost_ = "not connected yet";  // why; empty while the chip answers
  bool ends_ = false;
  std::thread thread_;  // last, as it uses all others
};

/// {"id": ..., "asked": ..., "outcome": ..., "text": ...}
std::string answer_json(const Answer& answer);

}  // namespace meltstage::app::live
