// SPDX-License-Identifier: Apache-2.0
// A chip on a serial port.
#pragma once

#include <chrono>
#include <memory>

#include "app/live/source.hpp"
#include "host/controller.hpp"

namespace meltstage::app::live {

class ChipSource : public Source {
 public:
  /// Opens the port; nothing is sent. Throws UserError when it can't be opened.
  explicit ChipSource(const host::Connection& connection);

  std::string place() const override;
  bool is_virtual() const override { return false; }
  std::string connect() override;
  double now_s() override;
  std::vector<std::uint16_t> read(std::span<const host::Register* const> wanted) override;
  std::string carry_out(const Command& command) override;

 private:
  using Clock = std::chrono::steady_clock;

  host::Controller& controller();

  host::Connection connection_;
  Clock::time_point begin_ = Clock::now();
  std::unique_ptr<host::Controller> controller_;  // none while the port can't be opened
};

}  // namespace meltstage::app::live
