// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace meltstage::dft {

/// Wrong input; what() is one line: file, place, what was found, what was expected, what to do.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace meltstage::dft
