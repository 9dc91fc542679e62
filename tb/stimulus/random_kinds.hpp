// SPDX-License-Identifier: Apache-2.0
// What each seed of the random runs is about: its settings, its host's requests, how its head's temperature
// moves.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/rng.hpp"
#include "cmodel/chip.hpp"
#include "tb/lockstep/bench.hpp"
#include "tb/stimulus/random_requests.hpp"

namespace meltstage::tb {

using Temperature = double (*)(Rng& rng, double degc, const chip::Chip& chip);

struct Kind {
  const Choices& (*choices)();
  const Mix& (*mix)();
  Temperature temperature;
  unsigned calm;         // so many times more rarely does the line fail
  unsigned damaged;      // one frame in so many is damaged
  unsigned pause;        // clocks between two frames, at most
  unsigned move;         // one look in so many moves the temperature
  bool recovers;         // the host clears a fault and starts again before anything else
  bool breaks;           // fault scenarios one after another, in place of chance
  bool random_settings;  // of bus, PWM and some other registers
  bool any_sensor;
};

// The kinds come in turn over the seeds.
const Kind& kind_of(std::uint64_t seed);
// How often every kind has had its turn before this seed.
std::size_t turn_of(std::uint64_t seed);
// The part on the bench, an index of spec::kSensorPresets: the first by far the most often.
std::size_t part_of(std::uint64_t seed);

Settings start_settings(std::uint64_t seed);
// How a host may describe the part, or any other.
Settings sensor_settings(Rng& rng, std::size_t part);
// `all`, then `more`.
Settings with(Settings all, const Settings& more);

}  // namespace meltstage::tb
