// SPDX-License-Identifier: Apache-2.0
// The model of the chip on its heated head, within this process.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "app/live/source.hpp"
#include "tb/scenario/scripted_run.hpp"

namespace meltstage::app::live {

class VirtualSource : public Source {
 public:
  /// `speed`: chip time over real time, 0 or more; a machine that is too slow falls behind.
  VirtualSource(tb::Scenario scenario, double speed);

  std::string place() const override { return "virtual chip on its heated head"; }
  bool is_virtual() const override { return true; }
  std::string connect() override { return "the model"; }
  double now_s() override { return run_.now_s(); }
  std::vector<std::uint16_t> read(std::span<const host::Register* const> wanted) override;
  std::string carry_out(const Command& command) override;
  std::map<std::string, std::string> around() const override { return around_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Done;

  void advance();
  void set_speed(double speed);
  // `done`: what is told when the chip says no more.
  std::string carry_out(const std::string& event, const std::string& done = "");
  void take_log();

  tb::ScriptedRun run_;
  double speed_ = 0.0;
  Clock::time_point then_ = Clock::now();
  std::uint64_t logged_ = 0;            // entries that were looked at
  std::optional<tb::LogEntry> answer_;  // to what was asked last
  std::map<std::string, std::string> around_;
};

}  // namespace meltstage::app::live
