// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/heater.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <stdexcept>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "base/rng.hpp"

namespace meltstage::tb {
namespace {

constexpr double kClock_hz = 1.0e6;

std::uint64_t at_s(double seconds) { return static_cast<std::uint64_t>(std::llround(seconds * kClock_hz)); }

// What a step response shows, read off at 10 ms as in a laboratory: rise, two-point fit (28.3 % and 63.2 %),
// steepest slope and where its tangent starts.
struct StepFigures {
  double rise_k;
  double tau_s;
  double theta_s;
  double slope_k_per_s;
  double tangent_dead_time_s;
};

StepFigures step_figures(const PlantConfig& config) {
  HeaterPlant plant(config, kClock_hz);
  plant.set_heater(0, true);
  constexpr double kStep_s = 0.01;
  std::vector<double> rise;
  for (int i = 0; i <= 1000000; ++i)
    rise.push_back(plant.sensor_degc(at_s(i * kStep_s)) - config.ambient_degc);
  const auto time_to = [&](double fraction) {
    std::size_t i = 0;
    while (rise.at(i) < fraction * rise.back()) ++i;
    return static_cast<double>(i) * kStep_s;
  };
  const double t28 = time_to(0.283);
  const double t63 = time_to(0.632);
  std::size_t steepest = 1;
  for (std::size_t i = 1; i < rise.size(); ++i) {
    if (rise[i] - rise[i - 1] > rise[steepest] - rise[steepest - 1]) steepest = i;
  }
  const double slope = (rise[steepest] - rise[steepest - 1]) / kStep_s;
  return {rise.back(), 1.5 * (t63 - t28), t63 - 1.5 * (t63 - t28), slope,
          static_cast<double>(steepest) * kStep_s - rise[steepest] / slope};
}

struct PlantFigures {
  const char* name;
  StepFigures expected;
};

class KnownPlant : public ::testing::TestWithParam<PlantFigures> {};

TEST_P(KnownPlant, StepResponseHasThePublishedFigures) {
  const StepFigures expected = GetParam().expected;
  const StepFigures found = step_figures(plant_config(GetParam().name));
  EXPECT_NEAR(found.rise_k, expected.rise_k, 0.5);
  EXPECT_NEAR(found.tau_s, expected.tau_s, 0.5);
  EXPECT_NEAR(found.theta_s, expected.theta_s, 0.1);
  EXPECT_NEAR(found.slope_k_per_s, expected.slope_k_per_s, 0.0015);
  EXPECT_NEAR(found.tangent_dead_time_s, expected.tangent_dead_time_s, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Plants, KnownPlant,
                         ::testing::Values(PlantFigures{"PH-1", {222, 327, 13.1, 0.621, 11.9}},
                                           PlantFigures{"PH-A", {308, 556, 15.6, 0.513, 14.3}},
                                           PlantFigures{"PH-B", {300, 301, 8.6, 0.927, 8.0}},
                                           PlantFigures{"PH-C", {267, 669, 22.4, 0.366, 20.4}},
                                           PlantFigures{"E3D-like", {353, 145, 5.4, 2.24, 5.0}}));

TEST(ThermalNetwork, AgreesWithTheMatrixExponential) {
  const PlantConfig config = plant_config("PH-B");
  const double loss = 0.06;
  const PlantDrive drive{17.0, 22.0, 0.6};
  Eigen::Matrix4d a = Eigen::Matrix4d::Zero();  // heater, block, sensor, 1
  a.row(0) << -config.heater_block_w_per_k, config.heater_block_w_per_k, 0.0, drive.power_w;
  a.row(0) /= config.heater_j_per_k;
  const double gba = config.block_ambient_w_per_k + loss;
  a.row(1) << config.heater_block_w_per_k, -config.heater_block_w_per_k - gba, 0.0, gba * drive.ambient_degc;
  a.row(1) /= config.block_j_per_k;
  a.row(2) << 0.0, 0.6, -1.0, 0.4 * drive.ambient_degc;
  a.row(2) /= config.sensor_lag_s;
  const ThermalNetwork network(config, loss);
  for (const double dt_s : {0.0, 1e-6, 0.01, 1.0, 30.0, 1000.0}) {
    const Eigen::Matrix4d scaled = a * dt_s;
    const Eigen::Vector4d expected = scaled.exp() * Eigen::Vector4d{140.0, 90.0, 60.0, 1.0};
    const PlantState found = network.advance({140.0, 90.0, 60.0}, drive, dt_s);
    EXPECT_NEAR(found.heater_degc, expected(0), 1e-8) << dt_s;
    EXPECT_NEAR(found.block_degc, expected(1), 1e-8) << dt_s;
    EXPECT_NEAR(found.sensor_degc, expected(2), 1e-8) << dt_s;
  }
}

TEST(ThermalNetwork, SensorLagEqualToATimeConstantOfTheBlockIsNoSpecialCase) {
  PlantConfig config = plant_config("PH-1");
  const double fast_s = ThermalNetwork(config, 0.0).time_constants_s().minCoeff();
  const PlantDrive drive{60.0, 25.0, 1.0};
  const auto sensor_after = [&](double lag_s) {
    config.sensor_lag_s = lag_s;
    return ThermalNetwork(config, 0.0).advance({25.0, 25.0, 25.0}, drive, 20.0).sensor_degc;
  };
  EXPECT_NEAR(sensor_after(fast_s), 0.5 * (sensor_after(fast_s * 0.999) + sensor_after(fast_s * 1.001)),
              1e-4);
  EXPECT_TRUE(std::isfinite(ThermalNetwork(config, 0.0).advance({25, 25, 25}, drive, 1e9).sensor_degc));
}

// Runge-Kutta at 1 ms with a ring buffer for the delay, the equations written down once more.
class FineSimulation {
 public:
  explicit FineSimulation(const PlantConfig& config)
      : config_(config),
        t_{config.ambient_degc, config.ambient_degc, config.ambient_degc},
        history_(static_cast<std::size_t>(std::llround(config.transport_delay_s / kStep_s)) + 1,
                 config.ambient_degc) {}

  static constexpr double kStep_s = 0.001;
  double power_w = 0.0;
  double extra_loss = 0.0;
  void droplet(double energy_j) { t_(1) -= energy_j / config_.block_j_per_k; }

  void step() {
    const double delayed0 = history_.at(next_);
    const double delayed1 = history_.at((next_ + 1) % history_.size());
    const auto slope = [&](const Eigen::Vector3d& t, double delayed) {
      const double flow = config_.heater_block_w_per_k * (t(0) - t(1));
      const double loss = (config_.block_ambient_w_per_k + extra_loss) * (t(1) - config_.ambient_degc);
      return Eigen::Vector3d{(power_w - flow) / config_.heater_j_per_k, (flow - loss) / config_.block_j_per_k,
                             (delayed - t(2)) / config_.sensor_lag_s};
    };
    const double middle = 0.5 * (delayed0 + delayed1);
    const Eigen::Vector3d k1 = slope(t_, delayed0);
    const Eigen::Vector3d k2 = slope(t_ + 0.5 * kStep_s * k1, middle);
    const Eigen::Vector3d k3 = slope(t_ + 0.5 * kStep_s * k2, middle);
    const Eigen::Vector3d k4 = slope(t_ + kStep_s * k3, delayed1);
    t_ += kStep_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    history_.at(next_) = t_(1);
    next_ = (next_ + 1) % history_.size();
  }
  const Eigen::Vector3d& state() const { return t_; }

 private:
  PlantConfig config_;
  Eigen::Vector3d t_;
  std::vector<double> history_;
  std::size_t next_ = 0;
};

TEST(HeaterPlant, FollowsAFineRungeKuttaUnderPwmDropletsAndLoad) {
  const PlantConfig config = plant_config("E3D-like");
  HeaterPlant plant(config, kClock_hz);
  FineSimulation fine(config);
  double worst_k = 0.0;
  for (int ms = 0; ms < 60000; ++ms) {
    const std::uint64_t cycle = at_s(ms * 0.001);
    const bool on = ms % 1000 < 400;
    plant.set_heater(cycle, on);
    if (ms == 30000) {
      plant.set_extra_loss_w_per_k(cycle, 0.05);
      fine.extra_loss = 0.05;
    }
    if (ms > 20000 && ms % 500 == 250) {
      plant.droplet(cycle, 0.2);
      fine.droplet(0.2);
    }
    worst_k = std::max(worst_k, std::abs(plant.heater_degc(cycle) - fine.state()(0)));
    worst_k = std::max(worst_k, std::abs(plant.block_degc(cycle) - fine.state()(1)));
    worst_k = std::max(worst_k, std::abs(plant.sensor_degc(cycle) - fine.state()(2)));
    fine.power_w = on ? config.power_w : 0.0;
    fine.step();
  }
  EXPECT_LT(worst_k, 5e-5);
  EXPECT_GT(plant.sensor_degc(at_s(60.0)), 50.0);  // it did heat
}

TEST(HeaterPlant, ReadingsDoNotChangeLaterReadings) {
  HeaterPlant often(plant_config("PH-1"), kClock_hz);
  HeaterPlant seldom(plant_config("PH-1"), kClock_hz);
  Rng rng = stream(5, "edges");
  std::uint64_t cycle = 0;
  bool on = false;
  for (int i = 0; i < 500; ++i) {
    const std::uint64_t next = cycle + 1 + rng.below(200000);
    for (int k = 0; k < 5; ++k) {
      cycle += rng.below((next - cycle) / 5 + 1);
      often.sensor_degc(cycle);
      often.block_degc(cycle);
    }
    cycle = next;
    on = !on;
    often.set_heater(cycle, on);
    seldom.set_heater(cycle, on);
  }
  EXPECT_EQ(often.sensor_degc(cycle + 5), seldom.sensor_degc(cycle + 5));
  EXPECT_EQ(often.heater_degc(cycle + 5), seldom.heater_degc(cycle + 5));
}

TEST(HeaterPlant, SensorFeelsNothingBeforeTheTransportDelay) {
  HeaterPlant plant(plant_config("PH-1"), kClock_hz);
  plant.set_heater(at_s(1.0), true);
  EXPECT_EQ(plant.sensor_degc(at_s(3.0)), 25.0);
  EXPECT_GT(plant.sensor_degc(at_s(3.5)), 25.0);
}

TEST(HeaterPlant, DropletTakesItsHeatOutOfTheBlock) {
  HeaterPlant plant(plant_config("PH-1"), kClock_hz);
  plant.droplet(at_s(1.0), 8.0);
  EXPECT_NEAR(plant.block_degc(at_s(1.0)), 25.0 - 8.0 / 80.0, 1e-12);
  EXPECT_EQ(plant.sensor_degc(at_s(3.0)), 25.0);
  EXPECT_LT(plant.sensor_degc(at_s(4.0)), 25.0);
}

TEST(HeaterPlant, PowerGoesWithTheSquareOfTheSupply) {
  HeaterPlant plant(plant_config("PH-1"), kClock_hz);
  plant.set_heater(0, true);
  plant.set_supply_ratio(0, 0.9);
  EXPECT_NEAR(plant.power_w(), 48.6, 1e-12);
  EXPECT_NEAR(plant.block_degc(at_s(20000)), 25.0 + 48.6 / 0.27, 1e-6);
  plant.set_supply_ratio(at_s(20000), 0.0);
  EXPECT_EQ(plant.power_w(), 0.0);
}

TEST(HeaterPlant, AmbientMovesTheSteadyState) {
  HeaterPlant plant(plant_config("PH-1"), kClock_hz);
  plant.set_ambient_degc(0, 15.0);
  EXPECT_NEAR(plant.sensor_degc(at_s(20000)), 15.0, 1e-9);
}

TEST(HeaterPlant, FallenOutSensorReadsAmbientWhileTheBlockStaysHot) {
  HeaterPlant plant(plant_config("PH-1"), kClock_hz);
  plant.set_heater(0, true);
  const std::uint64_t hot = at_s(300.0);
  const double before_degc = plant.sensor_degc(hot);
  plant.set_sensor_coupling(hot, 0.0);
  const double expected_degc = 25.0 + (before_degc - 25.0) * std::exp(-10.0 / 4.0);
  EXPECT_NEAR(plant.sensor_degc(hot + at_s(10.0)), expected_degc, 1e-9);
  EXPECT_GT(plant.block_degc(hot + at_s(10.0)), before_degc);
}

TEST(HeaterPlant, ReducedCouplingScalesTheRise) {
  HeaterPlant plant(plant_config("PH-1"), kClock_hz);
  plant.set_heater(0, true);
  plant.set_sensor_coupling(0, 0.6);
  const std::uint64_t settled = at_s(20000.0);
  EXPECT_NEAR(plant.sensor_degc(settled), 25.0 + 0.6 * (plant.block_degc(settled) - 25.0), 1e-9);
}

TEST(HeaterPlant, OpenElementStaysColdWithTheSwitchClosed) {
  HeaterPlant plant(plant_config("PH-1"), kClock_hz);
  plant.set_faults(0, {.element_open = true});
  plant.set_heater(0, true);
  EXPECT_TRUE(plant.switch_conducting());
  EXPECT_EQ(plant.heater_degc(at_s(100.0)), 25.0);
}

TEST(HeaterPlant, ShortedSwitchHeatsWithoutCommandUntilTheSupplyIsCut) {
  HeaterPlant plant(plant_config("PH-1"), kClock_hz);
  plant.set_faults(0, {.switch_shorted = true});
  EXPECT_TRUE(plant.switch_conducting());
  const double hot_degc = plant.heater_degc(at_s(100.0));
  EXPECT_GT(hot_degc, 100.0);
  plant.set_supply_ratio(at_s(100.0), 0.0);
  EXPECT_LT(plant.heater_degc(at_s(200.0)), hot_degc);
}

TEST(HeaterPlant, RefusesToGoBackInTime) {
  HeaterPlant plant(plant_config("PH-1"), kClock_hz);
  plant.set_heater(100, true);
  EXPECT_THROW(plant.heater_degc(99), std::logic_error);
  EXPECT_THROW(plant.set_heater(99, false), std::logic_error);
}

TEST(HeaterPlant, BadPlantIsNamed) {
  PlantConfig config = plant_config("PH-1");
  config.block_j_per_k = 0.0;
  try {
    const HeaterPlant plant(config, kClock_hz);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "plant PH-1: block_j_per_k is 0, expected a finite number > 0");
  }
  EXPECT_THROW(plant_config("PH-9"), std::invalid_argument);
  for (const double delay_s : {-1.0, 1e12, double{INFINITY}, double{NAN}}) {
    config = plant_config("PH-1");
    config.transport_delay_s = delay_s;
    EXPECT_THROW(HeaterPlant(config, kClock_hz), std::invalid_argument) << delay_s;
  }
}

}  // namespace
}  // namespace meltstage::tb
