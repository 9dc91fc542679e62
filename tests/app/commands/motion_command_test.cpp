// SPDX-License-Identifier: Apache-2.0
// `meltstage gcode` and `meltstage accuracy` as a user meets them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kJob = MELTSTAGE_SOURCE_DIR "/examples/first.toml";
const std::string kSlits = MELTSTAGE_SOURCE_DIR "/tests/motion/data/iso230_2_slits.csv";

class MotionCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("meltstage_motion_command." + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string in_folder(const std::string& name) const { return (folder_ / name).string(); }
  std::string text_of(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(folder_ / name).rdbuf();
    return text.str();
  }
  void expect_refused(const Ran& ran, const std::string& part) const {
    EXPECT_EQ(ran.status, 2);
    EXPECT_THAT(ran.output, StartsWith("meltstage: "));
    EXPECT_THAT(ran.output, HasSubstr(part));
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_TRUE(fs::is_empty(folder_));
  }

  fs::path folder_;
};

TEST_F(MotionCommand, WritesAJobForEitherControl) {
  const Ran linuxcnc = run_command("gcode " + kJob + " --out " + in_folder("job.ngc"));
  EXPECT_THAT(linuxcnc.output, HasSubstr(" droplets; path of "));
  EXPECT_THAT(linuxcnc.output, HasSubstr(", the cheapest; stops and moves take "));
  ASSERT_EQ(linuxcnc.status, 0) << linuxcnc.output;
  const Ran grbl = run_command("gcode " + kJob + " --dialect grbl --out " + in_folder("job.gcode"));
  ASSERT_EQ(grbl.status, 0) << grbl.output;
  EXPECT_THAT(text_of("job.ngc"), HasSubstr("\nM64 P0\n"));
  EXPECT_THAT(text_of("job.gcode"), StartsWith("(made for these settings:)\n($100=1000.000)\n"));
  EXPECT_THAT(text_of("job.gcode"), HasSubstr("\nM8\n"));
  const Ran escaped = run_command("gcode " + kJob + " --out '" + in_folder("a\nb\x1b[31m.ngc") + "'");
  EXPECT_THAT(escaped.output, HasSubstr("a\\x0Ab\\x1B[31m.ngc: "));
}

TEST_F(MotionCommand, GcodeTellsWhatItLeavesOutOfAJob) {
  const std::string examples = MELTSTAGE_SOURCE_DIR "/examples/";
  for (const std::string dialect : {"linuxcnc", "grbl"}) {
    const auto write = [&](const std::string& job) {
      const Ran ran =
          run_command("gcode " + examples + job + " --dialect " + dialect + " --out " + in_folder("job"));
      EXPECT_EQ(ran.status, 0) << ran.output;
      return ran.output;
    };
    for (const std::string note :
         {"deviations_x aren't corrected here: the control has to", "deviations_y aren't corrected here",
          "quiet isn't written", "homing isn't written: home the machine first"}) {
      EXPECT_THAT(write("stage.toml"), HasSubstr("note: " + note));
      EXPECT_THAT(text_of("job"), HasSubstr("(note: " + note));
    }
    EXPECT_THAT(write("fly_by.toml"), HasSubstr("note: mode fly-by isn't written: it stops at each bump"));
    EXPECT_THAT(write("aligned.toml"), HasSubstr("note: alignment isn't written"));
    EXPECT_EQ(
        write("first.toml"),
        in_folder("job") + ": 24 droplets; path of 36.8 mm, the cheapest; stops and moves take 2.587 s\n");
  }
}

TEST_F(MotionCommand, GcodeGoesToTheJobsEnd) {
  std::ofstream(folder_ / "bumps.csv") << "x_mm,y_mm\n10,10\n12,10\n";
  const auto program = [&](const std::string& print) {
    std::ofstream(folder_ / "job.toml") << "[coordinates]\nfile = \"bumps.csv\"\n[print]\n" << print;
    EXPECT_EQ(run_command("gcode " + in_folder("job.toml") + " --out " + in_folder("job.ngc")).status, 0);
    return text_of("job.ngc");
  };
  EXPECT_THAT(program("end_x_mm = 50\nend_y_mm = 60\n"), EndsWith("\nG0 X50.0000 Y60.0000\nM2\n"));
  EXPECT_THAT(program(""), EndsWith("\nG0 X0.0000 Y0.0000\nM2\n"));
  EXPECT_THAT(program("tour = \"closed\"\nbegin = \"free\"\n"), EndsWith("\nG0 X10.0000\nM2\n"));
}

TEST_F(MotionCommand, LeavesNothingBehindWhenItCannotWrite) {
  expect_refused(run_command("gcode " + kJob + " --out " + in_folder("none/job.ngc")), "cannot write");
  expect_refused(run_command("gcode nothing.toml --out " + in_folder("job.ngc")), "nothing.toml");
}

TEST_F(MotionCommand, WritesNoFileOfTheNameOfTheStandardOutput) {
  expect_refused(run_command("gcode " + kJob + " --out -"), "-: found the sign for the standard output");
  expect_refused(run_command("print " + kJob + " --rtl none --out -"),
                 "-: found the sign for the standard output");
  EXPECT_FALSE(fs::exists("-"));
}

TEST_F(MotionCommand, WritesOverNoneOfItsInputs) {
  const auto copy = [&](const std::string& from, const std::string& to) {
    fs::copy_file(from, folder_ / to);
  };
  copy(kSlits, "slits.csv");
  std::ofstream(folder_ / "bumps.csv") << "x_mm,y_mm\n20,10\n22,10\n";
  std::ofstream(folder_ / "job.toml")
      << "[coordinates]\nfile = \"bumps.csv\"\n[stage]\ndeviations_x = \"slits.csv\"\n";
  fs::create_symlink("bumps.csv", folder_ / "link.ngc");
  fs::create_hard_link(folder_ / "job.toml", folder_ / "hard.ngc");
  for (const char* out : {"job.toml", "bumps.csv", "slits.csv", "link.ngc", "hard.ngc", "./job.toml"}) {
    const Ran ran = run_command("gcode " + in_folder("job.toml") + " --out " + in_folder(out));
    EXPECT_EQ(ran.status, 2) << out;
    EXPECT_THAT(ran.output, HasSubstr("would be written over the input")) << out;
  }
  const Ran ran =
      run_command("accuracy " + in_folder("slits.csv") + " --compensation " + in_folder("slits.csv"));
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("would be written over the input"));
  EXPECT_THAT(text_of("job.toml"), StartsWith("[coordinates]"));
  EXPECT_THAT(text_of("bumps.csv"), StartsWith("x_mm,y_mm"));
  EXPECT_THAT(text_of("slits.csv"), HasSubstr("target_mm,direction"));
}

TEST_F(MotionCommand, EvaluatesAPositioningTest) {
  const Ran ran = run_command("accuracy " + kSlits + " --compensation " + in_folder("x.comp"));
  ASSERT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("18.571"));
  EXPECT_THAT(ran.output, HasSubstr("8.354"));
  EXPECT_THAT(text_of("x.comp"), StartsWith("15.000000 15.002250 15.004202\n"));
}

// A spreadsheet's CSV has a byte order mark, an old one a lone CR.
TEST_F(MotionCommand, ReadsATestWhoeverWroteIt) {
  const std::string file =
      (fs::temp_directory_path() / ("ends." + std::to_string(getpid()) + ".csv")).string();
  const std::string rows[] = {"target_mm,direction,deviation_um",
                              "1,+,1",
                              "1,-,2",
                              "1,+,1",
                              "1,-,2",
                              "5,+,3",
                              "5,-,4",
                              "5,+,3",
                              "5,-,4"};
  std::string first;
  for (const char* mark : {"", "\xEF\xBB\xBF"})
    for (const char* end : {"\n", "\r\n", "\r"}) {
      std::ofstream text(file, std::ios::binary);
      text << mark;
      for (const std::string& row : rows) text << row << end;
      text.close();
      const Ran ran = run_command("accuracy " + file);
      EXPECT_EQ(ran.status, 0) << ran.output;
      if (first.empty()) first = ran.output;
      EXPECT_EQ(ran.output, first);
    }
  fs::remove(file);
}

TEST_F(MotionCommand, NamesWhatIsWrongWithATest) {
  expect_refused(run_command("accuracy " + in_folder("none.csv")), "none.csv: no such file");
  const std::string bad = (fs::temp_directory_path() / ("bad." + std::to_string(getpid()) + ".csv")).string();
  std::ofstream(bad) << "target_mm,direction,deviation_um\n1,+,nan\n";
  expect_refused(run_command("accuracy " + bad),
                 ":2:5: found deviation_um \"nan\", expected a finite number");
  fs::remove(bad);
}

}  // namespace
}  // namespace meltstage
