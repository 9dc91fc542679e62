// SPDX-License-Identifier: Apache-2.0
// `meltstage chip tune` on a served head, from cold to gains and detectors.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <utility>

#include "tb/devices/heater.hpp"
#include "tests/host/served_chip.hpp"

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
  Tune() { EXPECT_EQ(command("set HOST_WD=0 SETPOINT=110").status, 0); }
  Ran command(const std::string& words) const {
    return run_command(fmt::format("chip {} --port {} --timeout 10", words, chip_.port()));
  }
  ServedChip chip_{"--speed max --plant E3D-like"};
};

TEST_F(Tune, CommissionsTheHeadItFinds) {
  const double before = figure(command("read KP").output, "KP");
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
  // 5.0 s and 2.24 degC/s by a step of full power; the relay's own width makes the dead time longer
  EXPECT_NEAR(figure(command("read LBA_TIME").output, "LBA_TIME"), 2.5 * 5.0, 0.3 * 2.5 * 5.0);
  EXPECT_NEAR(figure(ran.output, "steepest rise"), 2.24, 0.3 * 2.24);
  EXPECT_NEAR(figure(ran.output, "HEAT_RATE"), 13107.2 / 157.0, 0.3 * 13107.2 / 157.0);
  EXPECT_EQ(figure(command("read HOLD_TIME").output, "HOLD_TIME"), 20.0);
  EXPECT_EQ(figure(command("read AT_WINDOW").output, "AT_WINDOW"), 1.0) << "wider for the relay only";
  EXPECT_THAT(ran.output, HasSubstr("step of 3 degC"));
  EXPECT_THAT(command("read FAULT").output, HasSubstr("none"));
  EXPECT_THAT(command("read STATUS").output, HasSubstr("run, at temperature")) << "it holds its set-point";
  EXPECT_EQ(figure(command("read SETPOINT").output, "SETPOINT"), kSetpoint_degc);

  // what it found outlives the chip's power
  const std::string file = (chip_.folder() / "head.toml").string();
  ASSERT_EQ(command("save " + file).status, 0);
  const std::string found = command("read KP KFF CTRL LBA_TIME").output;
  ASSERT_EQ(command("set KP=0.01 KFF=0.001 CTRL=55 LBA_TIME=36").status, 0);
  const Ran refused = command("restore " + file);
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.output, StartsWith("meltstage: restore: heating is on"));
  ASSERT_EQ(command("stop").status, 0);
  ASSERT_EQ(command("restore " + file).status, 0);
  EXPECT_EQ(command("read KP KFF CTRL LBA_TIME").output, found);
}

TEST_F(Tune, IsRefusedWhereItCanMeasureNothing) {
  for (const auto& [setting, refusal] :
       {std::pair{"SETPOINT=44.9", "SETPOINT: found 44.9 degC, expected at least 45.0"},
        {"T_AMB=60", "T_AMB: found 60.0 degC, expected the room's temperature; the head reads 25."},
        {"MODE=1", "MODE: found 1 (manual), expected 0"}}) {
    ASSERT_EQ(command("set SETPOINT=110 T_AMB=25 MODE=0").status, 0);
    ASSERT_EQ(command(fmt::format("set {}", setting)).status, 0);
    const std::string before = command("read CTRL LBA_TIME HOLD_TIME AT_WINDOW").output;
    const Ran ran = command("tune");
    EXPECT_EQ(ran.status, 2) << setting;
    EXPECT_THAT(ran.output, StartsWith(fmt::format("meltstage: {}", refusal)));
    EXPECT_EQ(figure(command("read DUTY").output, "DUTY"), 0.0);
    EXPECT_EQ(command("read CTRL LBA_TIME HOLD_TIME AT_WINDOW").output, before);
  }
}

// The relay's swing reaches T_MAX: the experiment ends with the heater off and the gains as they were.
TEST_F(Tune, AFaultEndsIt) {
  ASSERT_EQ(command("set T_MAX=115").status, 0);
  const std::string before = command("read KP CTRL LBA_TIME HOLD_TIME AT_WINDOW SETPOINT").output;
  const Ran ran = command("tune");
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, StartsWith("meltstage: autotune stopped: OverTemp"));
  EXPECT_THAT(ran.output, HasSubstr("heater off, registers as before\n"));
  EXPECT_THAT(command("read FIRST_FAULT").output, HasSubstr("OverTemp"));
  EXPECT_EQ(figure(command("read DUTY").output, "DUTY"), 0.0);
  EXPECT_EQ(command("read KP CTRL LBA_TIME HOLD_TIME AT_WINDOW SETPOINT").output, before);
}

}  // namespace
}  // namespace meltstage
