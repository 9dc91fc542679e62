// SPDX-License-Identifier: Apache-2.0
// Random segments on the model; everything follows from the seed.
#pragma once

#include "bus_inputs.hpp"

namespace meltstage::tb {

inline BusCount sum(const BusCount& a, const BusCount& b) {
  return {a.segments + b.segments, a.accepted + b.accepted, a.possible + b.possible,
          a.exceptions + b.exceptions, a.written + b.written};
}

inline BusCount random_bus_run(std::uint64_t seed, std::uint64_t segments) {
  Rng rng = stream(seed, "bus input");
  const LineSetting line = random_line(rng);
  BusLine bus(model_station(chip_on_line(line)), line);
  for (std::uint64_t i = 0; i < segments; ++i) bus.put(random_segment(rng, line.format));
  return bus.count();
}

}  // namespace meltstage::tb
