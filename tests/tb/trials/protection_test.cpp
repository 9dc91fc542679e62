// SPDX-License-Identifier: Apache-2.0
// Faults of a heated head and healthy jobs, with the chip alone; beside the firmware rules: `meltstage bench
// protection`.
#include "tb/trials/protection.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "tb/trials/commissioning.hpp"
#include "tb/trials/heated_run.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

struct Wanted {
  HeadFault fault;
  bool feedback;
  double within_s;
  std::uint16_t fault_bit;  // 0: any
  double onset_s = 0.0;
  double noise_degc = 0.05;
};
constexpr double kFuseMargin_degc = 60.0;  // a thermal fuse opens so far above the set-point
constexpr std::uint16_t bit(spec::Fault fault) { return static_cast<std::uint16_t>(1u << fault); }

class HeadFaults : public testing::TestWithParam<std::tuple<const char*, Wanted>> {};

TEST_P(HeadFaults, AreSeenInTime) {
  const auto& [plant, wanted] = GetParam();
  const double degc = std::string(plant) == "PH-1" ? 110.0 : 220.0;
  const FaultOutcome outcome = run_fault(
      {plant_config(plant), degc, wanted.fault, wanted.feedback, 7, wanted.onset_s, wanted.noise_degc},
      tuned_settings(plant_config(plant), degc), Protector::chip);
  EXPECT_GE(outcome.detected_s, 0.0);
  EXPECT_LE(outcome.detected_s, wanted.within_s);
  EXPECT_EQ(outcome.faults & wanted.fault_bit, wanted.fault_bit);
  EXPECT_LE(outcome.block_peak_degc, degc + kFuseMargin_degc);
}

INSTANTIATE_TEST_SUITE_P(
    All, HeadFaults,
    testing::Combine(
        testing::Values("PH-1", "E3D-like"),
        testing::Values(Wanted{HeadFault::falls_out, true, 1.0, bit(spec::kFaultRate)},
                        Wanted{HeadFault::half_out, true, 2.0, bit(spec::kFaultRate)},
                        Wanted{HeadFault::half_out, true, 15.0, bit(spec::kFaultNotHeating), 15.0},
                        Wanted{HeadFault::half_out, true, 25.0, bit(spec::kFaultNotHeating), 30.0},
                        Wanted{HeadFault::half_out, true, 40.0, bit(spec::kFaultNotHeating), 60.0},
                        Wanted{HeadFault::dead_low, true, 330.0, 0, 0.0, 0.2},
                        Wanted{HeadFault::dead_low, true, 330.0, 0, 0.0, 0.3},
                        Wanted{HeadFault::frozen_low, true, 120.0, 0},
                        Wanted{HeadFault::heater_open, true, 60.0, 0},
                        Wanted{HeadFault::switch_short, true, 1e-3, bit(spec::kFaultHeaterFb)},
                        Wanted{HeadFault::switch_short, false, 60.0, 0},
                        Wanted{HeadFault::switch_short_off, true, 1e-3, bit(spec::kFaultHeaterFb)})));

// The same fault with the detectors off is not seen: what trips above are the detectors.
TEST(HeadFaultsControl, AreNotSeenWithoutDetectors) {
  std::vector<HeadSetting> settings = tuned_settings(plant_config("PH-1"), 110.0);
  for (const HeadSetting& off : detectors_off()) settings.push_back(off);
  HeatedRun run({}, settings);
  run.set_point(110.0);
  run.start();
  run.until(60.0);
  run.head().plant().set_sensor_coupling(run.cycle(), 0.0);
  run.until(200.0);
  EXPECT_FALSE(std::isfinite(run.tripped_s()));
  EXPECT_GT(run.heater_degc(), 160.0) << "133 in hold";
}

TEST(HealthyJobs, TripNothing) {
  unsigned noisy = 0;
  for (std::uint64_t seed = 100'001; seed <= 100'010; ++seed) {
    const HealthyJob job = run_healthy_job(seed);
    EXPECT_FALSE(std::isfinite(job.tripped_s))
        << "seed " << seed << ": " << job.what << ", faults " << job.faults;
    noisy += job.noisy_frames;
  }
  EXPECT_GT(noisy, 100u);
}

// Known heads: the rate and the dead time of the research behind the settings (PH-1 0.621 degC/s, 11.9 s;
// E3D-like 2.24, 5.0).
TEST(StepResponse, IsThatOfTheKnownHeads) {
  EXPECT_NEAR(step_response(plant_config("PH-1")).rate_degc_per_s, 0.621, 0.002);
  EXPECT_NEAR(step_response(plant_config("PH-1")).dead_time_s, 11.9, 0.1);
  EXPECT_NEAR(step_response(plant_config("E3D-like")).rate_degc_per_s, 2.24, 0.01);
  EXPECT_NEAR(step_response(plant_config("E3D-like")).dead_time_s, 5.0, 0.1);
}

}  // namespace
}  // namespace meltstage::tb
