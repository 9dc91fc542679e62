// SPDX-License-Identifier: Apache-2.0
// Temperature loops that a user could have instead, after their published rules, in floating point. Each is
// tuned on the plant as its own documentation says; none keeps state from one call of its maker to the next.
#pragma once

#include <vector>

#include "tb/trials/loop_trial.hpp"

namespace meltstage::tb {

/// What a relay experiment (Astrom and Hagglund 1984) and a full-power step find on a plant.
struct PlantIdentity {
  double ku_per_k;      ///< ultimate gain, duty per degC
  double tu_s;          ///< ultimate period
  double rate_k_per_s;  ///< steepest rise at full power
  double dead_time_s;   ///< where the tangent at the steepest rise meets ambient
  double time_constant_s;
  double gain_k;  ///< rise above ambient at full power, settled
  double ambient_degc;
};
PlantIdentity identify(const PlantConfig& plant, double setpoint_degc);

/// Marlin's PID: full power more than 10 degC below, none more than 10 above, integral zeroed at entry,
/// Ziegler-Nichols gains, 0.164 s.
PeerLoop marlin_pid(const PlantIdentity& id);
/// Klipper's ControlPID: positional, derivative over 1 s, integral kept only where the output is not clamped,
/// 0.3 s.
PeerLoop klipper_pid(const PlantIdentity& id);
/// Kalico's pid_v: velocity form on the measurement, smoothed over 1 s, 0.3 s.
PeerLoop kalico_velocity_pid(const PlantIdentity& id);
/// RepRapFirmware's model-based PID: full power while P + D + model duty saturate, integral preset to the
/// model's hold duty, 0.25 s.
PeerLoop reprap_model_pid(const PlantIdentity& id);
/// SIMC PI (Skogestad 2003) with conditional integration: the plain loop, 0.1 s.
PeerLoop plain_pi(const PlantIdentity& id);

std::vector<PeerLoop> peer_loops(const PlantIdentity& id);

}  // namespace meltstage::tb
