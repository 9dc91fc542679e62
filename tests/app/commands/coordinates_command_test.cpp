// SPDX-License-Identifier: Apache-2.0
// `meltstage coordinates`: what is understood of somebody's file of bumps.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "base/temporary_folder.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class CoordinatesCommand : public ::testing::Test {
 protected:
  std::string at(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(at(name)) << text;
    return at(name);
  }
  const TemporaryFolder folder_;
};

TEST_F(CoordinatesCommand, TellsWhatItUnderstood) {
  const std::string file = write("bumps.csv",
                                 "Ref,Layer,X,Y,Unit\na,Bottom,1000,0,mil\nb,Bottom,0,2000,mil\n"
                                 "c,Bottom,1001,0,mil\n");
  const Ran ran = run_command("coordinates " + file);
  EXPECT_EQ(ran.status, 0);
  EXPECT_THAT(ran.output, HasSubstr("bumps.csv: 3 bumps over 25.4254 mm x 50.8 mm\n"
                                    "unit     row 2, column 5 (Unit): mil\n"
                                    "x        0.000000 .. 25.425400 mm\n"
                                    "y        0.000000 .. 50.800000 mm\n"
                                    "first    row 2: (25.400000, 0.000000) mm\n"
                                    "last     row 4: (25.425400, 0.000000) mm\n"
                                    "nearest  0.025400 mm apart: rows 2 and 4\n"
                                    "side     bottom\n"
                                    "note: the bumps lie on the bottom of the board"));
}

TEST_F(CoordinatesCommand, AsksForTheUnitThatIsNotTold) {
  const std::string file = write("bumps.csv", "1 2\n");
  const Ran refused = run_command("coordinates " + file + " < /dev/null");
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.output, HasSubstr("found numbers without a unit"));
  const Ran ran = run_command("coordinates " + file + " --unit um");
  EXPECT_EQ(ran.status, 0);
  EXPECT_THAT(ran.output, HasSubstr("1 bump over 0 mm x 0 mm\nunit     um, as given\n"));
  EXPECT_THAT(ran.output, Not(HasSubstr("nearest")));
  EXPECT_THAT(run_command("coordinates " + file + " --pitch-mm 0.4").output,
              HasSubstr("unit     0.4 mm, as given"));
}

TEST_F(CoordinatesCommand, NamesTheNearestTwo) {
  std::mt19937 random(20261128);
  for (int set = 0; set < 20; ++set) {
    // Few values, so that many share an x or a y.
    std::uniform_int_distribution<int> coordinate(0, set % 2 == 0 ? 60 : 4000);
    std::vector<std::pair<int, int>> points;
    std::string table = "x_um,y_um\n";
    while (points.size() < 40) {
      const std::pair point{coordinate(random), coordinate(random)};
      if (std::find(points.begin(), points.end(), point) != points.end()) continue;
      points.push_back(point);
      table += fmt::format("{},{}\n", point.first, point.second);
    }
    double nearest = 1e9;
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        nearest = std::min(
            nearest, std::hypot(points[i].first - points[j].first, points[i].second - points[j].second));
    EXPECT_THAT(run_command("coordinates " + write("bumps.csv", table)).output,
                HasSubstr(fmt::format("nearest  {:.6f} mm apart", nearest * 1e-3)));
  }
}

TEST_F(CoordinatesCommand, DrawsThem) {
  const std::string file = write("bumps.csv", "x_mm,y_mm\n0,0\n10,0\n0,5\n");
  const std::string picture = at("bumps.svg");
  EXPECT_EQ(run_command("coordinates " + file + " --picture " + picture).status, 0);
  std::ifstream in(picture);
  const std::string svg{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(svg, HasSubstr("<title>3 bumps over 10 mm x 5 mm</title>"));
  EXPECT_THAT(svg, HasSubstr("M40 40h0M40 440h0M840 440h0"));  // y up
  EXPECT_THAT(svg, HasSubstr("<circle cx=\"40\" cy=\"440\""));
  const Ran refused = run_command("coordinates " + file + " --picture " + file);
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.output, HasSubstr("would be written over the input"));
}

}  // namespace
}  // namespace meltstage
