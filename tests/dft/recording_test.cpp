// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "app/functional_vectors.hpp"
#include "tb/chip_pins.hpp"

namespace meltstage::app {
namespace {

// The chip's model out of reset with its lines idle; an output is turned over in one cycle when `wrong` names
// it.
vectors::Stream recorded(std::uint64_t clocks, std::uint64_t wrong = ~std::uint64_t{0}) {
  vectors::Stream stream;
  vectors::Recorder recorder(stream, tb::chip_pin_header("test"));
  chip::Chip chip;
  for (std::uint64_t cycle = 0; cycle < clocks; ++cycle) {
    chip::Inputs in;
    in.uart_rx = true;
    in.addr_strap = 5;
    in.rst_n = cycle >= 20;
    auto levels = tb::pin_levels(in, chip.step(in));
    if (cycle == wrong) levels[tb::kPinHeater] ^= 1;
    for (std::uint32_t pin = 0; pin < tb::kChipPinCount; ++pin) recorder.set(pin, levels[pin]);
    recorder.commit(cycle);
  }
  recorder.finish(clocks - 1);
  return stream;
}

TEST(Recording, ModelAndRtlGiveWhatWasRecorded) {
  const vectors::Stream stream = recorded(30'000);
  for (const ReplayDevice device : {ReplayDevice::model, ReplayDevice::rtl}) {
    const PinReplay replay = replay_pins(stream, device);
    EXPECT_EQ(replay.clocks, 30'000u);
    EXPECT_EQ(replay.strobes, 300'000u);
    EXPECT_EQ(replay.mismatches, 0u) << replay.first;
  }
}

TEST(Recording, OneWrongStrobeIsFound) {
  for (const ReplayDevice device : {ReplayDevice::model, ReplayDevice::rtl}) {
    const PinReplay replay = replay_pins(recorded(2'000, 1'234), device);
    EXPECT_EQ(replay.mismatches, 1u);
    EXPECT_EQ(replay.first, "cycle 1234: heater_o recorded 1, chip 0");
  }
}

TEST(Recording, OtherPinsAreRefused) {
  vectors::Stream stream;
  vectors::Recorder recorder(
      stream,
      {.pins = {{"a", vectors::Direction::in, 1, "chip"}}, .clock_hz = 1e6, .origin = "test", .meta = {}});
  recorder.commit(0);
  recorder.finish(3);
  EXPECT_THROW(replay_pins(stream, ReplayDevice::model), std::runtime_error);
}

TEST(Recording, BecomesStretchesOfInputs) {
  const vectors::Stream stream = recorded(2'000);
  const auto stretches = functional_stretches(
      stream, {"addr_strap_i[0]", "addr_strap_i[1]", "addr_strap_i[2]", "clk_i", "rst_ni"}, "clk_i");
  ASSERT_EQ(stretches.size(), 2u);  // what outputs do divides nothing
  EXPECT_EQ(stretches[0].clocks, 20u);
  EXPECT_EQ(stretches[0].inputs, (std::vector<std::uint8_t>{1, 0, 1, 0, 0}));
  EXPECT_EQ(stretches[1].clocks, 1'980u);
  EXPECT_EQ(stretches[1].inputs, (std::vector<std::uint8_t>{1, 0, 1, 0, 1}));
  EXPECT_THROW(functional_stretches(stream, {"other_i"}, "clk_i"), std::runtime_error);
}

}  // namespace
}  // namespace meltstage::app
