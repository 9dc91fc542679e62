// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/late_pins.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace meltstage::tb {
namespace {

// Keeps the pins that it is stepped with.
class Recorder final : public Device {
 public:
  explicit Recorder(std::vector<chip::Inputs>& shown) : shown_(shown) {}
  chip::Outputs step(const chip::Inputs& in) override {
    shown_.push_back(in);
    return {};
  }
  const chip::Chip& model() const override { return chip_; }
  void restart(const chip::Chip&, const chip::Inputs&) override {}
  Compared finish() override { return {}; }

 private:
  std::vector<chip::Inputs>& shown_;
  chip::Chip chip_;
};

TEST(LatePins, EachChangeComesAtOnceOrAClockLater) {
  constexpr unsigned kClocks = 6'000, kHeld = 3;
  std::vector<chip::Inputs> shown;
  const auto device = with_late_pins(std::make_unique<Recorder>(shown), 1);
  const auto given = [](unsigned clock) {
    chip::Inputs in;
    in.inhibit = clock / kHeld % 2 != 0;
    in.uart_rx = in.inhibit;
    in.test_mode = in.inhibit;
    return in;
  };
  for (unsigned clock = 0; clock < kClocks; ++clock) device->step(given(clock));
  unsigned late = 0, apart = 0;
  for (unsigned clock = kHeld; clock < kClocks; ++clock) {
    const bool changes = clock % kHeld == 0;
    EXPECT_EQ(shown[clock].test_mode, given(clock).test_mode);
    if (!changes) {
      EXPECT_EQ(shown[clock].inhibit, given(clock).inhibit) << clock;
      continue;
    }
    late += shown[clock].inhibit != given(clock).inhibit ? 1 : 0;
    apart += shown[clock].inhibit != shown[clock].uart_rx ? 1 : 0;
  }
  EXPECT_NEAR(late, kClocks / kHeld / 2, 100);
  EXPECT_NEAR(apart, kClocks / kHeld / 2, 100);  // each pin by itself
}

}  // namespace
}  // namespace meltstage::tb
