// SPDX-License-Identifier: Apache-2.0
// Speed along a curve within feed, acceleration, jerk and chord error.
#pragma once

#include <vector>

#include "motion/profile/profile.hpp"
#include "motion/surface/nurbs.hpp"

namespace meltstage::motion {

/// What bounds the speed along a curve; all > 0.
struct FeedLimits {
  double feed_mm_s = 20.0;             ///< asked for
  double acceleration_mm_s2 = 1000.0;  ///< along the curve
  double jerk_mm_s3 = 2e4;             ///< along the curve
  double normal_acceleration_mm_s2 = 1000.0;
  double chord_error_mm = 1e-3;  ///< between the curve and the chord of a servo cycle
  double cycle_s = 1e-3;
};

/// Speed along a curve from rest to rest: S-curves that meet at constant speed.
struct FeedPlan {
  struct Block {
    double start_s = 0.0, start_mm = 0.0;
    Scurve profile;
  };
  std::vector<Block> blocks;
  double duration_s = 0.0;
  MotionState sample(double time_s) const;  ///< along the curve
};

/// Largest speed at `u` that keeps normal acceleration and chord error where the curve bends; at most the
/// feed.
double feed_limit_mm_s(const Nurbs& curve, double u, const FeedLimits& limits);

/// Plans the speed along the whole curve: breakpoints at the minima of the limit, S-curves between them, and
/// further breakpoints until no S-curve is above the limit. Where the curve turns at once, at a knot of three
/// or back along a line, the speed is such that the change of a servo cycle stays within normal acceleration
/// and chord error.
/// @throws MotionError if a limit isn't positive.
FeedPlan plan_feed(const Nurbs& curve, const ArcLength& length, const FeedLimits& limits);

}  // namespace meltstage::motion
