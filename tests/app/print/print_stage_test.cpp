// SPDX-License-Identifier: Apache-2.0
// Prints through the driven stage: homing, compensation, quiet moves, printing on the fly, faults of an axis.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "app/print/job_plan.hpp"
#include "base/error.hpp"
#include "recording/stream.hpp"
#include "tb/printer/printer.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

tb::PrintResult print(tb::PrintJob job) {
  job.rtl = tb::RtlWindows::none;
  recording::Stream stream;
  return tb::run_print(job, stream, [](const tb::PrintProgress&) {});
}

double seconds_of(const tb::PrintResult& result, const std::string& phase) {
  for (const tb::PhaseTime& p : result.phases)
    if (p.name == phase) return p.end_s - p.begin_s;
  return 0.0;
}

app::LoadedJob example(const std::string& name) {
  return app::load_job(fs::path(MELTSTAGE_SOURCE_DIR) / "examples" / name);
}

TEST(PrintStage, ExampleHomesCorrectsItsScrewsAndMovesQuietly) {
  const app::LoadedJob loaded = example("stage.toml");
  const tb::PrintResult result = print(loaded.job);
  EXPECT_TRUE(result.good) << result.verdict;
  EXPECT_EQ(result.droplets, loaded.job.bumps.size());
  EXPECT_GT(result.homing_s, 1.0);
  EXPECT_LT(result.largest_miss_mm, 0.003);

  tb::PrintJob uncorrected = loaded.job;
  uncorrected.compensation = {};
  EXPECT_GT(print(uncorrected).largest_miss_mm, 3.0 * result.largest_miss_mm);
}

TEST(PrintStage, QuietMovesNeedNoPauseForTheSameMiss) {
  app::LoadedJob loaded = example("stage.toml");
  tb::PrintJob& job = loaded.job;
  job.drive.homed = true;
  job.power_on_mm = job.start_mm;
  for (motion::AxisModelConfig& axis : job.drive.axes) axis.screw = {};
  job.compensation = {};
  job.settle_s = 0.005;
  const double quiet_mm = print(job).largest_miss_mm;
  job.stage.quiet.reset();
  EXPECT_GT(print(job).largest_miss_mm, 3.0 * quiet_mm);
}

TEST(PrintStage, ExampleOnTheFlyPrintsEveryBumpSooner) {
  const app::LoadedJob loaded = example("fly_by.toml");
  const tb::PrintResult fly_by = print(loaded.job);
  EXPECT_TRUE(fly_by.good) << fly_by.verdict;
  EXPECT_EQ(fly_by.droplets, loaded.job.bumps.size());
  tb::PrintJob stopping = loaded.job;
  stopping.fly_by.reset();
  const tb::PrintResult stops = print(stopping);
  EXPECT_TRUE(stops.good) << stops.verdict;
  EXPECT_LT(seconds_of(fly_by, "print"), 0.6 * seconds_of(stops, "print"));
  EXPECT_LT(fly_by.largest_miss_mm, 0.005);
}

TEST(PrintStage, ExampleIsAlignedByItsMarksBeforeItPrints) {
  app::LoadedJob loaded = example("aligned.toml");
  ASSERT_TRUE(loaded.alignment);
  loaded.job.settle_s = 0.2;  // droplets miss by what the board is off, not by what still swings
  const tb::AlignedBoard board = tb::align_board(*loaded.alignment);
  EXPECT_TRUE(board.result.aligned);
  EXPECT_EQ(board.result.looks.size(), 2U);
  EXPECT_GT(board.result.looks.front().worst_mm, 0.5);
  loaded.job.board = board.place;
  EXPECT_LT(print(loaded.job).largest_miss_mm, 0.006);

  const Eigen::Vector2d pad(102.0, 102.0);
  tb::BoardAlignment left_alone = *loaded.alignment;
  left_alone.limits.place_mm = 5.0;  // the board stays as it was laid
  loaded.job.board = tb::align_board(left_alone).place;
  EXPECT_GT((loaded.job.board.of(pad) - pad).norm(), 0.5);
  EXPECT_GT(print(loaded.job).largest_miss_mm, 0.5);
}

TEST(PrintStage, ABoardOnItsFaceIsJudgedByWhereItIsThoughItsMarksDontTell) {
  app::LoadedJob loaded = example("aligned.toml");
  tb::BoardAlignment board = *loaded.alignment;
  board.lies = {};
  board.upside_down = true;
  for (const std::vector<Eigen::Vector2d>& marks :
       {std::vector<Eigen::Vector2d>{{90, 100}, {110, 100}},
        std::vector<Eigen::Vector2d>{{90, 100}, {110, 100}, {100, 112}}}) {
    board.marks_mm = marks;
    const tb::AlignedBoard aligned = tb::align_board(board);
    EXPECT_TRUE(aligned.result.aligned);  // as the camera saw it
    EXPECT_NEAR(aligned.place.of({103.0, 101.0}).x(), 97.0, 0.02);
    loaded.job.board = aligned.place;
    loaded.job.bumps = {{97.0, 101.0, 1}, {103.0, 101.0, 2}};
    const tb::PrintResult result = print(loaded.job);
    EXPECT_FALSE(result.good);
    EXPECT_EQ(result.misplaced, 2U);
    EXPECT_NEAR(result.largest_miss_mm, 6.0, 0.05);
    EXPECT_THAT(result.verdict, HasSubstr("the board lies on its face"));
  }
}

TEST(PrintStage, TheCameraMakesUpForAStageThatIsOnlyKnownByItsDrawings) {
  tb::BoardAlignment board = *example("aligned.toml").alignment;
  board.knowledge = tb::StageKnowledge::nominal;
  const tb::AlignedBoard aligned = tb::align_board(board);
  EXPECT_TRUE(aligned.result.aligned);
  EXPECT_GT(aligned.result.looks.size(), 2U);
  board.limits.most_moves = 1;
  EXPECT_FALSE(tb::align_board(board).result.aligned);
}

TEST(PrintStage, JammedSlideStopsThePrintWithTheHeaterOff) {
  tb::PrintJob job = example("first.toml").job;
  const tb::PrintResult whole = print(job);
  ASSERT_TRUE(whole.good);
  const double printing_s = whole.phases.back().begin_s - seconds_of(whole, "print");
  job.events = {{printing_s + 0.2, tb::EventKind::stage_jam}};
  const tb::PrintResult result = print(job);
  EXPECT_FALSE(result.good);
  EXPECT_THAT(result.verdict, HasSubstr("axis x: following error"));
  EXPECT_LT(result.droplets, job.bumps.size());
  EXPECT_FALSE(result.readings.back().run);
}

TEST(PrintStage, EmergencyStopDuringHomingEndsTheJob) {
  tb::PrintJob job = example("stage.toml").job;
  job.events = {{2.0, tb::EventKind::emergency_stop}};
  const tb::PrintResult result = print(job);
  EXPECT_FALSE(result.good);
  EXPECT_EQ(result.droplets, 0U);
  EXPECT_THAT(result.verdict, HasSubstr("Inhibit"));
}

// ---- what a job may not ask of the stage ----

class StageJob : public ::testing::Test {
 protected:
  StageJob() {
    std::string pattern = (fs::temp_directory_path() / "meltstage-stage-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~StageJob() override { fs::remove_all(folder_); }

  std::string refusal(const std::string& bumps, const std::string& sections,
                      const std::string& deviations = "") const {
    std::ofstream(folder_ / "bumps.csv") << bumps;
    std::ofstream(folder_ / "d.csv") << deviations;
    std::ofstream(folder_ / "job.toml") << "[coordinates]\nfile = \"bumps.csv\"\n" << sections;
    try {
      app::load_job(folder_ / "job.toml");
    } catch (const UserError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

constexpr const char* kBumps = "x_mm,y_mm\n10,10\n12,10\n";

TEST_F(StageJob, LimitsAreNumbersAboveZero) {
  EXPECT_EQ(refusal(kBumps, ""), "");
  for (const char* bad : {"0", "-5", "nan", "inf"})
    for (const char* field : {"speed_mm_s", "acceleration_mm_s2", "jerk_mm_s3"})
      EXPECT_THAT(refusal(kBumps, std::string("[stage]\n") + field + " = " + bad + "\n"),
                  HasSubstr(std::string("job.toml:4:") + std::to_string(std::string(field).size() + 4) +
                            ": stage." + field + ": found"))
          << bad;
  EXPECT_THAT(refusal(kBumps, "[stage]\nmode_hz = 0\n"), HasSubstr("stage.mode_hz: found 0"));
  EXPECT_THAT(refusal(kBumps, "[stage]\nquiet = 1\n"), HasSubstr("stage.quiet: found"));
  EXPECT_THAT(refusal(kBumps, "[print]\nmode = \"fly\"\n"), HasSubstr("one of: stop, fly-by"));
  EXPECT_THAT(refusal(kBumps, "[print]\ndroplets_per_s = 0\n"), HasSubstr("print.droplets_per_s: found 0"));
}

TEST_F(StageJob, PointsMustBeReachable) {
  EXPECT_THAT(refusal("x_mm,y_mm\n10,10\n210,10\n", ""), HasSubstr("row 3: x is 210 mm on the stage"));
  EXPECT_THAT(refusal("x_mm,y_mm\n10,10\nnan,10\n", ""), HasSubstr("row 3, column 1 (x): found 'nan'"));
  EXPECT_THAT(refusal("x_mm,y_mm\n10,10\n12", ""), HasSubstr("ends in the middle of the row"));
  // On the fly the head needs room to speed up.
  std::string row = "x_mm,y_mm\n";
  for (int i = 1; i <= 80; ++i) row += std::to_string(i) + ",10\n";
  EXPECT_EQ(refusal(row, ""), "");
  EXPECT_THAT(refusal(row, "[print]\nmode = \"fly-by\"\n"),
              HasSubstr("row at y 10.000 mm that turns at x -"));
}

TEST_F(StageJob, BoardMarksMustBeAbleToAlign) {
  const auto with = [&](const std::string& marks, const std::string& fields = "") {
    std::ofstream(folder_ / "marks.csv") << "x_mm,y_mm\n" << marks;
    return refusal(kBumps, "[alignment]\nmarks = \"marks.csv\"\n" + fields);
  };
  EXPECT_EQ(with("5,5\n40,5\n"), "");
  EXPECT_THAT(with("5,5\n"), HasSubstr("marks.csv: found 1 mark, expected at least 2"));
  EXPECT_THAT(with("5,5\n5,5\n"), HasSubstr("marks.csv"));
  EXPECT_THAT(with("5,5\nnan,5\n"), HasSubstr("row 3, column 1 (x): found 'nan'"));
  EXPECT_THAT(with("5,5\n205,5\n"), HasSubstr("row 3: x is 205 mm"));
  EXPECT_THAT(with("5,5\n40,5\n", "missing_mark = 3\n"), HasSubstr("alignment.missing_mark: found 3"));
  EXPECT_THAT(with("5,5\n40,5\n", "stage = \"good\"\n"), HasSubstr("one of: calibrated, nominal"));
  EXPECT_THAT(with("5,5\n40,5\n", "tolerance_um = nan\n"), HasSubstr("alignment.tolerance_um: found nan"));
  EXPECT_THAT(with("5,5\n40,5\n", "mark = 1\n"), HasSubstr("alignment.mark: found an unknown key"));
  EXPECT_THAT(refusal(kBumps, "[alignment]\n"), HasSubstr("alignment.marks: found nothing"));
  EXPECT_THAT(refusal(kBumps, "[alignment]\nmarks = \"none.csv\"\n"), HasSubstr("none.csv"));
}

TEST_F(StageJob, DeviationsAreATest) {
  const std::string with = "[stage]\ndeviations_x = \"d.csv\"\n";
  EXPECT_THAT(refusal(kBumps, with, "target_mm,direction,deviation_um\n1,+,0.5\n"), HasSubstr("d.csv"));
  EXPECT_THAT(refusal(kBumps, with, "target_mm,direction,deviation_um\n1,+,oops\n"), HasSubstr("oops"));
  EXPECT_THAT(refusal(kBumps, "[stage]\ndeviations_y = \"none.csv\"\n"), HasSubstr("none.csv"));
}

TEST_F(StageJob, DeviationsAreMeasuredWhereTheBumpsAre) {
  const auto table = [](int from_mm, int to_mm) {
    std::string text = "target_mm,direction,deviation_um\n";
    for (const int at_mm : {from_mm, to_mm})
      for (const char direction : {'+', '+', '-', '-'}) text += fmt::format("{},{},5\n", at_mm, direction);
    return text;
  };
  const std::string with = "[stage]\ndeviations_x = \"d.csv\"\n";
  EXPECT_THAT(refusal(kBumps, with, table(1, 2)),
              HasSubstr("job.toml: stage.deviations_x: found targets from 1 to 2 mm, expected some where the "
                        "bumps are, 10 to 12 mm on the stage"));
  EXPECT_THAT(refusal(kBumps, "[stage]\ndeviations_y = \"d.csv\"\n", table(11, 12)),
              HasSubstr("stage.deviations_y: found targets from 11 to 12 mm"));
  EXPECT_EQ(refusal(kBumps, with, table(10, 12)), "");
  EXPECT_EQ(app::load_job(folder_ / "job.toml").notes.size(), 0U);
  EXPECT_EQ(refusal(kBumps, with, table(9, 11)), "");
  EXPECT_THAT(app::load_job(folder_ / "job.toml").notes,
              ::testing::ElementsAre(
                  "deviations_x: 1 of 2 bumps, the first that of row 3, lie beyond the targets (9 to 11 mm), "
                  "where the outermost target's deviation is taken"));
}

TEST_F(StageJob, OnTheFlyRowsOfOneBumpAreGoodAndABumpThatIsMissedNamesItsReason) {
  std::string bumps = "x_mm,y_mm\n";
  for (int i = 0; i < 6; ++i) bumps += fmt::format("{},{}\n", 2 * i, 2 * i);
  std::ofstream(folder_ / "a.csv") << bumps;
  std::ofstream(folder_ / "a.toml")
      << "[coordinates]\nfile = \"a.csv\"\norigin_x_mm = 100\norigin_y_mm = 100\n[head]\nplant = "
         "\"E3D-like\"\n"
         "[temperature]\nsetpoint_degc = 60\ndwell_s = 1\n[stage]\nstart_x_mm = 98\nstart_y_mm = 98\n"
         "jerk_mm_s3 = 1e6\n[print]\nmode = \"fly-by\"\nsettle_ms = 0\n";
  app::LoadedJob loaded = app::load_job(folder_ / "a.toml");
  const tb::PrintResult result = print(loaded.job);
  EXPECT_EQ(result.droplets, 6U) << result.verdict;
  EXPECT_LT(seconds_of(result, "print"), 2.0);

  // A plan that trusts the axes to follow at once.
  tb::FlyBy& fly_by = *loaded.job.fly_by;
  fly_by.config.follow_mm = 0.0;
  fly_by.plan = motion::plan_fly_by(loaded.job.bumps, fly_by.config);
  const tb::PrintResult missed = print(loaded.job);
  EXPECT_FALSE(missed.good);
  EXPECT_LT(missed.droplets, 6U);
  EXPECT_THAT(missed.verdict, HasSubstr("got no droplet, the first that of row "));
  EXPECT_THAT(missed.verdict, HasSubstr("axis x stayed up to"));
  ASSERT_EQ(missed.faults.size(), 1U);
}

}  // namespace
}  // namespace meltstage
