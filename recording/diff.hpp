// SPDX-License-Identifier: Apache-2.0
// Comparison of two recordings, as a replay check does it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recording/stream.hpp"

namespace meltstage::recording {

struct PinDifference {
  std::string pin;
  std::uint64_t cycles;  ///< in how many cycles the pin differs
};

struct FirstDifference {
  std::uint64_t cycle;
  std::string pin;
  std::uint64_t value_a;
  std::uint64_t value_b;
};

struct DiffReport {
  std::optional<FirstDifference> first;  ///< earliest cycle; there the first pin in a's order
  std::vector<PinDifference> pins;       ///< pins that differ in at least one cycle, in a's order
  std::vector<std::string> only_in_a;    ///< pins that have no partner of the same name and width
  std::vector<std::string> only_in_b;
  std::uint64_t cycles_compared = 0;  ///< cycles that both recordings cover
  std::uint64_t pins_compared = 0;    ///< pins that both recordings have
  bool same_span = false;             ///< both start and end in the same cycle

  /// True when pins and span are the same, something was compared, and nothing differed.
  bool same() const;
};

/// Compares the pins that have the same name and width in both streams, cycle by cycle where both streams
/// have values (in time linear in the changes, not in the cycles). Clock, origin, meta, owner and direction
/// are not compared. Throws std::invalid_argument on a stream that was never ended.
DiffReport diff(const Stream& a, const Stream& b);

}  // namespace meltstage::recording
