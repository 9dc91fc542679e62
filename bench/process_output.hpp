// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace meltstage::app {

/// What a command of the shell prints; what it says of errors goes to ours.
std::string output_of(const std::string& command);

}  // namespace meltstage::app
