// SPDX-License-Identifier: Apache-2.0
// The gate netlist against the model's recorded pins. The devices were driven by the model's outputs; while netlist and model agree
// that is the netlist's own closed loop.
#include <gtest/gtest.h>
#include <verilated.h>

#include "Vnetlist.h"
#include "tests/netlist/replay.hpp"

namespace meltstage::tb {
namespace {

constexpr std::uint64_t kLeastClocks = 300'000;

std::optional<std::uint64_t> replay_on_netlist(const std::vector<Stretch>& recording) {
  VerilatedContext context;
  Vnetlist top(&context);
  const auto clock = first_difference(top, recording);
  top.final();
  return clock;
}

TEST(Netlist, AgreesWithModelOnEveryPinAndClock) {
  const auto recording = read_recording(RECORDING);
  std::uint64_t clocks = 0;
  unsigned toggled = 0;
  for (const Stretch& stretch : recording) {
    clocks += stretch.clocks;
    toggled |= stretch.out ^ unsigned{recording.front().out};
  }
  EXPECT_GE(clocks, kLeastClocks);
  EXPECT_EQ(toggled | 1u << 9, 0x3FFu) << "an output other than at_temp_o never moved";
  const auto clock = replay_on_netlist(recording);
  EXPECT_FALSE(clock.has_value()) << "first difference at clock " << *clock;
}

TEST(Netlist, ReplayFindsOneWrongBit) {
  auto recording = read_recording(RECORDING);
  recording.resize(50);
  recording.back().out ^= 1;
  EXPECT_TRUE(replay_on_netlist(recording).has_value());
}

}  // namespace
}  // namespace meltstage::tb
