// SPDX-License-Identifier: Apache-2.0
// ALGOR's kernel (cmodel/algor_kernel.hpp) as functions of named words: once over expressions, once over
// integers.
#pragma once

#include <z3++.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace meltstage::proof {

// A flop: name as in the RTL, bits, value in reset.
struct FlopWord {
  std::string name;
  unsigned width;
  std::uint64_t reset;
};
std::vector<FlopWord> flop_words();

// Words of a state and its inputs. Flops under their names, pins under the RTL's port names, register r of
// the parameters as params_i[r].
template <class Word>
using Words = std::map<std::string, Word>;
std::string register_name(unsigned index);
std::string idle_name(const std::string& flop);

// One clock: next flops under their names, outputs (of the state before the clock) under the RTL's port
// names. A word has as many bits as the RTL gives it; a condition has one. idle_name(flop): the flop after a
// clock if the model would leave that clock out (algor_kernel::idle), before it otherwise; must be the flop
// before it.
Words<z3::expr> kernel_clock(const Words<z3::expr>& before);

// The same kernel on plain integers, as the model runs it; words without sign.
Words<std::uint64_t> kernel_clock(const Words<std::uint64_t>& before);

}  // namespace meltstage::proof
