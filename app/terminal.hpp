// SPDX-License-Identifier: Apache-2.0
// What long commands share: ending on Ctrl-C or SIGTERM, and one line of progress.
#pragma once

#include <string>

namespace meltstage::app {

// Ctrl-C or SIGTERM: unwinds, so that nothing half-written and no process stays.
struct Interrupted {};
void catch_interrupts();
// Throws Interrupted once a signal has come.
void throw_if_interrupted();

// One line on a terminal, nothing in a pipe.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  void show(const std::string& text);
  void clear();

 private:
  bool terminal_;
};

}  // namespace meltstage::app
