// SPDX-License-Identifier: Apache-2.0
// What a chip measures on a head, beside what the head is.
#include "tb/trials/commissioning.hpp"

#include <gtest/gtest.h>

#include "tb/trials/protection.hpp"

namespace meltstage::tb {
namespace {

void expect_like(const Commissioned& found, const PlantConfig& plant, double largest_dead_time_ratio) {
  const StepResponse step = step_response(plant);
  const double hold = plant.block_ambient_w_per_k / plant.power_w;
  EXPECT_GT(found.head.rate_degc_per_s / step.rate_degc_per_s, 0.75);
  EXPECT_LT(found.head.rate_degc_per_s / step.rate_degc_per_s, 1.35);
  EXPECT_GT(found.head.dead_time_s / step.dead_time_s, 0.9);
  EXPECT_LT(found.head.dead_time_s / step.dead_time_s, largest_dead_time_ratio);
  EXPECT_NEAR(found.head.hold_duty_per_k / hold, 1.0, 0.12) << "the room is not at T_AMB";
}

// Heads that no constant was found on.
TEST(Commissioning, FindsWhatAHeadIs) {
  for (std::uint64_t seed = 9001; seed <= 9004; ++seed) {
    SCOPED_TRACE(seed);
    const FaultCase drawn = draw_fault_case(seed);
    expect_like(commission({.plant = drawn.plant, .seed = seed}, drawn.setpoint_degc, drawn.setpoint_degc),
                drawn.plant, 1.5);
  }
}

// Steps of 0.25 degC and noise beside which a relay of 0.5 degC switches at random.
TEST(Commissioning, StandsANoisyCoarseSensor) {
  for (const auto& [name, degc] : {std::pair{"PH-1", 110.0}, {"E3D-like", 220.0}}) {
    for (const double noise_degc : {0.2, 0.3, 0.5}) {
      SCOPED_TRACE(testing::Message() << name << " " << noise_degc);
      const PlantConfig& plant = plant_config(name);
      const Commissioned found =
          commission({.plant = plant, .sensor = "MAX31855", .sensor_noise_degc = noise_degc}, degc, degc);
      expect_like(found, plant, 1.6);
      EXPECT_NEAR(found.noise_degc, noise_degc, 0.3 * noise_degc);
      EXPECT_LT(found.swing_degc, 0.3 + 0.5 * noise_degc);
    }
  }
}

}  // namespace
}  // namespace meltstage::tb
