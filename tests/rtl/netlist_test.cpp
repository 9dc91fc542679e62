// SPDX-License-Identifier: Apache-2.0
// The gate netlist in lockstep with the model, pins only, over the recorded run of the model among its
// devices. While netlist and model agree that is the netlist's own closed loop.
#include <gtest/gtest.h>
#include <verilated.h>

#include "Vnetlist.h"
#include "recording/text.hpp"
#include "tb/lockstep/lockstep.hpp"
#include "tb/pins/chip_pins.hpp"

namespace meltstage::tb {
namespace {

constexpr std::uint64_t kLeastClocks = 300'000;

class VerilatedNetlist final : public Dut {
 public:
  VerilatedNetlist() : top_(&context_) {
    top_.clk_i = 0;
    chip::put_inputs({.rst_n = false}, top_);
    top_.eval();
  }
  ~VerilatedNetlist() override { top_.final(); }

  chip::Outputs step(const chip::Inputs& in) override {
    chip::put_inputs(in, top_);
    top_.eval();
    top_.clk_i = 1;
    top_.eval();
    top_.clk_i = 0;
    top_.eval();
    return chip::take_outputs(top_);
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
Compared lockstep(const recording::Stream& recording) {
  Lockstep run(std::make_unique<VerilatedNetlist>(), {"netlist", 0, "ctest -R Netlist"},
               std::filesystem::path());
  recording::Cursor at(recording);
  chip::Outputs left = chip::Chip{}.outputs({.rst_n = false});
  do {
    const chip::Inputs in = inputs_of(at.values());
    if (before_clock(left, in) != outputs_of(at.values()))
      throw std::runtime_error("the recording is not of this model");
    left = run.step(in);
  } while (at.step());
  return run.compared();
}

TEST(Netlist, AgreesWithModelOnEveryPinAndClock) {
  const recording::Stream recording = recording::read_text(RECORDING);
  std::array<unsigned, kChipPinCount> changes{};
  recording::ChangeReader reader(recording);
  for (recording::Change change; reader.next(change);) ++changes[change.pin];
  for (std::uint32_t pin = chip::spec::kInputPins; pin < kChipPinCount; ++pin) {
    if (pin == kPinAtTemp) continue;
    EXPECT_GE(changes[pin], 2U) << chip::spec::kPins[pin].name << " never moved";
  }
  EXPECT_GE(lockstep(recording).clocks, kLeastClocks);
}

// A netlist that is a clock late.
TEST(Netlist, OneWrongClockIsFound) {
  VerilatedNetlist late;
  chip::Chip model;
  const recording::Stream recording = recording::read_text(RECORDING);
  recording::Cursor at(recording);
  bool differs = false;
  for (unsigned event = 0; event < 50; ++event) {
    const auto next = at.next_event_cycle();
    do {
      const chip::Inputs in = inputs_of(at.values());
      const chip::Outputs before = model.outputs(in);
      differs = differs || late.step(in) != before;
      model.step(in);
    } while (at.step() && at.cycle() < next);
  }
  EXPECT_TRUE(differs);
}

}  // namespace
}  // namespace meltstage::tb
