// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/pin_recording.hpp"

namespace meltstage::tb {

PinRecording::PinRecording(const std::filesystem::path& file, const std::string& origin)
    : file_(file), recorder_(file_, chip_pin_header(origin)) {}

chip::Outputs PinRecording::step(const chip::Inputs& in) {
  record_inputs(recorder_, in);
  record_outputs(recorder_, chip_.outputs(in));
  recorder_.commit(clocks_++);
  return chip_.step(in);
}

Compared PinRecording::finish() {
  recorder_.finish(clocks_ - 1);
  Compared written;
  written.clocks = clocks_;
  return written;
}

}  // namespace meltstage::tb
