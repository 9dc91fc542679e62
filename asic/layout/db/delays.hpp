// SPDX-License-Identifier: Apache-2.0
// What Liberty says of delays: capacitances of pins and tables over input slew and load (non-linear delay
// model).
#pragma once

#include <algorithm>
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

/// Which edges of an input make which of the output.
enum class Unateness { positive, negative, none };

/// From one input to one output.
struct DelayArc {
  std::string from;
  DelayTable delay;  ///< output rising
  DelayTable slew;
  DelayTable fall_delay;  ///< output falling
  DelayTable fall_slew;
  Unateness unateness = Unateness::none;
  double slowest_slew_ns(double slew_ns, double load_pf) const {
    return std::max(slew.at(slew_ns, load_pf), fall_slew.at(slew_ns, load_pf));
  }
};

struct DelayPin {
  double capacitance_pf = 0.0;
  double max_capacitance_pf = 0.0;  ///< outputs, 0: not said
  bool is_clock = false;
  std::string function;        ///< outputs, as it is written; empty: not said
  std::vector<DelayArc> arcs;  ///< outputs
};

struct DelayCell {
  bool is_flop = false;
  bool is_clock_gate = false;
  std::map<std::string, DelayPin, std::less<>> pins;
};

using Delays = std::map<std::string, DelayCell, std::less<>>;

/// Reads a Liberty file in ns and pF. Throws UserError.
Delays read_delays(const std::filesystem::path& path);
Delays parse_delays(std::string_view text, const std::string& name);

}  // namespace meltstage::layout
