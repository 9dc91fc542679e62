// SPDX-License-Identifier: Apache-2.0
// The RTL as Verilator compiles it, with every flop readable and loadable.
#pragma once

#include <filesystem>
#include <memory>

#include "tb/pins/dut.hpp"

namespace meltstage::tb {

// Out of reset lines idle, all flops at their reset values; reset is asserted until the first step says
// otherwise.
class VerilatedRtl : public Dut {
 public:
  // Sets every flop to the model's value, with the pins at `in`: the RTL goes on from the model's state.
  virtual void load(const chip::Chip& model, const chip::Inputs& in) = 0;
  // The RTL's assertions, on at first; off for states that no sound chip has (upset flops).
  virtual void set_assertions(bool on) = 0;
};

std::unique_ptr<VerilatedRtl> make_verilated_rtl();
// The same with an FST wave of every signal written to `path` until it is destroyed. Throws UserError.
std::unique_ptr<VerilatedRtl> make_traced_rtl(const std::filesystem::path& path);

}  // namespace meltstage::tb
