// SPDX-License-Identifier: Apache-2.0
// The firmware rules on readings made by hand: each threshold met and missed.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tb/trials/firmware_rules.hpp"

namespace meltstage::tb {
namespace {

constexpr double kNever_s = std::numeric_limits<double>::infinity();

// When the rule trips on reading(t) with target(t), seen each 0.1 s for 300 s.
template <class Rule>
double trips_at(const std::function<double(double)>& reading, const std::function<double(double)>& target) {
  Rule rule(150.0);
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.1 * i;
    if (rule.see(t, reading(t), target(t))) return t;
  }
  return kNever_s;
}

double at_100(double) { return 100.0; }
// 1 degC/s from cold, then there.
double healthy(double t) { return t < 75.0 ? 25.0 + t : 100.0; }

TEST(Rules, AHealthyHeatUpTripsNone) {
  EXPECT_EQ(trips_at<MarlinRule>(healthy, at_100), kNever_s);
  EXPECT_EQ(trips_at<KlipperRule>(healthy, at_100), kNever_s);
}

TEST(Rules, MarlinRunawayIsFourDegreesForFortySeconds) {
  for (const double below : {3.9, 4.1}) {
    const double at =
        trips_at<MarlinRule>([&](double t) { return t < 100.0 ? healthy(t) : 100.0 - below; }, at_100);
    if (below > 4.0)
      EXPECT_NEAR(at, 140.0, 0.25);
    else
      EXPECT_EQ(at, kNever_s);
  }
}

TEST(Rules, MarlinWatchIsTwoDegreesInTwentySeconds) {
  EXPECT_NEAR(trips_at<MarlinRule>([](double) { return 25.0; }, at_100), 20.0, 0.15);
  EXPECT_NEAR(trips_at<MarlinRule>([](double t) { return 25.0 + 0.09 * t; }, at_100), 20.0, 0.15);
  EXPECT_EQ(trips_at<MarlinRule>([](double t) { return 25.0 + 0.11 * t; }, at_100), kNever_s);
}

TEST(Rules, KlipperErrorIs120DegreeSeconds) {
  // 17 degC low is 12 beyond the hysteresis: ten checks.
  EXPECT_NEAR(trips_at<KlipperRule>([](double t) { return t < 100.0 ? healthy(t) : 83.0; }, at_100), 110.5,
              1.5);
  EXPECT_EQ(trips_at<KlipperRule>([](double t) { return t < 100.0 ? healthy(t) : 95.5; }, at_100), kNever_s);
}

TEST(Rules, KlipperGainIsTwoDegreesInTwentySeconds) {
  // The approach is given up after 20 s; by then the error has long passed its limit.
  EXPECT_NEAR(trips_at<KlipperRule>([](double) { return 25.0; }, at_100), 21.0, 1.5);
}

TEST(Rules, BothTripAtTheirHighestTemperature) {
  const auto hot = [](double t) { return t < 100.0 ? healthy(t) : 151.0; };
  EXPECT_NEAR(trips_at<MarlinRule>(hot, at_100), 100.0, 0.15);
  EXPECT_NEAR(trips_at<KlipperRule>(hot, at_100), 100.0, 0.15);
}

TEST(Rules, NeitherSeesAValueFrozenTwoDegreesLow) {
  const auto frozen = [](double t) { return t < 73.0 ? 25.0 + t : 98.0; };
  EXPECT_EQ(trips_at<MarlinRule>(frozen, at_100), kNever_s);
  EXPECT_EQ(trips_at<KlipperRule>(frozen, at_100), kNever_s);
}

}  // namespace
}  // namespace meltstage::tb
