// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace meltstage::host {

/// The chip does not answer, or refuses. One line.
struct BusError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// No sound answer came, or the port is gone: what was asked may have been done or not.
struct NoAnswer : BusError {
  using BusError::BusError;
};

}  // namespace meltstage::host
