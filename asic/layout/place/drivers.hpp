// SPDX-License-Identifier: Apache-2.0
// How strong each net's driver is.
#pragma once

#include <limits>
#include <string>

#include "asic/layout/place/buffers.hpp"

namespace meltstage::layout {

struct DriverOptions {
  double most_slew_ns = 0.5;  ///< slowest edge, at the load expected
  double most_path_ns =
      std::numeric_limits<double>::infinity();  ///< longest path from flop to flop (longest_paths_ns)
};

struct SizedDrivers {
  int resized = 0;
  int buffered = 0;
};

/// Each net's driver, clock and supplies apart, becomes the smallest of its sizes (cells whose names differ
/// in the number behind the last
/// `_` or `X`) that gives edges fast enough; where none does, the smallest buffer that does helps it. Then
/// edges on paths that are too long have to be faster, round by round, while a size or a buffer makes them
/// so.
SizedDrivers size_drivers(Design& design, const Technology& technology, const Delays& delays,
                          const std::string& clock_port, const DriverOptions& options,
                          const TreeOptions& trees);

}  // namespace meltstage::layout
