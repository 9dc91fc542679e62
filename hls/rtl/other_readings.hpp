// SPDX-License-Identifier: Apache-2.0
// What Yosys 0.23 takes for something else than IEEE 1800 says, and than simulators do:
//  - a variable with an initial value that is no constant (6.8): it would follow the value for ever;
//  - an expression at a port that is wider (10.8): its operands would not be widened before it is worked out;
//  - a name without a declaration (6.10), which no simulator takes in an expression.
#pragma once

#include <string>

namespace meltstage::hls {

/// Looks for them in what Yosys has said while it read the RTL, and in what it made of each module (RTLIL,
/// with processes). Throws UserError that names file and line.
void require_plain_readings(const std::string& said, const std::string& modules);

}  // namespace meltstage::hls
