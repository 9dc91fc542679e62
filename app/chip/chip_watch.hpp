// SPDX-License-Identifier: Apache-2.0
// `meltstage chip watch`: the chip's temperature, duty, state and faults as they go, as a chart or as CSV.
#pragma once

#include <optional>

#include "host/controller.hpp"

namespace meltstage::app {

struct WatchOptions {
  double period_s = 0.25;       // between polls
  std::optional<double> for_s;  // ends by itself after that time
};

// A chart when standard output is a terminal, CSV lines otherwise; ends with q, Ctrl-C or after `for_s`.
// Returns the exit status: 0, or 1 when a fault was latched at the end.
int watch_chip(host::Controller& controller, const WatchOptions& options);

}  // namespace meltstage::app
