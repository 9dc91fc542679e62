// SPDX-License-Identifier: Apache-2.0
// QUALITY: each figure over a heat-up and a cool-down with known numbers, and what starts and stops it.
#include "cmodel/quality.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "support.hpp"

namespace meltstage::chip {
namespace {

struct Bench {
  Quality q;
  QualityIn in{.run = true,
               .sample = false,
               .tenth = false,
               .pv = temp(25),
               .target = temp(100),
               .window = 10,
               .at_temp = false,
               .heater = false};

  void clock() {
    q.step(in);
    in.sample = in.tenth = false;
  }
  // 0.1 s with one sample in it.
  void tenth(double degc) {
    in.tenth = true;
    clock();
    in.pv = temp(degc);
    in.sample = true;
    clock();
  }
};

TEST(Quality, OvershootIsInTheDirectionOfTheChange) {
  Bench up;
  up.clock();
  for (const double degc : {90.0, 101.5, 100.25, 97.0}) up.tenth(degc);
  EXPECT_EQ(up.q.over_q, temp(1.5));
  EXPECT_EQ(up.q.peak_q, temp(101.5));

  Bench down;
  down.in.pv = temp(120);
  down.clock();
  for (const double degc : {118.0, 98.75, 102.0}) down.tenth(degc);
  EXPECT_EQ(down.q.over_q, temp(1.25));
  EXPECT_EQ(down.q.peak_q, temp(120));
}

TEST(Quality, BandTimeIsTheLastEntry) {
  Bench b;
  b.clock();
  b.tenth(98.0);
  EXPECT_EQ(b.q.band_q, 0xFFFF);
  b.tenth(99.0);  // 1.0 degC: the window's edge belongs to it
  EXPECT_EQ(b.q.band_q, 2);
  b.tenth(101.25);
  EXPECT_EQ(b.q.band_q, 0xFFFF);
  b.tenth(100.5);
  b.tenth(100.0);
  EXPECT_EQ(b.q.band_q, 4);
}

TEST(Quality, BandErrorCountsFromAtTemperatureOn) {
  Bench b;
  b.clock();
  b.tenth(99.5);
  EXPECT_EQ(b.q.error_q, 0);
  b.in.at_temp = true;
  b.clock();
  b.tenth(99.75);
  b.tenth(100.5);
  b.in.at_temp = false;
  b.tenth(98.0);  // it has left the band: that counts as well
  b.tenth(100.0);
  EXPECT_EQ(b.q.error_q, temp(2.0));
}

TEST(Quality, HeaterTimeIsInTenths) {
  Bench b;
  b.clock();
  b.in.heater = true;
  b.q.skip(b.in, 3 * spec::kClkHz / 10 - 1);
  EXPECT_EQ(b.q.on_q, 2u);
  b.clock();
  EXPECT_EQ(b.q.on_q, 3u);
  EXPECT_EQ(b.q.clocks_q, 0u);
  b.in.heater = false;
  b.clock();
  EXPECT_EQ(b.q.clocks_q, 0u);
}

TEST(Quality, ANewSetpointStartsAgain) {
  Bench b;
  b.clock();
  b.tenth(103.0);
  b.in.heater = true;
  b.q.skip(b.in, spec::kClkHz);
  b.in.target = temp(110);
  b.clock();
  EXPECT_EQ(b.q.over_q, 0);
  EXPECT_EQ(b.q.since_q, 0);
  EXPECT_EQ(b.q.band_q, 0xFFFF);
  EXPECT_EQ(b.q.on_q, 0u);
  EXPECT_EQ(b.q.peak_q, temp(103.0));
}

TEST(Quality, StandsStillWhileStoppedAndStartsAgainWithRun) {
  Bench b;
  b.clock();
  b.tenth(101.0);
  b.in.run = false;
  b.clock();
  b.tenth(140.0);
  b.in.target = temp(50);
  b.tenth(150.0);
  EXPECT_EQ(b.q.over_q, temp(1.0));
  EXPECT_EQ(b.q.peak_q, temp(101.0));
  EXPECT_EQ(b.q.since_q, 1);
  b.in.run = true;
  b.clock();
  EXPECT_EQ(b.q.over_q, 0);
  EXPECT_EQ(b.q.target_q, temp(50));
}

TEST(Quality, TimeStopsAtItsTop) {
  Bench b;
  b.clock();
  b.q.since_q = 0xFFFE;
  for (int i = 0; i < 3; ++i) b.tenth(50.0);
  EXPECT_EQ(b.q.since_q, 0xFFFF);
}

}  // namespace
}  // namespace meltstage::chip
