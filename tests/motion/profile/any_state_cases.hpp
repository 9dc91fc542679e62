// SPDX-License-Identifier: Apache-2.0
// What a change of plan must keep from any state, and states and targets that are hard to plan for.
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include "motion/profile/retarget.hpp"

namespace meltstage::motion {

/// A change of plan; the target's position counts from the state's.
struct AnyState {
  ScurveLimits limits;
  MotionState state, target;
};

/// How the four jerks, A and D are drawn.
enum class Limits { symmetric, asymmetric };

/// Limits over several decades; a state from which they can be kept, every second one with a speed or an
/// acceleration at an edge (zero, next to zero, at the limit); a target at rest, every second one at, next to
/// or far from where the state is or stops.
AnyState random_any_state(std::mt19937_64& random, Limits kind);

/// From this state the limits can be kept: speed and acceleration are within them, and stay so when the
/// acceleration is taken away at once.
bool inside(const ScurveLimits& limits, const MotionState& state);

/// What is wrong with a profile, or nothing: jumps, an end elsewhere than at the target, a speed, an
/// acceleration or a jerk above its limit anywhere. Segments are cut where the speed or the acceleration
/// changes its sign, as the limits change there; between the cuts, the ends are the extremes.
/// A state outside the limits may leave them as far as it must.
std::string fault_of(const JerkProfile& profile, const AnyState& task);

/// The task in one line, for a message.
std::string text_of(const AnyState& task);

/// What random cases must all have met, or the property says little.
struct AnyStateSeen {
  std::uint64_t turns_back = 0, symmetric = 0;
};

/// What random motions to a speed must all have met.
struct MovingEndSeen {
  std::uint64_t goes_back = 0;  ///< the distance was too short for the change of speed
  std::uint64_t at_rest = 0, compared = 0;
};

/// A motion to a random target with a speed there: what is wrong with it, or which motion is faster; or
/// nothing. At rest plan_retarget() must not be faster, and with even limits not slower. With even limits no
/// first step of any jerk within them may be better (Bellman's principle: the step and the best motion from
/// where it leads are not faster).
std::string moving_end_case(std::mt19937_64& random, MovingEndSeen& seen);

/// What random motions from state to state must all have met.
struct AnyEndSeen {
  std::uint64_t with_acceleration = 0;  ///< at the end
  std::uint64_t at_speed = 0, compared = 0;
};

/// A motion from a random state to another one, with even limits: what is wrong with it, or which motion is
/// faster; or nothing. Without an acceleration at the end plan_to_speed() takes as long. No first step of any
/// jerk within the limits is better (Bellman's principle).
std::string any_end_case(std::mt19937_64& random, AnyEndSeen& seen);

/// What random motions of three axes must all have met.
struct TogetherSeen {
  std::uint64_t at_once = 0;  ///< in the time of the slowest axis alone
  std::uint64_t passing = 0;  ///< axes with a speed at the end
};

/// Three axes from random states to a random point that each passes with a random speed or stops at: what is
/// wrong with one of them, or with its time; or nothing.
std::string together_case(std::mt19937_64& random, TogetherSeen& seen);

/// A target and a stop from a random state: what is wrong with one of them, and for which task; or nothing.
std::string any_state_case(std::mt19937_64& random, AnyStateSeen& seen);

}  // namespace meltstage::motion
