// SPDX-License-Identifier: Apache-2.0
// What a program does when the streams that it tells on can't be written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

using ::testing::HasSubstr;

const std::string kSlits = MELTSTAGE_SOURCE_DIR "/tests/motion/data/iso230_2_slits.csv";

TEST(Streams, ARefusalKeepsItsStatusWithoutAPlaceToTellIt) {
  for (const char* command : {"accuracy nope", "print nope", "nope", "conformal probe nope --out x",
                              "dft scan nope", "bench nope", "chip info --port /nope"})
    for (const char* nowhere : {"2>/dev/full", "2>&-"})
      EXPECT_EQ(run_command(std::string(command) + " " + nowhere).status, 2) << command << " " << nowhere;
}

TEST(Streams, AnAnswerThatGetsLostIsTold) {
  for (const std::string& command : {"accuracy " + kSlits, std::string("--help"), std::string("--version"),
                                     std::string("bench --list"), std::string("conformal --help")})
    for (const char* nowhere : {"2>&1 >/dev/full", ">&-"}) {
      const Ran ran = run_command(command + " " + nowhere);
      EXPECT_EQ(ran.status, 2) << command << " " << nowhere;
      EXPECT_THAT(ran.output, HasSubstr("standard output: can't be written")) << command << " " << nowhere;
      EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    }
}

}  // namespace
}  // namespace meltstage
