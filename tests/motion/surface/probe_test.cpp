// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "motion/profile/profile.hpp"
#include "tests/support/rs274.hpp"

namespace meltstage::motion {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

// A ball of radius 50 seen from above: normals and distances are known in closed form.
constexpr double kDome_mm = 50.0;
RealPart dome() {
  return {[](double x, double y) { return std::sqrt(kDome_mm * kDome_mm - x * x - y * y) - kDome_mm; }};
}

ProbeLine dome_line() {
  ProbeLine line{"dome", {}};
  for (int i = -5; i <= 5; ++i) {
    const Eigen::Vector3d n = Eigen::Vector3d(0.08 * i, 0.05, 1.0).normalized();
    line.points.push_back({kDome_mm * n - Eigen::Vector3d(0, 0, kDome_mm), n, 4.0 * (i + 5)});
  }
  return line;
}

TEST(RealPart, DistanceIsThatOfTheBall) {
  for (const double r : {49.0, 50.0, 50.5, 53.0}) {
    const Eigen::Vector3d n = Eigen::Vector3d(0.3, -0.2, 1.0).normalized();
    EXPECT_NEAR(distance_mm(dome(), r * n - Eigen::Vector3d(0, 0, kDome_mm)), r - 50.0, 1e-7);
  }
  RealPart moved = dome();
  moved.placement = Eigen::Translation3d(1.0, 2.0, 3.0);
  EXPECT_NEAR(distance_mm(moved, Eigen::Vector3d(1.0, 2.0, 5.0)), 2.0, 1e-7);
}

// In a valley each face has a foot of its own, and the nearer one counts, on whichever side the point lies.
TEST(RealPart, DistanceInAValleyIsThatOfTheNearerFace) {
  constexpr double kSlope = 0.5;
  const RealPart part{[](double x, double) { return kSlope * std::abs(x); }};
  for (const double x : {-0.4, -0.1, 0.0, 0.02, 0.3})
    for (const double z : {0.5, 1.0, 2.0})
      EXPECT_NEAR(distance_mm(part, {x, 0.0, z}), (z - kSlope * std::abs(x)) / std::hypot(1.0, kSlope), 1e-6)
          << x << " " << z;
  // A ball comes down along the normal of the right face; near the bottom it meets the left one.
  const Eigen::Vector3d normal = Eigen::Vector3d(-kSlope, 0.0, 1.0).normalized();
  TouchProbe probe({.pretravel_mm = 0.0, .lobing_mm = 0.0, .noise_mm = 0.0, .scale_mm = 1e-9}, 1);
  for (const double place_mm : {0.1, 0.45, 0.6}) {
    const Eigen::Vector3d at = place_mm * Eigen::Vector3d(1.0, 0.0, kSlope).normalized();
    const Eigen::Vector3d centre = probe.touch(part, at + 3.0 * normal, at);
    EXPECT_NEAR((centre.z() - kSlope * std::abs(centre.x())) / std::hypot(1.0, kSlope), 1.0, 1e-6)
        << place_mm;
  }
}

TEST(TouchProbe, ReadsTheBallsCentreAtTheSurface) {
  const ProbeLine line = dome_line();
  TouchProbe probe(
      {.ball_radius_mm = 1.0, .pretravel_mm = 0.0, .lobing_mm = 0.0, .noise_mm = 0.0, .scale_mm = 1e-9}, 1);
  const auto touches = touch_all(dome(), {&line, 1}, {}, probe);
  for (std::size_t i = 0; i < touches.size(); ++i)
    EXPECT_LT((touches[i] - line.points[i].position_mm - line.points[i].axis).norm(), 1e-6);
}

TEST(TouchProbe, HasPretravelNoiseAndScale) {
  const ProbeLine line = dome_line();
  const TouchProbeModel model{.noise_mm = 0.0007};
  TouchProbe probe(model, 1);
  double sum = 0.0, square = 0.0;
  int count = 0;
  for (int round = 0; round < 100; ++round) {
    const auto touches = touch_all(dome(), {&line, 1}, {}, probe);
    for (std::size_t i = 0; i < touches.size(); ++i, ++count) {
      const double off =
          (touches[i] - line.points[i].position_mm).dot(line.points[i].axis) - effective_radius_mm(model);
      sum += off, square += off * off;
      EXPECT_NEAR(std::remainder(touches[i].x(), 0.001), 0.0, 1e-9);
    }
  }
  EXPECT_NEAR(sum / count, 0.0, 3e-4);                 // calibrated: no mean error left
  EXPECT_NEAR(std::sqrt(square / count), 8e-4, 3e-4);  // noise, lobing, scale
}

TEST(TouchProbe, RefusesAMoveThatMeetsNothingOrStartsInside) {
  TouchProbe probe({}, 1);
  EXPECT_THAT(error_of([&] { probe.touch(dome(), {0, 0, 20}, {0, 0, 10}); }), HasSubstr("probe: no contact"));
  EXPECT_THAT(error_of([&] { probe.touch(dome(), {0, 0, 0.5}, {0, 0, -2}); }), HasSubstr("before its move"));
  EXPECT_THAT(error_of([&] { surface_along(dome(), {0, 0, 9}, {0, 0, 1}, 3.0); }), HasSubstr("not met"));
}

TEST(ProbeProgram, IsWhatAnInterpreterMakesOfIt) {
  const ProbeLine line = dome_line();
  const ProbeProgramOptions options{.safe_z_mm = 30.0, .station_offset_mm = {1.5, -20.0, 12.25}};
  const std::string program = write_probe_program({&line, 1}, "a (dome)", options);
  const Interpreted run = interpret(program);
  EXPECT_EQ(run.error, "");
  EXPECT_THAT(run.offsets_mm, Contains(Eigen::Vector3d(1.5, -20.0, 12.25)));
  ASSERT_EQ(run.count("STRAIGHT_PROBE"), line.points.size());
  std::size_t next = 0;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  for (const CanonicalMove& move : run.moves) {
    if (move.what == "STRAIGHT_PROBE") {
      const MeasuringPoint& point = line.points[next++];
      EXPECT_LT((move.linear_mm - (point.position_mm - point.axis)).norm(), 1e-4);  // 1 mm radius - 2 mm
      EXPECT_LT((at - (point.position_mm + 3.0 * point.axis)).norm(), 1e-4);        // 1 + 2 mm
    } else {
      EXPECT_GT(distance_mm(dome(), move.linear_mm), 1.5);  // the ball keeps clear
    }
    at = move.linear_mm;
  }
}

TEST(ProbeProgram, NegativeControlOfTheInterpreter) {
  const ProbeLine line = dome_line();
  std::string program = write_probe_program({&line, 1}, "dome", {.safe_z_mm = 30.0});
  program.replace(program.find("G38.2"), 5, "G38.9");
  EXPECT_NE(interpret(program).error, "");
}

TEST(ProbeProgram, RefusesWhatCannotBe) {
  ProbeLine line = dome_line();
  EXPECT_THAT(error_of([&] {
                write_probe_program({&line, 1}, "d", {.safe_z_mm = 1.0});
              }),
              HasSubstr("safe z: found 1 mm, expected at least"));
  EXPECT_THAT(error_of([&] { write_probe_program({}, "d", {}); }), HasSubstr("found no point"));
  EXPECT_THAT(error_of([&] {
                write_probe_program({&line, 1}, "d", {.ball_radius_mm = -1.0});
              }),
              HasSubstr("ball radius: found -1"));
  EXPECT_THAT(error_of([&] {
                write_probe_program({&line, 1}, "d", {.touch_mm_min = 0.04});
              }),
              HasSubstr("touch feed: found 0.04 mm/min, expected 0.1 mm/min at least"));
  line.points[0].axis = Eigen::Vector3d(1, 0, 0);
  EXPECT_THAT(error_of([&] {
                write_probe_program({&line, 1}, "d", {});
              }),
              HasSubstr("faces sideways or down"));
}

// What print asks before it takes touches: are they those of this program?
TEST(ProbeProgram, IsThatOfTheTouches) {
  const ProbeLine line = dome_line();
  const ProbeProgramOptions options{.safe_z_mm = 30.0};
  const std::string program = write_probe_program({&line, 1}, "dome", options);
  const auto message = [&](const std::string& text, const ProbeProgramOptions& wanted,
                           const ProbeLine& points) {
    return error_of([&] { require_probe_program("p.ngc", text, {&points, 1}, wanted); });
  };
  EXPECT_EQ(message(program, options, line), "");
  // Where the ball is held and how fast it goes is the machine's own.
  EXPECT_EQ(message(program, {.touch_mm_min = 5.0, .safe_z_mm = 99.0, .station_offset_mm = {1, 2, 3}}, line),
            "");
  EXPECT_EQ(message(program, {.ball_radius_mm = 2.0}, line),
            "p.ngc: row 3: found ball radius 1 mm, expected 2 mm (ball_radius_mm); give the options that the "
            "program "
            "was written with");
  EXPECT_THAT(message(program, {.approach_mm = 1.5}, line),
              HasSubstr("point 1: found its touch to begin at"));
  EXPECT_THAT(message(program, {.overtravel_mm = 1.5}, line),
              HasSubstr("point 1: found its touch to end at"));
  ProbeLine other = line;
  other.points[3].position_mm.y() += 0.01;
  EXPECT_THAT(message(program, options, other), HasSubstr("point 4: found its touch to begin at"));
  other.points.pop_back();
  EXPECT_THAT(message(program, options, other), HasSubstr("point 4"));
  other = line;
  other.points.push_back(line.points.back());
  EXPECT_THAT(message(program, options, other), HasSubstr("found 11 touches, expected 12"));
  for (std::size_t size = 0; size < program.size() - 4; ++size)  // without its last "M2\n%"
    ASSERT_NE(message(program.substr(0, size), options, line), "") << program.substr(0, size);
  EXPECT_THAT(message("G21\nM2\n", options, line),
              HasSubstr("p.ngc: row 1: found 'G21', expected a row as probe wrote it"));
  EXPECT_THAT(message("M2\n", options, line), HasSubstr("p.ngc: found no ball radius, expected a program"));
}

TEST(ProbeProgram, HoldsNothingButWhatWasWritten) {
  const ProbeLine line = dome_line();
  const ProbeProgramOptions options{.safe_z_mm = 30.0};
  const std::string program = write_probe_program({&line, 1}, "dome", options);
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = program;
    text.replace(text.find(from), from.size(), to);
    return error_of([&] { require_probe_program("p.ngc", text, {&line, 1}, options); });
  };
  EXPECT_EQ(changed("G21 G90", "G20 G90"),
            "p.ngc: row 4: found 'G20 G90 G94 G17 G40 G49 G54', expected a row as probe wrote it; take its "
            "program unchanged");
  EXPECT_THAT(changed("G0 A0 C0\n", "G0 A0 C0\nG10 L2 P1 X5\n"),
              StartsWith("p.ngc: row 9: found 'G10 L2 P1 X5', expected a row as probe wrote it"));
  EXPECT_THAT(changed("G38.2 X", "G38.2 X1.0000 X"), StartsWith("p.ngc: row 13: found 'G38.2 X1.0000 X"));
  EXPECT_THAT(changed("G0 A0 C0", "G0 A90 C0"), StartsWith("p.ngc: row 8: found 'G0 A90 C0'"));
  EXPECT_THAT(changed("G21 G90 G94 G17 G40 G49 G54\n", ""),
              HasSubstr("expected G21 G90 G94 G17 G40 G49 G54 before the first move"));
  EXPECT_THAT(changed("G0 A0 C0", "G0 A0 C0 (turned"), HasSubstr("expected the ')' of the comment"));
  EXPECT_THAT(changed("G0 A0 C0", "(G0 A0 C0) G92 X1"), HasSubstr("row 8: found '(G0 A0 C0) G92 X1'"));
  // A move aside before a touch makes it another one, in whatever rows it stands.
  EXPECT_THAT(changed("G38.2", "G0 X99.0000 Y0.0000\nG38.2"),
              HasSubstr("point 1: found its touch to begin at"));
  // What a shop puts before it.
  EXPECT_EQ(changed("G21 G90", "T5 M6 (probe)\nM1 ; look\nG21 G90"), "");
  EXPECT_EQ(changed("%\n", "\xEF\xBB\xBF%\n"), "");
}

class TouchFile : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) {
    path_ = std::filesystem::temp_directory_path() /
            ("meltstage_touches." + std::to_string(getpid()) +
             ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::ofstream(path_, std::ios::binary) << text;
    return path_;
  }
  void TearDown() override { std::filesystem::remove(path_); }
  std::filesystem::path path_;
};

TEST_F(TouchFile, IsReadAsTheControlWritesIt) {
  const auto touches = read_touches(write("1.5 2.5 -3.25 0 0 0 0 0 0\r\n\n4 5 6 0 0 0 0 0 0\n"));
  ASSERT_EQ(touches.points_mm.size(), 2U);
  EXPECT_EQ(touches.points_mm[0], Eigen::Vector3d(1.5, 2.5, -3.25));
  EXPECT_EQ(touches.rows, (std::vector<std::size_t>{1, 3}));
  EXPECT_EQ(touches.file, path_.string());
  for (const char* text : {"x,y,z\n1,2,3\n", "1, 2, 3\n", "1 ,2 ,3\n", "1;2;3\n"})
    EXPECT_EQ(read_touches(write(text)).points_mm.size(), 1U) << text;
}

TEST_F(TouchFile, ThatIsWrongIsRefused) {
  EXPECT_THAT(error_of([&] { read_touches(write("1 2\n")); }), HasSubstr("row 1: found 2 numbers"));
  EXPECT_THAT(error_of([&] { read_touches(write("1 2 3\n1 nan 3\n")); }),
              HasSubstr("row 2, column 2: found 'nan'"));
  EXPECT_THAT(error_of([&] { read_touches(write("\n")); }), HasSubstr("found no point"));
  EXPECT_THAT(error_of([&] { read_touches("/no/such/file"); }), HasSubstr("no such file"));
  EXPECT_THAT(error_of([&] { read_touches(write("1 2 3\n1 2 3 4\n")); }),
              HasSubstr("row 2: found 4 numbers, expected 3 as in row 1"));
  EXPECT_THAT(error_of([&] { read_touches(write("1 2 3 z\n")); }), HasSubstr("row 1, column 4: found 'z'"));
  EXPECT_THAT(error_of([&] { read_touches(write("1 2 3 0 10 0 0 0 0\n")); }),
              HasSubstr("row 1: found B at 10 degrees, expected a touch with the other axes at zero"));
  EXPECT_THAT(error_of([&] { read_touches(write("1 2 3 0 0 0 1 0 0\n")); }),
              HasSubstr("row 1: found U at 1 mm, expected a touch with the other axes at zero"));
  EXPECT_EQ(read_touches(write("1 2 3 0.0004 -0.0004 0 0 0 0\n")).points_mm.size(),
            1U);  // as the encoder read it
}

// A row of names that are not those of the columns as they are read would be wrong touches.
TEST(Touches, NamesOfOtherColumnsAreRefused) {
  const std::string rows = "1 2 3\n4 5 6\n";
  const auto read = [&](const std::string& names) { return read_touches_text("p.txt", names + "\n" + rows); };
  for (const char* names : {"X Y Z", "# x_mm y_mm z_mm", "x(mm), y(mm), z(mm)", "X (mm) Y (mm) Z (mm)",
                            "touches of part 7", "Probe log"})
    EXPECT_EQ(read(names).points_mm.size(), 2U) << names;
  for (const char* names : {"Y X Z", "X_in Y_in Z_in", "Z Y X", "y z", "X Y Z Z"})
    EXPECT_THAT(error_of([&] { read(names); }), HasSubstr("row 1: found the name '")) << names;
}

TEST_F(TouchFile, HasNoDecimalCommas) {
  EXPECT_EQ(error_of([&] { read_touches_text("p.txt", "1 2 3\n4 6,251000 0,05\n"); }),
            "p.txt: row 2, column 3: found '6,251000', expected numbers with a point, or separated by commas "
            "alone");
  EXPECT_THAT(error_of([&] { read_touches_text("p.txt", "1,5;2,5;3,5\n"); }),
              HasSubstr("p.txt: row 1, column 1: found '1,5'"));
}

TEST_F(TouchFile, ThatIsCutOffIsRefused) {
  const std::string whole = "1.5 2.5 6.050000\n4 5 6.050000\n";
  for (const std::string& text : {whole.substr(0, whole.size() - 1), whole.substr(0, whole.size() - 6)})
    EXPECT_THAT(
        error_of([&] { read_touches(write(text)); }),
        HasSubstr(": row 2: the file ends in the middle of the row, expected its line end; the file may be "
                  "cut off"));
  EXPECT_EQ(read_touches(write(whole + "  ")).points_mm.size(), 2U);
  EXPECT_EQ(read_touches(write("1 2 3\r4 5 6\r")).points_mm.size(), 2U);
}

TEST(AssignTouches, FindsAnotherPartsFile) {
  const ProbeLine line = dome_line();
  Touches touches;
  for (const MeasuringPoint& p : line.points) touches.points_mm.push_back(p.position_mm + 1.02 * p.axis);
  const auto message = [&](const Touches& wrong) {
    return error_of([&] { assign_touches({&line, 1}, wrong, {}); });
  };
  EXPECT_EQ(assign_touches({&line, 1}, touches, {}).front().size(), touches.points_mm.size());
  auto wrong = touches;
  wrong.points_mm[3].x() += 0.5;
  EXPECT_THAT(message(wrong), HasSubstr("point cloud: point 4 is"));
  wrong = touches;
  wrong.points_mm[4] = wrong.points_mm[3];  // one came twice
  EXPECT_THAT(message(wrong), HasSubstr("point cloud: point 5 is"));
  wrong = touches;
  for (Eigen::Vector3d& p : wrong.points_mm) p.x() = -p.x();  // mirrored
  EXPECT_THAT(message(wrong), HasSubstr("is it this part's file?"));
  wrong = touches;
  wrong.points_mm[3] += 5.0 * line.points[3].axis;
  EXPECT_THAT(message(wrong), HasSubstr("+5.0200 mm off"));
  wrong = touches;
  wrong.points_mm.pop_back();
  EXPECT_THAT(message(wrong), HasSubstr("found 10 points, expected 11"));
  wrong = touches;
  wrong.points_mm.push_back(wrong.points_mm.back());
  EXPECT_THAT(message(wrong), HasSubstr("found 12 points, expected 11"));
  EXPECT_THAT(message({}), HasSubstr("found 0 points, expected 11"));
}

TEST(AssignTouches, NamesTheFileOfTheTouchesAndTheirRow) {
  const ProbeLine line = dome_line();
  Touches touches;
  touches.file = "points.txt";
  for (const MeasuringPoint& p : line.points) {
    touches.points_mm.push_back(p.position_mm + 1.02 * p.axis);
    touches.rows.push_back(2 * touches.points_mm.size());
  }
  const auto message = [&](const Touches& wrong) {
    return error_of([&] { assign_touches({&line, 1}, wrong, {}); });
  };
  auto wrong = touches;
  wrong.points_mm[3].x() += 0.5;
  EXPECT_THAT(message(wrong), StartsWith("points.txt: row 8: point 4 is"));
  wrong = touches;
  wrong.points_mm[3] += 5.0 * line.points[3].axis;
  EXPECT_THAT(message(wrong), StartsWith("points.txt: row 8: point 4 on dome is +5.0200 mm off"));
  // A row that is missing shows where the next one stands in its place.
  wrong = touches;
  wrong.points_mm.erase(wrong.points_mm.begin() + 3);
  wrong.rows.erase(wrong.rows.begin() + 3);
  EXPECT_THAT(message(wrong), StartsWith("points.txt: row 10: point 4 is"));
  EXPECT_THAT(message(wrong), HasSubstr("the file has 10 points, and the probe program touches 11"));
  wrong = touches;
  wrong.points_mm.pop_back();
  wrong.rows.pop_back();
  EXPECT_THAT(message(wrong), StartsWith("points.txt: row 20: found 10 points, expected 11"));
}

}  // namespace
}  // namespace meltstage::motion
