// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace meltstage::host {

/// A name, value or port that can't be used; nothing has gone over the wire for it. One line.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The chip does not answer, or refuses. One line.
struct BusError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace meltstage::host
