// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace meltstage::layout {

/// Wrong input; what() is one line: file, line, what was found, what was expected.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace meltstage::layout
