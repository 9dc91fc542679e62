// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/late_pins.hpp"

#include <initializer_list>
#include <utility>

#include "base/rng.hpp"

namespace meltstage::tb {
namespace {

class LatePins final : public Device {
 public:
  LatePins(std::unique_ptr<Device> device, std::uint64_t seed)
      : device_(std::move(device)), rng_(seed, "late pins") {}

  chip::Outputs step(const chip::Inputs& in) override {
    chip::Inputs late = in;
    for (bool chip::Inputs::*pin : kPins) delay(late.*pin, before_.*pin, shown_.*pin);
    before_ = in;
    shown_ = late;
    return device_->step(late);
  }
  const chip::Chip& model() const override { return device_->model(); }
  void restart(const chip::Chip& state, const chip::Inputs& in) override {
    before_ = shown_ = in;
    device_->restart(state, in);
  }
  Compared finish() override { return device_->finish(); }

 private:
  static constexpr std::initializer_list<bool chip::Inputs::*> kPins = {
      &chip::Inputs::uart_rx, &chip::Inputs::spi_miso, &chip::Inputs::heater_fb, &chip::Inputs::inhibit,
      &chip::Inputs::drop};

  // What came a clock ago is shown now at the latest.
  void delay(bool& pin, bool before, bool shown) {
    if (pin != before && before == shown && rng_.below(2) == 0) pin = before;
  }

  std::unique_ptr<Device> device_;
  Rng rng_;
  chip::Inputs before_, shown_;
};

}  // namespace

std::unique_ptr<Device> with_late_pins(std::unique_ptr<Device> device, std::uint64_t seed) {
  return std::make_unique<LatePins>(std::move(device), seed);
}

}  // namespace meltstage::tb
