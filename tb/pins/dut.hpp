// SPDX-License-Identifier: Apache-2.0
// A device under test beside the model: Verilated RTL, Verilated netlist or a recording.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"

namespace meltstage::tb {

// One flop whose value differs between device and model.
struct FlopDifference {
  std::string name;  // RTL path, e.g. "u_algor.i_q"
  std::uint64_t dut;
  std::uint64_t model;
};

// An assertion of the device's own failed in the last clock; its simulator has printed which one.
struct AssertionFailed : std::runtime_error {
  AssertionFailed() : std::runtime_error("an assertion of the RTL failed; standard output says which") {}
};

class Dut {
 public:
  Dut() = default;
  Dut(const Dut&) = delete;
  Dut& operator=(const Dut&) = delete;
  virtual ~Dut() = default;

  // One rising clock edge with the pins at `in` before it; the output pins after it. Throws AssertionFailed.
  virtual chip::Outputs step(const chip::Inputs& in) = 0;
  // True when every flop that the device shows equals the model's.
  virtual bool flops_equal(const chip::Chip& model) const = 0;
  virtual std::vector<FlopDifference> differences(const chip::Chip& model) const = 0;
  // Flops (bits) that flops_equal looks at; 0 for a device that shows only pins.
  virtual unsigned flop_bits() const = 0;
  virtual std::string name() const = 0;
};

}  // namespace meltstage::tb
