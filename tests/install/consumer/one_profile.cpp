// SPDX-License-Identifier: Apache-2.0
// A move by the part that plans profiles, alone.
#include <meltstage/motion/profile/profile.hpp>

int main() {
  using namespace meltstage::motion;
  return plan_scurve(asymmetric_limits(400, 4000, 4000, 1e6, 1e6), 20.0).duration_s > 0.0 ? 0 : 1;
}
