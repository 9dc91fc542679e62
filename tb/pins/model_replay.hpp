// SPDX-License-Identifier: Apache-2.0
// A recording's input pins into the model, and its output pins against the model's.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cmodel/advance.hpp"
#include "recording/stream.hpp"
#include "tb/pins/chip_pins.hpp"

namespace meltstage::tb {

/// An output pin of the model differs from the recording.
struct PinMismatch {
  std::uint64_t cycle;
  std::string pin;
  std::uint64_t recorded, chip;  ///< levels
};

class ModelReplay {
 public:
  /// From reset. The stream must outlive it. Throws UserError, which begins with `name`, for a recording that
  /// lacks a pin of the chip, has another clock, begins elsewhere than in cycle 0 with rst_ni low, or holds
  /// cycles of a scan test.
  ModelReplay(const recording::Stream& stream, const std::string& name);

  /// Compares that many clocks more; false at the recording's end and behind the first mismatch.
  bool run(std::uint64_t clocks);
  /// Clocks that were compared, but behind a mismatch.
  std::uint64_t cycle() const { return run_.cycle; }
  const std::optional<PinMismatch>& mismatch() const { return mismatch_; }

 private:
  void compare(std::uint64_t cycle, const chip::Inputs& in, const chip::Outputs& left);

  std::vector<std::optional<std::uint32_t>> chip_pins_;
  recording::Cursor cursor_;
  std::uint64_t end_;
  chip::Run run_;
  std::optional<PinMismatch> mismatch_;
};

}  // namespace meltstage::tb
