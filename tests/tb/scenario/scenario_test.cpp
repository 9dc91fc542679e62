// SPDX-License-Identifier: Apache-2.0
// Scenarios: what they say, what they do to the chip, and what a run keeps of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "tb/scenario/scripted_run.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr std::uint64_t at(double seconds) {
  return static_cast<std::uint64_t>(seconds * spec::kClkHz + 0.5);
}

std::unique_ptr<ScriptedRun> run_of(std::string_view text, double until_s) {
  ParsedScenario parsed = parse_scenario(text);
  EXPECT_FALSE(parsed.defect) << parsed.defect->found << ", expected " << parsed.defect->expected;
  auto run = std::make_unique<ScriptedRun>(std::move(parsed.scenario));
  run->until(at(until_s));
  return run;
}

TEST(Scenario, HeadAndEventsAreRead) {
  const ParsedScenario parsed = parse_scenario(
      "# a comment\r\nhead E3D-like ; sensor LM70\nnoise 0.25\n seed 77\nsecond_switch off\n"
      "1.5 set SETPOINT 110 # hot; 3 jump\n1.5 run;2 flip mem.active_q[3] 2");
  ASSERT_FALSE(parsed.defect) << parsed.defect->found;
  const HeadConfig& head = parsed.scenario.head;
  EXPECT_EQ(head.plant.name, "E3D-like");
  EXPECT_EQ(head.sensor, "LM70");
  EXPECT_EQ(head.sensor_noise_degc, 0.25);
  EXPECT_EQ(head.seed, 77U);
  EXPECT_FALSE(head.second_switch);
  ASSERT_EQ(parsed.scenario.events.size(), 3U);
  EXPECT_EQ(parsed.scenario.events[0].cycle, at(1.5));
  EXPECT_EQ(parsed.scenario.events[0].text, "set SETPOINT 110");
  EXPECT_EQ(parsed.scenario.events[2].text, "flip mem.active_q[3] 2");
}

TEST(Scenario, WhatIsNotUnderstoodIsToldByLine) {
  struct Case {
    const char* text;
    std::size_t line;
    const char *found, *expected;
  };
  for (const Case& c :
       {Case{"\n\nhead X", 3, "head X", "head PH-1, PH-A"},
        {"sensor custom", 1, "sensor custom", "sensor MAX31855"},
        {"noise -1", 1, "noise -1", "noise 0..10"},
        {"1 try seat 0.2", 1, "seat", "behind try what the host asks: set, run"},
        {"1 try try run", 1, "try", "behind try what the host asks: set, run"},
        {"1 try", 1, "nothing", "behind try what the host asks: set, run"},
        {"1 try set SETPOINT", 1, "SETPOINT", "try set REGISTER VALUE"},
        {"1 try set SETPOINT 4000", 1, "4000", "SETPOINT of 0.0 to 500.0 degC"},
        {"seed 1.5", 1, "seed 1.5", "seed and a whole number"},
        {"5 run\nhead PH-1", 2, "head PH-1", "a time in seconds"},
        {"-1 run", 1, "-1", "a time of 0 to"},
        {"1e7 run", 1, "1e7", "a time of 0 to"},
        {"5", 1, "", "one of set, run"},
        {"5 jump", 1, "jump", "one of set, run"},
        {"5 run now", 1, "run now", "run"},
        {"5 set SETPOINT", 1, "set SETPOINT", "set REGISTER VALUE"},
        {"5 set CMDX 1", 1, "CMDX", "one of CMD, SETPOINT, RAMP_UP, "},
        {"5 set STATUS 1", 1, "STATUS", "a register that can be written; that one is only read"},
        {"5 set SETPOINT nan", 1, "nan", "SETPOINT of 0.0 to 500.0 degC"},
        {"5 set SETPOINT 1e300", 1, "1e300", "SETPOINT of 0.0 to 500.0 degC"},
        {"5 set SETPOINT 99999", 1, "99999", "SETPOINT of 0.0 to 500.0 degC"},
        {"5 set SETPOINT 0x10", 1, "0x10", "SETPOINT of 0.0 to 500.0 degC"},
        {"5 set KP 0.000000001", 1, "0.000000001",
         "KP of 0, or 1.52588e-05 1/K at least: the register would hold 0"},
        {"5 set MODE 0.4", 1, "0.4", "MODE of a whole number"},
        {"5 set MODE 1.4", 1, "1.4", "MODE of a whole number"},
        {"5 frame", 1, "frame", "frame HEX"},
        {"5 frame 00 1ff", 1, "1ff", "bytes from 00 to ff"},
        {"5 supply 1e9", 1, "1e9", "supply of 0 to 2 of the nominal voltage"},
        {"5 ambient hot", 1, "hot", "ambient of -50 to 100 degC"},
        {"5 fan -1", 1, "-1", "fan of 0 to 10 W/K"},
        {"5 drops 6000 1", 1, "6000", "drops of 0 to 5000 Hz"},
        {"5 drops 1 1001", 1, "1001", "drops of 0 to 1000 mJ each"},
        {"5 seat 1.01", 1, "1.01", "seat of 0 to 1"},
        {"5 sensor gone", 1, "gone", "sensor sound, open, to_ground"},
        {"5 heater gone", 1, "gone", "heater sound, open, shorted"},
        {"5 flip guard.run_q 1", 1, "1", "bit 0 of guard.run_q"},
        {"5 flip guard.run_q 99", 1, "99", "bit 0 of guard.run_q"},
        {"5 flip mem.active_q[999] 0", 1, "mem.active_q[999]", "one of mem."},
        {"5 flip nosuch.q 0", 1, "nosuch.q", "BLOCK.FLOP with a block of "},
        {"5 clock slow", 1, "slow", "clock on or off"},
        {"head PH-1\nseed 1\nhead PH-A", 3, "head PH-A", "head once"},
        {"seed 1;seed 2", 1, "seed 2", "seed once"}}) {
    const auto defect = parse_scenario(c.text).defect;
    ASSERT_TRUE(defect) << c.text;
    EXPECT_EQ(defect->line, c.line) << c.text;
    EXPECT_EQ(defect->found, c.found);
    EXPECT_THAT(defect->expected, StartsWith(c.expected)) << c.text;
  }
}

// What some editors put before the first word.
TEST(Scenario, BeginsBehindAByteOrderMark) {
  const ParsedScenario parsed = parse_scenario(
      "\xEF\xBB\xBF"
      "1 run");
  ASSERT_FALSE(parsed.defect) << parsed.defect->found;
  EXPECT_EQ(parsed.scenario.events.size(), 1U);
}

TEST(Scenario, BitsMayBeHexadecimal) {
  EXPECT_FALSE(parse_scenario("1 set CTRL 0x37").defect);
  EXPECT_EQ(parse_scenario("1 set CTRL 0x37g").defect->found, "0x37g");
  EXPECT_EQ(parse_scenario("1 set CTRL 0x10037").defect->found, "0x10037");
}

TEST(Scenario, FramesAndFlopsAreToldWithTheirBounds) {
  std::string frame = "1 frame";
  for (int i = 0; i < 257; ++i) frame += " 00";
  const auto defect = parse_scenario(frame).defect;
  ASSERT_TRUE(defect);
  EXPECT_EQ(defect->found, "257 bytes");
  EXPECT_EQ(defect->expected, "frame of 256 at most");
  EXPECT_THAT(parse_scenario("1 flip mem.x 0").defect->expected, HasSubstr("mem.active_q[0.."));
  EXPECT_THAT(parse_scenario("1 flip x 0").defect->expected, HasSubstr("guard"));
}

TEST(Scenario, IsBounded) {
  std::string text;
  for (std::size_t i = 0; i < kMostEvents; ++i) text += "1 run;\n";
  EXPECT_FALSE(parse_scenario(text).defect);
  const auto many = parse_scenario(text + "1 run").defect;
  ASSERT_TRUE(many);
  EXPECT_EQ(many->line, kMostEvents + 1);
  EXPECT_EQ(many->found, "another event");
  EXPECT_EQ(many->expected, "a scenario of 100000 at most");
  const auto large = parse_scenario(std::string(kMostScenarioBytes + 1, '\n')).defect;
  ASSERT_TRUE(large);
  EXPECT_EQ(large->expected, "a scenario of 4194304 at most");
}

// What a driver would set for the part stands before all else.
TEST(ScriptedRun, SensorIsSetUp) {
  const auto run = run_of("sensor MAX6675", 1.0);
  EXPECT_EQ(run->chip().params()[spec::kRegSensType], 2);
  EXPECT_EQ(run->chip().params()[spec::kRegTs], spec::kSensorPresets[2].min_ts_ms);
  EXPECT_NEAR(run->rows().back().reading_degc, 25.0, 0.5);
}

TEST(ScriptedRun, HeatsAndKeepsARowEachTenth) {
  const auto run = run_of("1 set SETPOINT 80;1.1 run", 30.0);
  ASSERT_EQ(run->rows().size(), 301U);
  EXPECT_TRUE(std::isnan(run->rows()[0].reading_degc));
  for (std::size_t i = 0; i < run->rows().size(); ++i)
    EXPECT_NEAR(run->rows()[i].time_s, static_cast<double>(i) / 10.0, 2e-6);  // reset takes 20 clocks
  EXPECT_EQ(run->rows().back().set_point_degc, 80.0);
  EXPECT_GT(run->rows().back().block_degc, 35.0);
  EXPECT_GT(run->rows().back().pin_changes, 10'000.0);
  const auto set = std::find_if(run->log().begin(), run->log().end(),
                                [](const LogEntry& entry) { return entry.what == "set SETPOINT 80 degC"; });
  ASSERT_NE(set, run->log().end());
  EXPECT_EQ(set->answer, "done");
  EXPECT_EQ(set->request, (std::vector<std::uint8_t>{1, 6, 1, 1, 3, 0x20, 0xD8, 0xDE}));
}

TEST(ScriptedRun, FailureIsToldInWords) {
  const auto run = run_of("1 set SETPOINT 400;1.5 try frame 01 06 01 01 ff ff 98 46;\n2 frame 01;4 run", 3.0);
  ASSERT_EQ(run->failures().size(), 2U);
  EXPECT_EQ(run->failed(), 2U);
  EXPECT_EQ(run->failures()[0].what, "set SETPOINT 400 degC");
  EXPECT_EQ(run->failures()[0].line, 1U);
  EXPECT_NEAR(run->failures()[0].time_s, 1.0, 0.01);
  EXPECT_THAT(run->failures()[0].answer, HasSubstr("exception 3: illegal data value"));
  EXPECT_EQ(run->failures()[1].what, "a frame by hand");
  EXPECT_EQ(run->failures()[1].line, 2U);
  EXPECT_EQ(run->failures()[1].answer, "no answer");
  // In the log, which the page shows, too.
  EXPECT_EQ(
      std::count_if(run->log().begin(), run->log().end(), [](const LogEntry& entry) { return entry.failed; }),
      2);
  ASSERT_EQ(run->events_to_come().size(), 1U);
  EXPECT_EQ(run->events_to_come().front().text, "run");
}

// However many droplets fall, they are as warm as what flows in.
TEST(ScriptedRun, DropletsCoolNoFurtherThanTheSurroundings) {
  const auto run = run_of("1 set SETPOINT 60;1.1 run;20 drops 5000 1000;25 stop", 60.0);
  EXPECT_NEAR(run->rows().back().block_degc, 25.0, 0.1);
}

// Each way to break something ends in the fault that stands for it, with the heater off.
TEST(ScriptedRun, FaultsLatch) {
  struct Case {
    const char *event, *fault;
    double within_s;
  };
  for (const Case& c : {Case{"sensor open", "SensorFault", 2},
                        {"sensor low", "SensorFrame", 2},
                        {"sensor wrong_bits", "SensorFrame", 2},
                        {"seat 0", "Rate", 5},
                        {"heater shorted", "HeaterFb", 1},
                        {"heater open", "NotHeating", 300},
                        {"host off", "HostWatchdog", 12},
                        {"estop on", "Inhibit", 1},
                        {"flip guard.run_q 0", "State", 1}}) {
    const auto run = run_of("1 set SETPOINT 60;1.1 run;150 " + std::string(c.event), 150.0 + c.within_s);
    EXPECT_THAT(run->fault(), StartsWith(std::string(c.fault) + ": ")) << c.event;
    EXPECT_TRUE(std::any_of(run->log().begin(), run->log().end(), [&](const LogEntry& entry) {
      return entry.what == "fault" && entry.answer.starts_with(c.fault);
    })) << c.event;
    EXPECT_EQ(run->head().plant().power_w(), 0.0) << c.event;
  }
}

// Without its clock the chip can't see anything; the second switch opens as safe_en_o stands.
TEST(ScriptedRun, StoppedClockTakesTheHeatersSupply) {
  const auto run = run_of("1 set SETPOINT 100;1.1 run;20 clock off", 20.1);
  EXPECT_EQ(run->head().plant().power_w(), 0.0);
  EXPECT_TRUE(run->fault().empty());
  const double hot = run->rows().back().heater_degc;
  run->until(at(40.0));
  EXPECT_LT(run->rows().back().heater_degc, hot);
  EXPECT_EQ(run->log().back().answer, "no answer");
}

TEST(ScriptedRun, WithoutTheSecondSwitchAStoppedClockCanLeaveTheHeaterOn) {
  const auto run = run_of("second_switch off;1 set SETPOINT 100;1.1 run;20 clock off", 21.0);
  EXPECT_GT(run->head().plant().power_w(), 0.0);
}

// The same run whatever the steps that it is asked in, and whether an event stands in the scenario or is
// added at its time.
TEST(ScriptedRun, StepsChangeNothing) {
  const char* const scenario =
      "sensor LM70;1 set SETPOINT 90;1.1 run;3.00001 drops 700 3;9 fan 0.1;12.5 seat 0.5";
  const auto whole = run_of(scenario, 15.0);
  const auto steps = run_of("sensor LM70;1 set SETPOINT 90;1.1 run;3.00001 drops 700 3;9 fan 0.1", 0.0);
  for (double t = 0.0; t < 12.5; t += 0.0137) steps->until(at(t));
  steps->until(at(12.5));
  steps->add(parse_event("seat 0.5", steps->cycle()).event);
  steps->until(at(15.0));
  EXPECT_EQ(trace_text(*whole), trace_text(*steps));
}

// What a page does: an event at the clock at which the run stands, here together with a poll and a row,
// becomes a line behind all others.
TEST(ScriptedRun, WhatIsDoneNowIsRepeatedByItsLine) {
  const std::string scenario = "1 set SETPOINT 90;1.1 run;9 fan 0.1";
  const auto acted = run_of(scenario, 5.0);
  acted->add(parse_event("set SETPOINT 70", acted->cycle()).event);
  acted->until(at(12.0));
  const auto repeated = run_of(scenario + "\n5 set SETPOINT 70", 12.0);
  EXPECT_EQ(trace_text(*acted), trace_text(*repeated));
  EXPECT_EQ(repeated->rows().back().set_point_degc, 70.0);
}

TEST(ScriptedRun, PinsOfAMomentBeginWithTheirLevels) {
  const auto run = run_of("", 3.0);
  const std::vector<PinChange> pins = run->pins(at(1.05), at(1.25));
  ASSERT_GT(pins.size(), 100U);  // frames of the sensor
  EXPECT_LE(pins[0].cycle, at(1.05));
  EXPECT_GT(pins[1].cycle, at(1.05));
  EXPECT_LT(pins.back().cycle, at(1.25));
  const std::vector<PinBits> bits = chip_pin_bits();
  const auto sclk =
      std::find_if(bits.begin(), bits.end(), [](const PinBits& b) { return b.name == "spi_sclk_o"; });
  unsigned edges = 0;
  for (std::size_t i = 1; i < pins.size(); ++i)
    edges += ((pins[i].pins ^ pins[i - 1].pins) >> sclk->first & 1) != 0;
  EXPECT_EQ(edges, 2U * 2U * 32U);  // two frames of a MAX31855
}

}  // namespace
}  // namespace meltstage::tb
