// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/functional.hpp"

#include <gtest/gtest.h>

#include "asic/dft/fault_simulator.hpp"
#include "tests/dft/support.hpp"

namespace meltstage::dft {
namespace {

// Random inputs, reset first and once more in the middle.
std::vector<FunctionalStretch> stimulus(const CaptureView& view, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<FunctionalStretch> stretches;
  for (std::size_t i = 0; i < count; ++i) {
    FunctionalStretch stretch{1 + random() % 3, {}};
    for (const std::string& port : view.input_ports) {
      const bool reset = i == 0 || i == count / 2;
      stretch.inputs.push_back(port == "rst_ni" ? !reset : static_cast<std::uint8_t>(random() & 1));
    }
    stretches.push_back(stretch);
  }
  return stretches;
}

// The definition, for faults that no reset reads: one machine, every gate, clock by clock.
class OneMachine {
 public:
  OneMachine(const CaptureView& view, const Fault* fault)
      : view_(view), fault_(fault), pattern_(view.circuit.inputs().size(), 0) {}

  void set_inputs(const std::vector<std::uint8_t>& inputs) {
    std::copy(inputs.begin(), inputs.end(), pattern_.begin());
    settle();
  }
  std::vector<bool> clock() {
    for (std::size_t k = 0; k < view_.flops.size(); ++k) {
      const Node next = view_.circuit.outputs()[view_.output_ports.size() + k];
      captured_.push_back(values_[next]);
    }
    for (std::size_t k = 0; k < view_.flops.size(); ++k)
      pattern_[view_.input_ports.size() + k] = captured_[k];
    captured_.clear();
    settle();
    std::vector<bool> ports;
    for (std::size_t i = 0; i < view_.output_ports.size(); ++i)
      ports.push_back(values_[view_.circuit.outputs()[i]]);
    return ports;
  }

 private:
  void settle() {
    for (bool again = true; again;) {
      again = false;
      values_ = serial_values(view_.circuit, pattern_, fault_);
      for (std::size_t k = 0; k < view_.flops.size(); ++k) {
        const ScanFlop& flop = view_.flops[k];
        std::uint8_t& state = pattern_[view_.input_ports.size() + k];
        if (!flop.has_reset || values_[view_.node_of_net.at(flop.reset)] == flop.reset_low ||
            state == (flop.reset_value ? 1 : 0))
          continue;
        state = flop.reset_value ? 1 : 0;
        again = true;
      }
    }
  }

  const CaptureView& view_;
  const Fault* fault_;
  Pattern pattern_;
  std::vector<bool> values_;
  std::vector<std::uint8_t> captured_;
};

std::uint64_t first_difference(const CaptureView& view, const std::vector<FunctionalStretch>& stretches,
                               const Fault& fault) {
  OneMachine good(view, nullptr), bad(view, &fault);
  std::uint64_t clock = 0;
  for (const FunctionalStretch& stretch : stretches) {
    good.set_inputs(stretch.inputs);
    bad.set_inputs(stretch.inputs);
    for (std::uint64_t c = 0; c < stretch.clocks; ++c, ++clock) {
      if (good.clock() != bad.clock()) return clock;
    }
  }
  return FunctionalGrade::kUndetected;
}

bool reads_reset(const CaptureView& view, const Fault& fault) {
  if (fault.pin == kStem) return false;
  const Node line = view.circuit.fanin(fault.node)[static_cast<std::size_t>(fault.pin)];
  return std::any_of(view.flops.begin(), view.flops.end(), [&](const ScanFlop& flop) {
    return flop.has_reset && view.node_of_net.at(flop.reset) == line;
  });
}

TEST(Functional, AgreesWithOneMachineAtATime) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  std::vector<Fault> faults;
  for (const Fault& fault : collapse(view.circuit).classes) {
    if (!reads_reset(view, fault)) faults.push_back(fault);
  }
  const auto stretches = stimulus(view, 60, 1);
  const FunctionalGrade grade = grade_functional(view, stretches, faults, 2);
  for (std::size_t i = 0; i < faults.size(); ++i)
    EXPECT_EQ(grade.first_clock[i], first_difference(view, stretches, faults[i]))
        << view.circuit.name(faults[i].node) << " pin " << faults[i].pin << " stuck at " << faults[i].stuck;
  EXPECT_GT(grade.detected(), faults.size() / 2);
  EXPECT_LT(grade.detected(), faults.size());
}

// A flop whose reset pin is stuck inactive keeps what it had.
TEST(Functional, AStuckResetPinIsSeen) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  std::vector<Fault> faults;
  for (const Site& site : view.circuit.sites()) {
    const Fault fault{site.node, site.pin, true};
    if (site.node != kNoNode && reads_reset(view, fault)) faults.push_back(fault);
  }
  ASSERT_FALSE(faults.empty());
  std::size_t detected = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    detected = std::max(detected, grade_functional(view, stimulus(view, 400, seed), faults, 2).detected());
  EXPECT_GT(detected, 0u);
}

TEST(Functional, VectorsThatDoNothingDetectAndToggleLittle) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  const std::vector<Fault> faults = collapse(view.circuit).classes;
  const std::vector<FunctionalStretch> idle{{100, std::vector<std::uint8_t>(view.input_ports.size(), 0)}};
  const auto busy = stimulus(view, 400, 1);
  const FunctionalGrade little = grade_functional(view, idle, faults, 2),
                        much = grade_functional(view, busy, faults, 2);
  EXPECT_LT(2 * little.detected(), much.detected());
  const ToggleCoverage &none = little.toggle, &most = much.toggle;
  EXPECT_EQ(most.lines, none.lines);
  EXPECT_EQ(most.lines, most.toggled + most.idle.size());
  EXPECT_LT(none.toggled, most.toggled);
  EXPECT_EQ(grade_functional(view, busy, {}, 2).toggle.toggled,
            most.toggled);  // no fault touches the good machine
}

// What one machine gives, clock by clock, is what the replay finds; one turned bit is one mismatch.
TEST(Functional, ReplayComparesEveryClock) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library());
  OneMachine good(view, nullptr);
  std::vector<FunctionalStretch> stretches;
  for (const FunctionalStretch& part : stimulus(view, 60, 2)) {
    good.set_inputs(part.inputs);
    for (std::uint64_t c = 0; c < part.clocks; ++c) {
      const std::vector<bool> ports = good.clock();
      stretches.push_back({1, part.inputs, {ports.begin(), ports.end()}});
    }
  }
  const ReplayResult right = replay_functional(view, stretches);
  EXPECT_EQ(right.cycles, stretches.size());
  EXPECT_EQ(right.strobes, stretches.size() * view.output_ports.size());
  EXPECT_EQ(right.mismatches, 0u) << right.first;
  stretches[17].outputs[1] ^= 1;
  const ReplayResult wrong = replay_functional(view, stretches);
  EXPECT_EQ(wrong.mismatches, 1u);
  EXPECT_EQ(wrong.first.substr(0, 9), "cycle 17:");
}

}  // namespace
}  // namespace meltstage::dft
