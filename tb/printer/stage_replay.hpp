// SPDX-License-Identifier: Apache-2.0
// The stage's pins of a recorded print job, replayed on the motion models: the plan, the pulse generator and
// the servo axis each have to agree with what was recorded.
#pragma once

#include <cstdint>
#include <string>

#include "recording/stream.hpp"
#include "tb/printer/printer.hpp"

namespace meltstage::tb {

struct StageReplay {
  std::size_t moves = 0;  // of the job that were made
  std::uint64_t steps = 0;
  double plan_pulses = 0.0;  // largest distance of the counted pulses from the planned position
  std::uint64_t generator_differences = 0;
  std::string first_difference;  // cycle and axis, or empty
  double droplet_um = 0.0;       // largest distance of a servo axis from its bump at the droplet
};

// Replays a complete recording of `job`, which stops at each bump on a stage that was homed before and stands
// at its start. A job broken off is replayed as far as its bumps go.
// Throws std::invalid_argument for other jobs, and when the stream is not one of `job`'s pins.
StageReplay replay_stage(const PrintJob& job, const recording::Stream& stream);

}  // namespace meltstage::tb
