// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/fault_crosses.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

using testing::Contains;
using testing::Not;

std::uint16_t bit(unsigned fault) { return static_cast<std::uint16_t>(1u << fault); }

TEST(FaultCrosses, EachFaultInEachStateAndBesideEachOther) {
  constexpr std::size_t kFaults = spec::kFaultCount;
  EXPECT_EQ(FaultCrosses().holes().size(),
            kFaults * spec::kStates.size() + kFaults * (kFaults - 1) / 2 + kFaults * (kFaults - 1));
}

TEST(FaultCrosses, WhatLatchesIsMetWhereItDoes) {
  FaultCrosses crosses;
  chip::Chip before, after;
  before.sysctrl.state_q = spec::kStReadTemp;
  before.guard.fault_q = bit(spec::kFaultOverTemp);
  after.guard.fault_q = before.guard.fault_q | bit(spec::kFaultUnderTemp) | bit(spec::kFaultSensorStale);
  crosses.observe(before, after);
  const std::vector<std::string> holes = crosses.holes();
  EXPECT_THAT(holes, Not(Contains("fault UnderTemp in state ReadTemp")));
  EXPECT_THAT(holes, Not(Contains("faults UnderTemp and SensorStale in one clock")));
  EXPECT_THAT(holes, Not(Contains("fault SensorStale while OverTemp stands")));
  EXPECT_THAT(holes, Contains("fault OverTemp in state ReadTemp"));
  EXPECT_THAT(holes, Contains("faults OverTemp and UnderTemp in one clock"));
  EXPECT_THAT(holes, Contains("fault OverTemp while SensorStale stands"));
  EXPECT_EQ(holes.size(), FaultCrosses().holes().size() - 5);
}

TEST(FaultCrosses, AFaultThatStandsOrIsClearedIsNoNewOne) {
  FaultCrosses crosses;
  chip::Chip standing, cleared;
  standing.guard.fault_q = bit(spec::kFaultOverTemp);
  crosses.observe(standing, standing);
  crosses.observe(standing, cleared);
  EXPECT_EQ(crosses.holes().size(), FaultCrosses().holes().size());
}

}  // namespace
}  // namespace meltstage::tb
