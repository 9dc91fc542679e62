// SPDX-License-Identifier: Apache-2.0
// Netlists in IPC-D-356, as layout systems write them.
#include <fmt/format.h>

#include "reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kHead = "C  IPC-D-356 of a small board\nP  CODE 00\nP  UNITS CUST 0\nP  arrayDim   N\n";

// A record: its operation, the component, what stands in the columns of midpoint and drill, the side, x and
// y.
std::string record(const std::string& operation, const std::string& component, const std::string& drill,
                   const std::string& access, int x, int y) {
  return fmt::format("{}{:<14}   {:<6}-{:<4}{:<7}{}X{:+07d}Y{:+07d}X0118Y0590R000S2\n", operation, "NET1",
                     component, "1", drill, access, x, y);
}

class Ipc356 : public Readers {};

TEST_F(Ipc356, SurfacePadsAndPlatedHolesAreBumps) {
  const std::string board = kHead + record("327", "U1", "", "A01", 12600, -33000) +
                            record("327", "U1", "", "A01", 13600, -33000) +
                            record("317", "J1", " D0400P", "A00", 20000, -33000) +
                            record("317", "VIA", "MD0157P", "A00", 21000, -33000) +
                            record("317", "H1", " D1260U", "A00", 30000, -33000) +
                            record("367", "H2", " D1260U", "A00", 31000, -33000) + "999\n";
  const CoordinateFile read_board = read("a.ipc", board, {.travel = {{-1e3, 1e3}, {-1e3, 1e3}, {}}});
  expect_points(read_board.points, {{32.004, -83.82, 5}, {34.544, -83.82, 6}, {50.8, -83.82, 7}});
  EXPECT_THAT(read_board.notes, Contains(HasSubstr("1 via, in row 8, holds no bump")));
  EXPECT_THAT(read_board.notes, Contains(HasSubstr("1 unplated hole, in row 9, holds no bump")));
  EXPECT_THAT(read_board.notes, Contains(HasSubstr("1 record 367, in row 10, holds no bump")));
}

TEST_F(Ipc356, TheUnitIsThatOfTheFile) {
  for (const char* unit : {"SI", "CUST 1"}) {
    const std::string head = fmt::format("P  UNITS {}\r\n", unit);
    expect_points(read("a.d356", head + record("327", "U1", "", "A01", 12600, 500) + "999\r\n").points,
                  {{12.6, 0.5, 2}});
  }
  EXPECT_THAT(error_of("a.ipc", "P  UNITS FOOT\n999\n"),
              HasSubstr("row 1: found UNITS 'FOOT', expected SI, CUST 0"));
  EXPECT_THAT(error_of("a.ipc", record("327", "U1", "", "A01", 12600, 500) + "999\n"),
              HasSubstr("row 1: found a pad before a line such as 'P  UNITS CUST 1'"));
  EXPECT_THAT(error_of("a.ipc", "P  UNITS SI\nP  UNITS CUST 0\n999\n"),
              HasSubstr("row 2: found UNITS 'CUST 0', expected one"));
}

TEST_F(Ipc356, SidesAreThoseOfTheAccess) {
  const std::string both = kHead + record("327", "U1", "", "A01", 1000, 1000) +
                           record("327", "U2", "", "A02", 2000, 1000) +
                           record("317", "J1", " D0400P", "A00", 3000, 1000) + "999\n";
  EXPECT_THAT(error_of("a.ipc", both), HasSubstr("row 6: found side 'bottom' behind bumps of side 'top'"));
  EXPECT_EQ(read("b.ipc", both, {.side = Side::top}).points.size(), 2U);
  EXPECT_EQ(read("c.ipc", both, {.side = Side::bottom}).points.size(), 2U);
  EXPECT_EQ(read("d.ipc", both, {.only = "U2"}).points.size(), 1U);
}

TEST_F(Ipc356, WhatIsNotUnderstoodIsRefused) {
  const std::string good = record("327", "U1", "", "A01", 1000, 1000);
  EXPECT_THAT(error_of("a.ipc", kHead + good), HasSubstr("ends without its last record 999"));
  EXPECT_THAT(error_of("a.ipc", kHead + good.substr(0, 55) + "\n999\n"),
              HasSubstr("row 5, column 50: found 'Y+0010', expected Y with a sign and six digits"));
  EXPECT_THAT(error_of("a.ipc", kHead + good + "999\n" + good),
              HasSubstr("expected nothing behind 999 in row 6"));
  EXPECT_THAT(error_of("a.ipc", kHead + good.substr(0, 44) + "\n999\n"),
              HasSubstr("row 5, column 42: found 'X+0', expected X"));
  EXPECT_THAT(error_of("a.ipc", kHead + record("327", "U1", "", "B01", 1000, 1000) + "999\n"),
              HasSubstr("row 5, column 39: found 'B01', expected the side, such as A01"));
  EXPECT_THAT(error_of("a.ipc", kHead + std::string("$%&\n999\n")),
              HasSubstr("row 5: found '$%&', expected C, P or a record"));
}

}  // namespace
}  // namespace meltstage::motion
