// SPDX-License-Identifier: Apache-2.0
// The gate netlist in lockstep with the model, pins only, over the recorded run of the model among its
// devices. While netlist and model agree that is the netlist's own closed loop.
#include <gtest/gtest.h>
#include <verilated.h>

#include "Vnetlist.h"
#include "tb/lockstep/lockstep.hpp"
#include "tests/rtl/replay.hpp"

namespace meltstage::tb {
namespace {

constexpr std::uint64_t kLeastClocks = 300'000;

class VerilatedNetlist final : public Dut {
 public:
  VerilatedNetlist() : top_(&context_) {
    top_.clk_i = 0;
    set_pins(top_, 0);
    top_.eval();
  }
  ~VerilatedNetlist() override { top_.final(); }

  chip::Outputs step(const chip::Inputs& in) override {
    set_pins(top_, pack(in));
    top_.eval();
    top_.clk_i = 1;
    top_.eval();
    top_.clk_i = 0;
    top_.eval();
    return unpack_outputs(get_pins(top_));
  }
  bool flops_equal(const chip::Chip&) const override { return true; }
  std::vector<FlopDifference> differences(const chip::Chip&) const override { return {}; }
  unsigned flop_bits() const override { return 0; }
  std::string name() const override { return "Verilated netlist"; }

 private:
  VerilatedContext context_;
  Vnetlist top_;
};

// The whole recording; throws Mismatch where netlist and model part.
Compared lockstep(const std::vector<Stretch>& recording) {
  Lockstep run(std::make_unique<VerilatedNetlist>(), {"netlist", 0, "ctest -R Netlist"},
               std::filesystem::path());
  for (const Stretch& stretch : recording) {
    for (std::uint64_t i = 0; i < stretch.clocks; ++i) {
      const std::uint16_t out = pack(run.step(unpack_inputs(stretch.in)));
      if (out != stretch.out) throw std::runtime_error("the recording is not of this model");
    }
  }
  return run.compared();
}

TEST(Netlist, AgreesWithModelOnEveryPinAndClock) {
  const auto recording = read_recording(RECORDING);
  unsigned toggled = 0;
  for (const Stretch& stretch : recording) toggled |= stretch.out ^ unsigned { recording.front().out };
  EXPECT_EQ(toggled | 1u << 9, 0x3FFu) << "an output other than at_temp_o never moved";
  EXPECT_GE(lockstep(recording).clocks, kLeastClocks);
}

// A netlist that is a clock late.
TEST(Netlist, OneWrongClockIsFound) {
  VerilatedNetlist late;
  chip::Chip model;
  bool differs = false;
  auto recording = read_recording(RECORDING);
  recording.resize(50);
  for (const Stretch& stretch : recording) {
    for (std::uint64_t i = 0; i < stretch.clocks; ++i) {
      const chip::Outputs before = model.outputs(unpack_inputs(stretch.in));
      differs = differs || !(late.step(unpack_inputs(stretch.in)) == before);
      model.step(unpack_inputs(stretch.in));
    }
  }
  EXPECT_TRUE(differs);
}

}  // namespace
}  // namespace meltstage::tb
