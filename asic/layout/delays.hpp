// SPDX-License-Identifier: Apache-2.0
// What Liberty says of delays: capacitances of pins and tables over input slew and load (non-linear delay
// model).
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace meltstage::layout {

/// Values over slew (ns) and load (pF), linear between the points and beyond them.
struct DelayTable {
  std::vector<double> slews_ns;
  std::vector<double> loads_pf;
  std::vector<double> values_ns;  ///< loads of the first slew, then of the second, ...
  double at(double slew_ns, double load_pf) const;
};

/// From one input to one output, output rising.
struct DelayArc {
  std::string from;
  DelayTable delay;
  DelayTable slew;
};

struct DelayPin {
  double capacitance_pf = 0.0;
  double max_capacitance_pf = 0.0;  ///< outputs, 0: not said
  bool is_clock = false;
  std::vector<DelayArc> arcs;  ///< outputs
};

struct DelayCell {
  bool is_flop = false;
  bool is_clock_gate = false;
  std::map<std::string, DelayPin, std::less<>> pins;
};

using Delays = std::map<std::string, DelayCell, std::less<>>;

/// Reads a Liberty file in ns and pF. Throws InputError.
Delays read_delays(const std::filesystem::path& path);
Delays parse_delays(std::string_view text, const std::string& name);

}  // namespace meltstage::layout
