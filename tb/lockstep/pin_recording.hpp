// SPDX-License-Identifier: Apache-2.0
// The model alone, its pins written to a recording (.mvec) that any simulator can replay.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "recording/text.hpp"
#include "tb/lockstep/bench.hpp"
#include "tb/pins/chip_pins.hpp"

namespace meltstage::tb {

// From reset on, by pins alone: what a bench would put into the flops, a later time or a flipped bit, does
// not happen.
class PinRecording final : public Device {
 public:
  // `origin`: the command that makes the recording. Throws what recording::TextWriter does.
  PinRecording(const std::filesystem::path& file, const std::string& origin);

  chip::Outputs step(const chip::Inputs& in) override;
  const chip::Chip& model() const override { return chip_; }
  void restart(const chip::Chip&, const chip::Inputs&) override {}
  Compared finish() override;

 private:
  chip::Chip chip_;
  recording::TextWriter file_;
  recording::Recorder recorder_;
  std::uint64_t clocks_ = 0;
};

}  // namespace meltstage::tb
