// SPDX-License-Identifier: Apache-2.0
// `meltstage chip play` as a user meets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "base/file.hpp"
#include "base/temporary_folder.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class PlayCommand : public ::testing::Test {
 protected:
  Ran play(const std::string& text, const std::string& options) const {
    const std::string file = (folder_.path() / "s.txt").string();
    std::ofstream(file) << text;
    return run_command("chip play " + file + " " + options);
  }
  std::string out() const { return " --out " + (folder_.path() / "t.csv").string(); }
  TemporaryFolder folder_;
};

TEST_F(PlayCommand, TellsWhatTheChipRefusedAndWhatIsBehindTheEnd) {
  const Ran quiet = play("1 set SETPOINT 100\n1.2 run\n2 run\n", "--for 2.5" + out());
  EXPECT_EQ(quiet.status, 0);
  EXPECT_EQ(quiet.output, "");
  const Ran told = play("1 set SETPOINT 400\n3 stop\n100 run\n", "--for 2.5" + out());
  EXPECT_EQ(told.status, 1);
  EXPECT_THAT(told.output,
              HasSubstr("s.txt:1: at 1 s: set SETPOINT 400 degC: refused, exception 3: illegal data "
                        "value\n"));
  EXPECT_THAT(told.output,
              EndsWith("s.txt: 2 of its events, from \"stop\" at 3 s on, are behind the end at 2.5 s\n"));
}

// Whatever keeps the chip from taking what the host asks, it is told with its line, and the run isn't good.
TEST_F(PlayCommand, TellsWhatGotNoAnswer) {
  for (const char* before :
       {"set ADDRESS 5", "set BAUD 57600", "set FORMAT 1", "reset on", "clock off", "clock off # a remark"}) {
    const Ran ran = play(std::string("0.5 ") + before + "\n\n1 set SETPOINT 100\n", "--for 3" + out());
    EXPECT_EQ(ran.status, 1) << before;
    EXPECT_THAT(ran.output, HasSubstr("s.txt:3: at 1 s: set SETPOINT 100 degC: no answer\n")) << before;
    EXPECT_THAT(ran.output, EndsWith("s.txt: 1 of what the host asked was not done, expected all; write try "
                                     "before what may fail\n"))
        << before;
  }
  for (const char* frame : {"01 06", "01 06 01 01 03 20 d8 df", "ff"}) {
    const Ran ran = play(std::string("1 frame ") + frame, "--for 2" + out());
    EXPECT_EQ(ran.status, 1) << frame;
    EXPECT_THAT(ran.output, HasSubstr("s.txt:1: at 1 s: a frame by hand: no answer\n")) << frame;
  }
}

// The sensor's registers are set by the host, too, before all else.
TEST_F(PlayCommand, TellsThatTheSensorCouldNotBeSetUp) {
  const Ran ran = play("sensor MAX6675\n0 reset on\n", "--for 3" + out());
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, HasSubstr("s.txt: at 0.01 s: set SENS_TYPE 2: no answer\n"));
}

TEST_F(PlayCommand, TellsWhatTheEndCutOff) {
  const Ran ran = play("1 clock off\n1 set SETPOINT 100\n1.5 run\n", "--for 1.5" + out());
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, HasSubstr("s.txt:3: at 1.5 s: run: no answer so far\n"));
}

// Of many the first ones stand there, and the number of all.
TEST_F(PlayCommand, TellsTheFirstFailuresAndCountsAll) {
  std::string text;
  for (int i = 0; i < 50; ++i) text += "1 set SETPOINT 400\n";
  const Ran ran = play(text, "--for 3" + out());
  EXPECT_EQ(ran.status, 1);
  EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 21);
  EXPECT_THAT(ran.output, HasSubstr("s.txt: 50 of what the host asked were not done"));
}

TEST_F(PlayCommand, WhatIsTriedMayFail) {
  const Ran ran = play(
      "1 try set SETPOINT 400\n1.2 try frame 01 06\n2 try set ADDRESS 5\n3 try run\n4 frame 00 06 01 01 03 "
      "20 d9 "
      "0f\n",
      "--for 5" + out());
  EXPECT_EQ(ran.output, "");
  EXPECT_EQ(ran.status, 0);
}

TEST_F(PlayCommand, NoFileIsTooLargeToBeRefused) {
  const Ran ran = play(std::string((4U << 20) + 1, '\n'), "--for 1");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, EndsWith("s.txt: found more than 4194304 bytes, expected a scenario of at most so "
                                   "many\n"));
}

TEST_F(PlayCommand, ADefectIsOneLine) {
  const Ran ran = play(
      "\xEF\xBB\xBF"
      "1 run\n2 fan warm\n",
      "--for 1");
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, StartsWith("meltstage: "));
  EXPECT_THAT(ran.output, EndsWith("s.txt:2: found warm, expected fan of 0 to 10 W/K\n"));
}

// The emergency stop takes the heater off in its own clock, as the pins do.
TEST_F(PlayCommand, WritesThePinsAsWaves) {
  const std::string vcd = (folder_.path() / "pins.vcd").string();
  const Ran ran =
      play("0.5 set MODE 1\n0.6 set MANUAL_DUTY 100\n1 run\n1.5 estop on\n", "--for 2 --vcd " + vcd + out());
  EXPECT_EQ(ran.status, 0) << ran.output;
  const std::string text = read_file(vcd, "waves");
  const auto code = [&](const std::string& pin) {
    const std::size_t name = text.find(" " + pin + " $end");
    const std::size_t begin = text.rfind(' ', name - 1) + 1;
    return text.substr(begin, name - begin);
  };
  const std::size_t stop = text.find("\n#1500000000000\n");  // ps
  ASSERT_NE(stop, std::string::npos);
  const std::string changes = text.substr(stop, text.find("\n#", stop + 1) - stop + 1);
  EXPECT_THAT(changes, HasSubstr("\n1" + code("inhibit_i") + "\n"));
  EXPECT_THAT(changes, HasSubstr("\n0" + code("heater_o") + "\n"));
  EXPECT_TRUE(text.ends_with("\n#2000000000000\n")) << text.substr(text.size() - 40);
}

TEST_F(PlayCommand, WritesNoWavesOverItsOtherFiles) {
  const std::string trace = (folder_.path() / "t.csv").string();
  for (const std::string& other : {(folder_.path() / "s.txt").string(), trace}) {
    const Ran ran = play("1 run\n", "--for 1 --vcd " + other + out());
    EXPECT_EQ(ran.status, 2);
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_FALSE(std::filesystem::exists(trace));
    EXPECT_EQ(read_file(folder_.path() / "s.txt", "a scenario"), "1 run\n");
  }
}

}  // namespace
}  // namespace meltstage
