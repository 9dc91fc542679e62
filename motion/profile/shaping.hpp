// SPDX-License-Identifier: Apache-2.0
// Input shaping: a motion is repeated by a few impulses whose vibrations cancel each other.
#pragma once

#include <array>
#include <cstddef>

#include "motion/profile/retarget.hpp"
#include "motion/profile/vibration.hpp"

namespace meltstage::motion {

/// Up to four impulses of positive amplitudes that sum to 1, so that a shaped motion keeps every limit of the
/// motion and ends where it ends. The first comes at time 0, the others in order.
struct Shaper {
  static constexpr std::size_t kMostImpulses = 4;

  std::size_t impulses = 1;
  std::array<double, kMostImpulses> amplitudes{1.0};
  std::array<double, kMostImpulses> times_s{};

  double duration_s() const { return times_s[impulses - 1]; }
};

/// Zero vibration: two impulses half a damped period apart (Smith 1957; Singer & Seering 1990).
Shaper zv_shaper(const Mode& mode);
/// Zero vibration and derivative: three impulses (Singer & Seering 1990).
Shaper zvd_shaper(const Mode& mode);
/// Modified ZV of Klipper: three impulses within three quarters of a period.
Shaper mzv_shaper(const Mode& mode);
/// Extra insensitive: a share `tolerated` (0..1, 1 excluded) of the vibration is left at the modelled
/// frequency for a wider band (Singhose et al. 1994). That share is exact without damping; with damping, for
/// which the amplitudes are Klipper's, less is left: of 0.05 at a damping ratio of 0.05 0.042, at 0.2 0.024.
Shaper ei_shaper(const Mode& mode, double tolerated = 0.05);

/// Vibration left of a step, as a share of that without a shaper.
/// @throws MotionError as check_mode, or if the shaper isn't as a Shaper must be.
double vibration_share(const Shaper& shaper, const Mode& mode);

/// The motion, from rest to rest, through the shaper: again segments of constant jerk, shaper.duration_s()
/// longer.
/// @throws MotionError if the motion doesn't begin and end at rest, the shaper isn't as a Shaper must be, or
/// together they have more segments than a JerkProfile holds (no S-curve does).
JerkProfile shaped(const JerkProfile& profile, const Shaper& shaper);

/// The shortest shaper for this very motion: up to three impulses at equal spacing, spacing and amplitudes
/// such that no frequency of the band leaves more than the tolerance behind. What the motion cancels by
/// itself the shaper needn't, so that it is shorter than one made for every motion. A hundredth of the
/// tolerance is kept back for the frequencies between those that are looked at. ZVD's two half periods bound
/// its length; where even they don't suffice, it is the one of which the envelope of the vibration is first
/// within the tolerance in the worst case, or without damping the one that leaves least; ZVD itself may be
/// some per cent earlier there.
/// @throws MotionError if the tolerance isn't above 0 or the band is none.
Shaper shortest_shaper(const JerkProfile& profile, const ModeBand& band, double tolerance_mm);

/// The move users get: the fastest S-curve under the limits through its shortest shaper.
JerkProfile plan_quiet_move(const ScurveLimits& limits, double distance_mm, const ModeBand& band,
                            double tolerance_mm);

}  // namespace meltstage::motion
