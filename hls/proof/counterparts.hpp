// SPDX-License-Identifier: Apache-2.0
// Which flop of the RTL is which one of the C++.
#pragma once

#include <string>
#include <vector>

#include "hls/graph/circuit.hpp"
#include "hls/rtl/rtl.hpp"

namespace meltstage::hls {

/// For each of Rtl::flops the name under which the C++ has it, bit by bit. It is empty for a flop that the
/// C++ has not and on which nothing depends that both sides have, such as the variable of a for loop. Throws
/// UserError by file, line and name for any other flop that the C++ has not.
std::vector<std::string> counterparts(const Circuit& model, const Rtl& rtl);

}  // namespace meltstage::hls
