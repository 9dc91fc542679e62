// SPDX-License-Identifier: Apache-2.0
// The Verilated RTL with the mutants of one file, under a name of its own: with all of them at once it would
// run tens of times slower.
#include MUTANTS_HEADER
#include MUTANTS_SYMS
#include MUTANTS_ROOT
#include "lockstep_kill.hpp"

namespace meltstage::tb {

std::unique_ptr<VerilatedRtl> MUTANTS_MAKE(unsigned variant, std::uint64_t& clocks);
std::unique_ptr<VerilatedRtl> MUTANTS_MAKE(unsigned variant, std::uint64_t& clocks) {
  return make_variant<MUTANTS_TOP>(variant, clocks);
}

}  // namespace meltstage::tb
