// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

namespace meltstage::tb {

/// Up to where the data sheet of a sensor's part says that it measures; infinite for a part that isn't known.
/// Beyond it the reading of a digital sensor soon stays where it is, so that no limit above it can trip.
constexpr double highest_reading_degc(std::string_view part) {
  struct Part {
    std::string_view name;
    double highest_degc;
  };
  constexpr std::array<Part, 6> kParts = {{{"MAX31855", 1350.0},  // with a thermocouple of type K
                                           {"MAX6675", 1023.75},
                                           {"MAX31865", 767.96875},  // the preset's line, not the Pt100
                                           {"ADT7320", 150.0},
                                           {"ADT7310", 150.0},
                                           {"LM70", 150.0}}};
  const auto* known =
      std::find_if(kParts.begin(), kParts.end(), [&](const Part& p) { return p.name == part; });
  return known == kParts.end() ? std::numeric_limits<double>::infinity() : known->highest_degc;
}

}  // namespace meltstage::tb
