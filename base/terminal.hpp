// SPDX-License-Identifier: Apache-2.0
// What long commands share: ending on Ctrl-C, SIGTERM or SIGHUP, and one line of progress.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "base/progress.hpp"

namespace meltstage {

/// A text on standard error. What can't be written there is lost, and the exit status says the rest.
void on_stderr(std::string_view text);

// Ctrl-C, SIGTERM or SIGHUP: unwinds, so that nothing half-written and no process stays.
struct Interrupted {};
void catch_interrupts();
// Throws Interrupted once a signal has come.
void throw_if_interrupted();

// "43 %, 12 s left" of work that goes on evenly: `share` 0..1 of it is done after `elapsed_s`. Time left is
// told from half a second on, once any of it is done.
std::string describe_share(double share, double elapsed_s);

class ProgressLine;
// Shows on `line`, which must outlive it, what the work tells.
Progress shown_on(ProgressLine& line);

// One line on a terminal, nothing in a pipe.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  void show(const std::string& text);
  // `what`, its share and time left, then `detail`. Time counts from the first call for this `what` on.
  void show_share(const std::string& what, double share, const std::string& detail = "");
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  bool terminal_;
  std::string what_;
  Clock::time_point begun_;
  std::optional<Clock::time_point> shown_;
};

}  // namespace meltstage
