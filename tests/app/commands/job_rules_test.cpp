// SPDX-License-Identifier: Apache-2.0
// What the fields of a job have to do with each other, and what its verdict asks for.
#include "app/print/job_rules.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class JobRules : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("meltstage_job_rules." + std::to_string(getpid()));
    fs::create_directories(folder_);
    write("bumps.csv", "x_mm,y_mm\n10,10\n12,10\n10,12\n12,12\n");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  // A job that is at temperature soon, and what else its sections say.
  Ran print(const std::string& more, const std::string& temperature = "setpoint_degc = 28\n",
            const std::string& head = "") const {
    write("job.toml", "[coordinates]\nfile = \"bumps.csv\"\n[head]\nplant = \"E3D-like\"\n" + head +
                          "[temperature]\ndwell_s = 0.3\n" + temperature + more);
    return run_command("print " + (folder_ / "job.toml").string() + " --rtl none --out " +
                       (folder_ / "out").string());
  }
  nlohmann::json figure(const std::string& what) const {
    const auto summary = nlohmann::json::parse(std::ifstream(folder_ / "out/summary.json"));
    for (const auto& figure : summary.at("key_figures"))
      if (figure.at("what") == what) return figure.at("value");
    ADD_FAILURE() << "no figure " << what;
    return {};
  }
  std::string setting(const std::string& name) const {
    const auto summary = nlohmann::json::parse(std::ifstream(folder_ / "out/summary.json"));
    for (const auto& setting : summary.at("settings"))
      if (setting.at("name") == name) return setting.at("text");
    return {};
  }
  void expect_refused(const Ran& ran, const std::string& part) const {
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr(part));
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_FALSE(fs::exists(folder_ / "out"));
  }

  // The same with a print in the folder already.
  void expect_job_refused(const Ran& ran, const std::string& part) const {
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr(part));
  }

  fs::path folder_;
};

TEST_F(JobRules, AFieldThatTheChipWouldRefuseIsNamed) {
  expect_refused(print("", "setpoint_degc = 498\n"),
                 "job.toml:7:17: temperature.setpoint_degc: found 498, expected at most 495");
  expect_refused(print("[registers]\nT_MAX = 30.0\n"),
                 "job.toml:9:9: registers.T_MAX: found 30, expected at least 33");
  expect_refused(print("[registers]\nSETPOINT = 66.0\nT_MAX = 70.0\n"),
                 "registers.T_MAX: found 70, expected at least 71");
  expect_refused(print("[registers]\nLOCK = 1\n"), "registers.LOCK: found 1, expected 0");
}

TEST_F(JobRules, AHeadThatCannotComeToTheSetPointIsRefused) {
  expect_refused(
      print("", "setpoint_degc = 28\n", "ambient_degc = 60\n"),
      "temperature.setpoint_degc: found 28, expected at least 59: the head does not get colder than "
      "head.ambient_degc");
  expect_refused(
      print("[registers]\nT_MAX = 50\n", "setpoint_degc = 30\nwindow_degc = 60\n", "ambient_degc = 55\n"),
      "head.ambient_degc: found 55, expected less than 50");
}

TEST_F(JobRules, ASetPointThatTheSensorDoesNotMeasureIsRefused) {
  for (const std::string sensor : {"LM70", "ADT7310", "ADT7320"}) {
    const std::string head = "sensor = \"" + sensor + "\"\n";
    expect_refused(
        print("", "setpoint_degc = 146\n", head),
        "job.toml:8:17: temperature.setpoint_degc: found 146, expected at most 145, which is 5 degC "
        "below the highest temperature that the sensor " +
            sensor + " measures");
    expect_refused(
        print("[registers]\nT_MAX = 150.1\n", "setpoint_degc = 28\n", head),
        "job.toml:10:9: registers.T_MAX: found 150.1, expected at most 150, the highest temperature");
  }
  expect_refused(print("[registers]\nSETPOINT = 250\nT_MAX = 290\n", "", "sensor = \"LM70\"\n"),
                 "registers.SETPOINT: found 250, expected at most 145");
}

// By itself T_MAX is 40 degC above the set-point, but no higher than a reading can be.
TEST_F(JobRules, TheLimitStaysWithinWhatTheSensorMeasures) {
  const Ran ran = print("[[event]]\nat_s = 0.05\nwhat = \"emergency-stop\"\n", "setpoint_degc = 145\n",
                        "sensor = \"LM70\"\n");
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_EQ(setting("T_MAX"), "150 degC");
}

// What [registers] says of the set-point and the period counts for all that is worked out from them.
TEST_F(JobRules, WhatFollowsFromARegisterGoesByTheJobsValueOfIt) {
  const std::string stop = "[[event]]\nat_s = 0.05\nwhat = \"emergency-stop\"\n";
  const auto gains = [&] {
    return std::vector{setting("KI_APPROACH"), setting("KI_HOLD"), setting("KD"), setting("TS")};
  };
  EXPECT_EQ(print(stop, "setpoint_degc = 28\nperiod_ms = 200\n").status, 1);
  const auto expected = gains();
  EXPECT_EQ(setting("T_MAX"), "68 degC");
  EXPECT_EQ(print("[registers]\nTS = 200\nSETPOINT = 38\n" + stop).status, 1);
  EXPECT_EQ(gains(), expected);
  EXPECT_EQ(setting("T_MAX"), "78 degC");
}

TEST_F(JobRules, ThePathIsTheFastestUnlessTheJobSaysOtherwise) {
  write("bumps.csv", "x_mm,y_mm\n100.8,100.8\n105.6,100.8\n");
  EXPECT_EQ(print("").status, 0);
  EXPECT_EQ(setting("Path metric"), "time");
}

// The sum of these hops is above the bound by its last bit.
TEST_F(JobRules, RoundingIsNoWayAboveTheCheapest) {
  std::string bumps = "x_mm,y_mm\n";
  for (const char* bump :
       {"100.8,100.8", "105.6,100.8", "102.4,101.6", "103.2,101.6", "104.8,101.6", "106.4,101.6",
        "104.0,102.4", "105.6,102.4", "100.8,103.2", "102.4,103.2", "103.2,103.2", "104.0,103.2",
        "106.4,103.2", "102.4,104.0", "104.0,104.0", "105.6,104.0", "101.6,104.8", "102.4,104.8",
        "106.4,104.8", "100.8,105.6", "101.6,105.6", "103.2,105.6", "104.0,105.6", "102.4,106.4"})
    bumps += std::string(bump) + "\n";
  write("bumps.csv", bumps);
  const Ran ran = print("[print]\nmetric = \"manhattan\"\n");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_EQ(figure("Path, at most above the cheapest"), 0.0);
}

TEST_F(JobRules, AControlPeriodGivesTheSensorItsTime) {
  expect_refused(print("", "setpoint_degc = 28\nperiod_ms = 50\n"),
                 "temperature.period_ms: found 50, expected at least 100 ms, in which the sensor MAX31855");
  expect_refused(print("[registers]\nTS = 50\n"), "registers.TS: found 50, expected at least 100 ms");
}

// As by `chip set`.
TEST_F(JobRules, ARegisterHoldsWhatTheJobSays) {
  expect_refused(
      print("[registers]\nKP = 0.000000001\n"),
      "job.toml:9:6: registers.KP: found 1e-09, expected 0, or 1.52588e-05 1/K at least: the register "
      "would hold 0");
  expect_refused(print("[registers]\nMODE = 0.4\n"), "registers.MODE: found 0.4, expected a whole number");
  expect_refused(
      print("[registers]\nSETPOINT = 60.05\n"),
      "job.toml:9:12: registers.SETPOINT: found 60.05, expected what the register SETPOINT can hold; "
      "the nearest are 60 and 60.1 degC");
  expect_refused(print("[registers]\nKP = 0.00001\n"),
                 "registers.KP: found 1e-05, expected what the register KP can hold; the nearest are 0 and "
                 "1.52587891e-05 1/K");
  for (const auto& [field, found] : {std::pair("setpoint_degc = 28.25", "28.25"),
                                     {"window_degc = 0.55", "0.55"},
                                     {"dwell_s = 0.31", "0.31"}}) {
    write("job.toml", std::string("[coordinates]\nfile = \"bumps.csv\"\n[temperature]\n") + field + "\n");
    expect_refused(run_command("print " + (folder_ / "job.toml").string() + " --rtl none --out " +
                               (folder_ / "out").string()),
                   fmt::format("found {}, expected what the register", found));
  }
}

// A gain is a binary fraction: few decimal numbers are one.
TEST_F(JobRules, AGainIsHeldWhereRoundingChangesItByLessThanAHundredth) {
  const std::string stop = "[[event]]\nat_s = 0.05\nwhat = \"emergency-stop\"\n";
  for (const char* gain : {"KP = 0.05", "KI_HOLD = 0.1", "KFF = 0.003", "SETPOINT = 28.3", "KP = 0.000107"})
    EXPECT_EQ(print(std::string("[registers]\n") + gain + "\n" + stop).status, 1) << gain;
  expect_job_refused(print("[registers]\nKP = 0.00011\n"),
                     "the nearest are 0.000106811523 and 0.000122070312 1/K");
}

// The gains hold for the period that the register counts.
TEST_F(JobRules, APeriodIsOfWholeMilliseconds) {
  expect_refused(print("", "setpoint_degc = 28\nperiod_ms = 100.3\n"),
                 "temperature.period_ms: found 100.3, expected a whole number from 10 to 2000");
}

TEST_F(JobRules, AWholeNumberTooLargeIsShownAsItStands) {
  expect_refused(print("", "setpoint_degc = 9223372036854775807\n"),
                 "found 9223372036854775807, expected 0 to");
}

TEST_F(JobRules, AHostThatIsLostAtOnceIsToldAsSuch) {
  const Ran ran = print("[[event]]\nat_s = 0\nwhat = \"host-lost\"\n");
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("the host was lost before it saw a reading of the sensor"));
}

TEST_F(JobRules, WhatWasNotMeasuredIsNull) {
  const Ran ran = print("[[event]]\nat_s = 0.05\nwhat = \"emergency-stop\"\n");
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("heat-up none; print none"));
  for (const char* what :
       {"Time from RUN to at-temperature", "Largest error while printing", "Print time", "Homing",
        "Largest miss of a droplet", "Mean miss of a droplet", "Droplets beyond that"})
    EXPECT_TRUE(figure(what).is_null()) << what << " " << figure(what);
  EXPECT_EQ(figure("Droplets"), 0);
}

TEST_F(JobRules, ADropletBesideItsBumpMakesThePrintBad) {
  const std::string off = "[stage]\nbacklash_x_um = 1000\n";
  Ran ran = print(off);
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("of the droplets beside their bumps, the farthest by"));
  EXPECT_THAT(ran.output, HasSubstr("expected at most 100 um"));
  EXPECT_GT(figure("Largest miss of a droplet"), 100.0);
  EXPECT_GT(figure("Droplets beyond that"), 0);
  EXPECT_EQ(figure("Miss of a good droplet, at most"), 100.0);
  ran = print(off + "[print]\nplace_tolerance_um = 2000\n");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_EQ(figure("Droplets beyond that"), 0);
  EXPECT_EQ(print("").status, 0);
}

TEST_F(JobRules, AMoveThatCannotBeQuietIsRefused) {
  const std::string stage = "[stage]\nquiet = true\nmode_spread = 0.5\njerk_mm_s3 = 1e7\n";
  expect_refused(print(stage + "quiet_tolerance_um = 0.01\n"),
                 "job.toml:12:22: stage.quiet_tolerance_um: found 0.01, expected at least ");
  const Ran ran = print(stage + "quiet_tolerance_um = 1000\n");
  EXPECT_EQ(ran.status, 0) << ran.output;
}

TEST_F(JobRules, ATableOfDeviationsFitsItsAxis) {
  const auto with = [&](const std::string& rows) {
    write("x.csv", "target_mm,direction,deviation_um\n" + rows);
    return print("[stage]\ndeviations_x = \"x.csv\"\n");
  };
  const auto at = [](const std::string& mm, const std::string& um) {
    std::string rows;
    for (const char* direction : {"+", "-", "+", "-"}) rows += mm + "," + direction + "," + um + "\n";
    return rows;
  };
  expect_refused(with(at("0", "0") + at("250", "1")), "x.csv:6:1: found target_mm 250, expected 0 to 200");
  expect_refused(with(at("-5", "0") + at("100", "1")), "x.csv:2:1: found target_mm -5, expected 0 to 200");
  // commanded positions would not follow each other as their targets do
  expect_refused(with(at("0", "0") + at("1", "-1500") + at("2", "0")),
                 "x.csv:6:1: found deviations whose mean changes by -1500 um over the 1 mm");
  EXPECT_EQ(with(at("0", "0") + at("100", "10") + at("200", "-10")).status, 0);
  write("bumps.csv", "x_mm,y_mm\n10,10\n200,10\n");
  expect_job_refused(
      with(at("0", "0") + at("100", "10") + at("200", "-10")),
      "stage.deviations_x: found the bump of row 3, where the corrected axis is sent to 200.0100 mm");
}

TEST_F(JobRules, EachAxisHasItsOwnMotionAndTravel) {
  EXPECT_EQ(print("").status, 0);
  const double alike_s = figure("Print time");
  const std::string slow = "speed_mm_s = 2\nacceleration_mm_s2 = 20\n";
  EXPECT_EQ(print("[stage.x]\n" + slow).status, 0);
  EXPECT_GT(figure("Print time").get<double>(), alike_s + 1.0);
  EXPECT_EQ(print("[stage.x]\n" + slow + "[stage.y]\n" + slow).status, 0);
  const double both_s = figure("Print time");
  EXPECT_EQ(print("[stage]\n" + slow).status, 0);
  EXPECT_EQ(figure("Print time"), both_s);
  EXPECT_EQ(print("[stage]\n" + slow + "deceleration_mm_s2 = 2\n").status, 0);
  EXPECT_GT(figure("Print time").get<double>(), both_s + 0.3);

  write("bumps.csv", "x_mm,y_mm\n-40,10\n290,10\n");
  EXPECT_EQ(print("[stage.x]\ntravel_from_mm = -50\ntravel_to_mm = 300\n").status, 0);
  fs::remove_all(folder_ / "out");
  expect_refused(print(""), "bumps.csv: row 2: x is -40 mm on the stage, expected 0..200 mm (travel)");
  expect_refused(print("[stage.x]\ntravel_from_mm = -30\n"), "expected -30..200 mm (travel)");
  expect_refused(print("[stage.x]\ntravel_from_mm = 100\ntravel_to_mm = 50\n"),
                 "stage.x.travel_to_mm: found 50, expected 101 to 2000");
  expect_refused(print("[stage]\nstart_x_mm = 250\n[stage.x]\ntravel_to_mm = 220\n"),
                 "stage.start_x_mm: found 250, expected 0 to 220");
  expect_refused(print("[stage.x]\nlead_mm = 5\n"), "stage.x.lead_mm");
  expect_refused(print("[stage.z]\nspeed_mm_s = 5\n"), "stage.z");
}

TEST(DefaultPlaceTolerance, IsAQuarterOfTheSmallestDistanceWithinBounds) {
  const auto of = [](const std::vector<motion::Point>& bumps) {
    return app::default_place_tolerance_mm(bumps);
  };
  EXPECT_EQ(of({{1.0, 1.0, 1}}), 0.1);
  EXPECT_EQ(of({{1.0, 1.0, 1}, {5.0, 1.0, 2}}), 0.1);
  EXPECT_NEAR(of({{1.0, 1.0, 1}, {9.0, 1.0, 2}, {1.0, 1.2, 3}, {9.1, 1.1, 4}}), 0.25 * std::sqrt(0.02),
              1e-12);
  EXPECT_EQ(of({{1.0, 1.0, 1}, {1.001, 1.0, 2}}), 0.01);
}

}  // namespace
}  // namespace meltstage
