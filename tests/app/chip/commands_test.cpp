// SPDX-License-Identifier: Apache-2.0
// `meltstage chip read|set|run|stop|clear` as an operator meets them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "cmodel/spec.hpp"
#include "host/register_map.hpp"
#include "tests/host/served_chip.hpp"

namespace meltstage {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class ChipCommands : public ::testing::TestWithParam<const char*> {
 protected:
  Ran command(const std::string& words, const std::string& options = "--timeout 10") const {
    return run_command(fmt::format("chip {} --port {} {}", words, chip_.port(), options));
  }
  static void expect_one_line(const Ran& ran, int status, const std::string& part) {
    EXPECT_EQ(ran.status, status) << ran.output;
    EXPECT_THAT(ran.output, StartsWith("meltstage"));
    EXPECT_THAT(ran.output, HasSubstr(part));
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
  }

  ServedChip chip_{GetParam()};
};

TEST_P(ChipCommands, ReadPrintsEveryRegisterInItsUnit) {
  const Ran ran = command("read");
  EXPECT_EQ(ran.status, 0) << ran.output;
  for (const host::Register& r : host::registers()) {
    if (!r.readable) continue;
    EXPECT_THAT(ran.output, ContainsRegex(fmt::format("(^|\n){} ", r.name)));
  }
  EXPECT_THAT(ran.output, ContainsRegex("\nT_MAX +150.0 degC\n"));
  EXPECT_THAT(ran.output, ContainsRegex("\nBAUD +115200 Bd\n"));
  EXPECT_THAT(ran.output, ContainsRegex("\nFAULT +0x0000 +none\n"));
}

TEST_P(ChipCommands, SetWritesNeighboursAndOthersAndReadShowsThem) {
  EXPECT_EQ(command("set SETPOINT=110.04").output,
            "SETPOINT: 110.04 is written as 110.0 degC, the nearest that it holds\n");
  EXPECT_EQ(command("set setpoint=110.5 RAMP_UP=1.5").output, "");
  EXPECT_EQ(command("set T_MAX=180 SETPOINT=170 CTRL=0x33 T_AMB=-5").status,
            0);  // SETPOINT passes the new limit only
  const Ran ran = command("read SETPOINT RAMP_UP T_MAX CTRL T_AMB");
  EXPECT_THAT(ran.output,
              ContainsRegex("SETPOINT +170.0 degC\nRAMP_UP +1.50 degC/s\nT_MAX +180.0 degC\nCTRL +51\n"
                            "T_AMB +-5.0 degC\n"));
}

TEST_P(ChipCommands, RefusedSetChangesNothing) {
  ASSERT_EQ(command("set SETPOINT=100 KP=0.05").status, 0);
  expect_one_line(command("set KP=0.1 SETPOINT=149"), 1,
                  "SETPOINT may be T_MAX - 5.0 degC at most; nothing was changed");
  EXPECT_THAT(command("read SETPOINT KP").output, ContainsRegex("SETPOINT +100.0 degC\nKP +0.05"));
}

// The chip takes such a limit; heating would end in a fault.
TEST_P(ChipCommands, ALimitBelowTheSetPointIsTold) {
  ASSERT_EQ(command("set SETPOINT=110").output, "");
  EXPECT_EQ(command("set T_MAX=115").output, "");
  const Ran ran = command("set T_MAX=100");
  EXPECT_EQ(ran.status, 0);
  EXPECT_EQ(
      ran.output,
      "SETPOINT is 110.0 degC, too near T_MAX of 100.0 degC: heating trips OverTemp; set SETPOINT to 95.0 "
      "degC at most\n");
  EXPECT_EQ(command("set T_MAX=110 SETPOINT=90").output, "");
}

// The lock holds from a control tick on, 2 s of the chip's time here; the command waits for it.
TEST_P(ChipCommands, ALockIsAsSetWhenTheCommandEnds) {
  ASSERT_EQ(command("set TS=2000").status, 0);
  while (command("read STATUS").output.find("writes pending") != std::string::npos) {
  }
  ASSERT_EQ(command("set LOCK=1").status, 0);
  expect_one_line(command("set KP=0.1"), 1, "LOCK is on");
  ASSERT_EQ(command("set LOCK=0").status, 0);
  EXPECT_EQ(command("set KP=0.1").status, 0);
}

TEST_P(ChipCommands, MistakesAreOneLineBeforeAnythingIsSent) {
  const Ran before = command("read MESSAGES");
  expect_one_line(command("set SETPOINT=600"), 2, "SETPOINT: found 600, expected 0.0 to 500.0 degC");
  expect_one_line(command("set KP=0.1 SETPOINT=600"), 2, "SETPOINT");
  expect_one_line(command("set SETPOINT=nan"), 2, "SETPOINT: found nan");
  expect_one_line(command("set SETPOINT=hot"), 2, "SETPOINT: found \"hot\", expected a number in degC");
  expect_one_line(
      command("set SETPOINT=0x10"), 2,
      "SETPOINT: found \"0x10\", expected a decimal number in degC: the register's word is in 0.1 degC");
  expect_one_line(command("set SETPOINT"), 2, "expected NAME=VALUE");
  expect_one_line(command("set PV=1"), 2, "PV: is read only");
  expect_one_line(command("read SETPOIN"), 2, "such as SETPOINT");
  expect_one_line(command("read CMD"), 2, "CMD: can be written only");
  expect_one_line(command("read", "--baud 12345"), 2, "baud rate: found 12345");
  expect_one_line(command("read", "--format 7E1"), 2, "format: found \"7E1\"");
  expect_one_line(command("read", "--address 248"), 2, "address: found 248");
  const auto messages = [](const Ran& ran) { return std::stoi(ran.output.substr(ran.output.rfind(' '))); };
  EXPECT_EQ(messages(command("read MESSAGES")), messages(before) + 1);
}

TEST_P(ChipCommands, TwiceTheSameRegisterIsRefused) {
  expect_one_line(command("set SETPOINT=1 SETPOINT=2"), 2, "SETPOINT: is set twice");
}

TEST_P(ChipCommands, WrongPortsAreOneLine) {
  expect_one_line(run_command("chip read --port /dev/absent"), 2, "/dev/absent: cannot be opened");
  expect_one_line(run_command("chip read --port ''"), 2, "port: found nothing");
  const auto file = chip_.folder() / "file";
  std::ofstream(file) << "x";
  expect_one_line(run_command("chip read --port " + file.string()), 2, "expected a serial port");
  expect_one_line(run_command(fmt::format("chip read --port {} --address 5 --timeout 0.05", chip_.port())), 1,
                  "no answer from address 5");
}

TEST_P(ChipCommands, RunStopAndClear) {
  while (command("read SAMPLES").output.find(" 0\n") != std::string::npos) {
  }
  ASSERT_EQ(command("set SETPOINT=60 HOST_WD=0").status, 0);
  EXPECT_EQ(command("run").status, 0);
  EXPECT_THAT(command("read STATUS").output, HasSubstr("run, "));
  EXPECT_EQ(command("stop").status, 0);
  EXPECT_THAT(command("read STATUS").output, Not(HasSubstr("run, ")));
  EXPECT_EQ(command("clear").output, "no fault was latched\n");
}

// T_MAX below the temperature of the room: a fault that latches without heating, and that has a cause
// present.
TEST_P(ChipCommands, RefusalsNameTheFault) {
  ASSERT_EQ(command("set T_MAX=20").status, 0);
  while (command("read FAULT").output.find("OverTemp") == std::string::npos) {
  }
  expect_one_line(command("run"), 1, "present now: OverTemp");
  EXPECT_THAT(command("run").output, AllOf(ContainsRegex("Now: PV [0-9.]+ degC\\."),
                                           HasSubstr("Limit: T_MAX 20 degC. Next: Check")));
  expect_one_line(command("clear"), 1, "present now: OverTemp");
  ASSERT_EQ(command("set T_MAX=150").status, 0);
  while (command("read CAUSE").output.find("OverTemp") != std::string::npos) {
  }
  expect_one_line(command("run"), 1, "latched: OverTemp, clear it first");
  EXPECT_EQ(command("clear").output, "cleared: OverTemp\n");
  EXPECT_EQ(command("clear").output, "no fault was latched\n");
}

// A locked chip was told to clear its fault first, and one that tunes to open its lock.
TEST_P(ChipCommands, RefusalsNameTheLock) {
  ASSERT_EQ(command("set T_MAX=20").status, 0);
  while (command("read FAULT").output.find("OverTemp") == std::string::npos) {
  }
  ASSERT_EQ(command("set T_MAX=150").status, 0);
  while (command("read CAUSE").output.find("OverTemp") != std::string::npos) {
  }
  ASSERT_EQ(command("set LOCK=7").status, 0);
  expect_one_line(command("clear"), 1, "LOCK is on, LOCK=0 opens it");
  expect_one_line(command("run"), 1, "LOCK is on, LOCK=0 opens it");
  ASSERT_EQ(command("set LOCK=0").status, 0);
  EXPECT_EQ(command("clear").output, "cleared: OverTemp\n");
}

INSTANTIATE_TEST_SUITE_P(Model, ChipCommands, ::testing::Values("--speed 20"));

}  // namespace
}  // namespace meltstage
