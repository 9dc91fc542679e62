// SPDX-License-Identifier: Apache-2.0
// `meltstage chip tune` on a served head, from cold to the gains.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "tb/devices/heater.hpp"
#include "tests/app/chip/served_chip.hpp"

namespace meltstage {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kSetpoint_degc = 110.0;

// The number behind a name at a line's beginning.
double figure(const std::string& output, const std::string& name) {
  std::smatch found;
  const std::regex pattern("(^|\n)" + name + " +([-0-9.]+)");
  return std::regex_search(output, found, pattern) ? std::stod(found[2]) : std::nan("");
}

class Tune : public ::testing::Test {
 protected:
  Tune() { EXPECT_EQ(command("set HOST_WD=0 HOLD_TIME=0 SETPOINT=110").status, 0); }
  Ran command(const std::string& words) const {
    return run_command(fmt::format("chip {} --port {} --timeout 10", words, chip_.port()));
  }
  ServedChip chip_{"--speed max --plant E3D-like"};
};

TEST_F(Tune, LeavesTheGainsOfThePlantItFinds) {
  const double before = figure(command("read KP").output, "KP");
  ASSERT_EQ(command("run").status, 0);
  const Ran ran = command("tune");
  EXPECT_EQ(ran.status, 0) << ran.output;
  const tb::PlantConfig plant = tb::plant_config("E3D-like");
  const double hold_percent =
      100.0 * plant.block_ambient_w_per_k * (kSetpoint_degc - plant.ambient_degc) / plant.power_w;
  EXPECT_NEAR(figure(ran.output, "hold duty"), hold_percent, 0.03 * hold_percent);
  EXPECT_NEAR(figure(ran.output, "KP") / figure(ran.output, "ultimate gain"), 0.337,
              0.005);  // spec/chip.toml
  EXPECT_NE(figure(ran.output, "KP"), before);
  EXPECT_EQ(figure(command("read KP").output, "KP"), figure(ran.output, "KP"));
  EXPECT_THAT(command("read FAULT STATUS").output, HasSubstr("none"));
}

TEST_F(Tune, IsRefusedWhileTheHeaterIsOff) {
  const Ran ran = command("tune");
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, StartsWith("meltstage: CMD Tune: refused"));
  EXPECT_THAT(ran.output, HasSubstr("heating must be on (chip run)"));
}

// The relay's swing reaches T_MAX: the experiment ends with the heater off and the gains as they were.
TEST_F(Tune, AFaultEndsIt) {
  ASSERT_EQ(command("set T_MAX=115").status, 0);
  const double before = figure(command("read KP").output, "KP");
  ASSERT_EQ(command("run").status, 0);
  const Ran ran = command("tune");
  EXPECT_EQ(ran.status, 1);
  EXPECT_EQ(ran.output, "meltstage: autotune stopped by STOP or a fault\n");
  EXPECT_THAT(command("read FIRST_FAULT").output, HasSubstr("OverTemp"));
  EXPECT_EQ(figure(command("read DUTY").output, "DUTY"), 0.0);
  EXPECT_EQ(figure(command("read KP").output, "KP"), before);
}

}  // namespace
}  // namespace meltstage
