// SPDX-License-Identifier: Apache-2.0
// `meltstage chip play` as a user meets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

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
  EXPECT_EQ(told.status, 0);
  EXPECT_THAT(told.output, HasSubstr("set SETPOINT 400 degC: refused, exception 3: illegal data value\n"));
  EXPECT_THAT(told.output,
              EndsWith("s.txt: 2 of its events, from \"stop\" at 3 s on, are behind the end at 2.5 s\n"));
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

}  // namespace
}  // namespace meltstage
