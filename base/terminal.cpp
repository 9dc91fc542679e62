// SPDX-License-Identifier: Apache-2.0
#include "base/terminal.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>

namespace meltstage {

namespace {
volatile std::sig_atomic_t interrupted = 0;
void on_interrupt(int /*signal*/) { interrupted = 1; }
}  // namespace

void on_stderr(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stderr); }

void catch_interrupts() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  // The terminal is gone; nohup(1) has had it ignored, so that the work goes on.
  if (std::signal(SIGHUP, on_interrupt) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

void throw_if_interrupted() {
  if (interrupted != 0) throw Interrupted{};
}

std::string describe_share(double share, double elapsed_s) {
  constexpr double kTellsFrom_s = 0.5;
  const double done = share > 0.0 ? std::min(share, 1.0) : 0.0;  // also of what is no number
  std::string text = fmt::format("{:.0f} %", std::floor(100.0 * done));
  if (done <= 0.0 || elapsed_s < kTellsFrom_s) return text;
  const double left_s = std::ceil(elapsed_s * (1.0 - done) / done);
  if (left_s < 120.0) return text + fmt::format(", {:.0f} s left", left_s);
  return text + fmt::format(", {:.0f} min left", std::ceil(left_s / 60.0));
}

ProgressLine::ProgressLine() : terminal_(isatty(STDERR_FILENO) != 0) {}

void ProgressLine::show(const std::string& text) {
  if (!terminal_) return;
  on_stderr(fmt::format("\r\033[K{}", text));
  std::fflush(stderr);
}

void ProgressLine::show_share(const std::string& what, double share, const std::string& detail) {
  constexpr auto kShowEvery = std::chrono::milliseconds(100);
  if (!terminal_) return;
  const Clock::time_point now = Clock::now();
  if (what != what_) {
    what_ = what;
    begun_ = now;
    shown_.reset();
  }
  if (shown_ && now - *shown_ < kShowEvery) return;
  shown_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - begun_).count();
  show(fmt::format("{}  {}{}{}", what, describe_share(share, elapsed_s), detail.empty() ? "" : "  ", detail));
}

Progress shown_on(ProgressLine& line) {
  return [&line](std::string_view step, double share) { line.show_share(std::string(step), share); };
}

void ProgressLine::clear() {
  if (terminal_) on_stderr("\r\033[K");
}

}  // namespace meltstage
