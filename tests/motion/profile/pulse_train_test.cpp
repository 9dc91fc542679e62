// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/pulse_train.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "motion/profile/shaping.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::StartsWith;

constexpr double kClock_hz = 1e6;
const ScurveLimits limits = asymmetric_limits(400, 4000, 3000, 4e5, 1e5);

TEST(FixedPulses, RoundTripWithoutLoss) {
  for (const double pulses : {0.0, 0.5, -0.5, 1234567.25, -2e9, 0x1p-90})
    EXPECT_EQ(to_double(to_fixed(pulses)), pulses);
}

TEST(PulseAccumulators, AtAnyCycleAreThoseOfSteppingThere) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 50; ++i) {
    const auto any = [&](int bits) {
      return static_cast<FixedPulses>(static_cast<std::int64_t>(random())) * (FixedPulses{1} << bits);
    };
    const PulseAccumulators start{any(20), any(10), any(0), static_cast<std::int64_t>(random() >> 20)};
    PulseAccumulators stepped = start;
    for (std::uint64_t n = 0; n < 3000; ++n) {
      ASSERT_TRUE(start.position_after(n) == stepped.position) << n;
      stepped.tick();
    }
  }
}

TEST(PulseTrain, StaysOnThePlanAtEveryCycle) {
  for (const double pulses_per_mm : {1000.0, -2000.0 / 7.0}) {
    const JerkProfile profile = plan_quiet_move(limits, 30.0, {}, 0.01);
    const PulseTrain train(profile, pulses_per_mm, 17.25, kClock_hz);
    double worst = 0.0;
    for (std::uint64_t cycle = 0; cycle <= train.end_cycle() + 10; ++cycle) {
      const double planned =
          17.25 + pulses_per_mm * profile.sample(static_cast<double>(cycle) / kClock_hz).position_mm;
      worst = std::max(worst, std::abs(to_double(train.position(cycle)) - planned));
    }
    EXPECT_LE(worst, PulseTrain::kLargestErrorPulses);
  }
}

TEST(PulseTrain, EqualsAGeneratorThatOnlyAdds) {
  const JerkProfile profile = plan_scurve(limits, 12.0);
  const PulseTrain train(profile, 1000.0, 0.0, kClock_hz);
  std::size_t segment = 0;
  PulseAccumulators hardware;
  for (std::uint64_t cycle = 0; cycle < train.end_cycle(); ++cycle) {
    if (segment < train.segments() && train.first_cycle(segment) == cycle)
      hardware = train.accumulators(segment++);
    ASSERT_TRUE(hardware.position == train.position(cycle)) << cycle;
    hardware.tick();
  }
  EXPECT_EQ(segment, train.segments());
}

TEST(PulseTrain, StepsComeAtMostOneCycleBehindThePlan) {
  const JerkProfile profile = plan_scurve(limits, 12.0);
  const PulseTrain train(profile, 1000.0, 0.0, kClock_hz);
  std::uint64_t from = 0;
  for (int pulse = 0; pulse < 12000; ++pulse) {
    const double middle = pulse + 0.5;
    const std::uint64_t cycle = train.cycle_reaching(to_fixed(middle), from);
    const double exact = profile.time_at(middle / 1000.0) * kClock_hz;
    ASSERT_GE(static_cast<double>(cycle), exact - 1e-3) << pulse;
    ASSERT_LE(static_cast<double>(cycle), exact + 1.0 + 1e-3) << pulse;
    from = cycle;
  }
}

TEST(PulseTrain, LooksOnlyForwards) {
  const JerkProfile profile = plan_scurve(limits, 12.0);
  const PulseTrain train(profile, 1000.0, 0.0, kClock_hz);
  const std::uint64_t cycle = train.cycle_reaching(to_fixed(6000.0), 0);
  EXPECT_EQ(train.cycle_reaching(to_fixed(6000.0), cycle - 100), cycle);
  EXPECT_EQ(train.cycle_reaching(to_fixed(6000.0), cycle + 100), cycle + 100);
  EXPECT_EQ(train.cycle_reaching(to_fixed(13000.0), 5), train.end_cycle());
}

// An axis that hardly moves while another one goes slowly: its jerk lasts for seconds.
TEST(PulseTrain, StaysOnAPlanOfLongJerks) {
  constexpr double kFast_hz = 12e6, kPulses_per_mm = 2000.0;
  const JerkProfile profile = stretched(plan_scurve(limits, 0.01), 1e4);
  const PulseTrain train(profile, kPulses_per_mm, 0.0, kFast_hz);
  EXPECT_GT(train.segments(), profile.segments);
  double worst = 0.0;
  for (int i = 0; i <= 10'000; ++i) {
    const auto cycle = static_cast<std::uint64_t>(static_cast<double>(train.end_cycle()) * i / 10'000.0);
    const double planned = kPulses_per_mm * profile.sample(static_cast<double>(cycle) / kFast_hz).position_mm;
    worst = std::max(worst, std::abs(to_double(train.position(cycle)) - planned));
  }
  EXPECT_LE(worst, PulseTrain::kLargestErrorPulses);
  EXPECT_THAT(error_of([] { PulseTrain(stretched(plan_scurve(limits, 0.01), 1e6), 1.0, 0.0, kFast_hz); }),
              StartsWith("pulse train: found a jerk that lasts"));
  EXPECT_THAT(error_of([] { PulseTrain(plan_scurve(limits, 1.0), 1.0, 0.0, 1e20); }),
              StartsWith("pulse train: found 0."));
}

TEST(PulseTrain, OfNoMotionStandsStill) {
  const PulseTrain train(plan_scurve(limits, 0.0), 1000.0, 3.5, kClock_hz);
  EXPECT_EQ(train.end_cycle(), 0U);
  EXPECT_EQ(to_double(train.position(100)), 3.5);
}

TEST(PulseTrain, RefusesPositionsBeyondItsRange) {
  EXPECT_THAT(error_of([] { PulseTrain(plan_scurve(limits, 30.0), 1e8, 0.0, kClock_hz); }),
              StartsWith("pulse train: found position of 3000000000 pulses"));
  EXPECT_THAT(error_of([] { PulseTrain(plan_scurve(limits, 30.0), 1e3, 0.0, 0.0); }),
              StartsWith("pulse train: found clock of 0 Hz"));
}

}  // namespace
}  // namespace meltstage::motion
