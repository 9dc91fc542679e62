// SPDX-License-Identifier: Apache-2.0
// The generated chip in the place of the one by hand, for all that runs the RTL in lockstep: it is linked
// before the library that has the other one.
#include "Vgenerated.h"
#include "Vgenerated__Syms.h"
#include "Vgenerated___024root.h"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/lockstep/verilated_top.hpp"

namespace meltstage::tb {

std::unique_ptr<VerilatedRtl> make_verilated_rtl() {
  return std::make_unique<verilated::VerilatedTop<Vgenerated>>();
}
// Without waves: a mismatch is repeated, and that is all.
std::unique_ptr<VerilatedRtl> make_traced_rtl(const std::filesystem::path&) { return make_verilated_rtl(); }

}  // namespace meltstage::tb
