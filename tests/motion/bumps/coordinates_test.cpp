// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/coordinates.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

namespace meltstage::motion {
namespace {

namespace fs = std::filesystem;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const fs::path examples = fs::path(MELTSTAGE_SOURCE_DIR) / "examples";
const fs::path data = fs::path(MELTSTAGE_SOURCE_DIR) / "tests" / "motion" / "data";

class Coordinates : public ::testing::Test {
 protected:
  Coordinates() {
    std::string pattern = (fs::temp_directory_path() / "meltstage-coordinates-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~Coordinates() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, std::string_view content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }

  /// The message without the folder; fails the test if it isn't one line that begins with the file.
  static std::string error_of(const fs::path& path, const CoordinateOptions& options = {}) {
    try {
      read_coordinates(path, options);
    } catch (const UserError& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos);
      EXPECT_THAT(message, StartsWith(path.string() + ": "));
      return message.substr(std::min(message.size(), path.string().size() + 2));
    }
    ADD_FAILURE() << path << " was read without an error";
    return {};
  }

  std::string error_of_csv(std::string_view content) const { return error_of(write("bumps.csv", content)); }

  fs::path folder_;
};

std::string read_file(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void expect_points(const std::vector<Point>& points, const std::vector<Point>& expected) {
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(points[i].x_mm, expected[i].x_mm, 1e-12) << "point " << i;
    EXPECT_NEAR(points[i].y_mm, expected[i].y_mm, 1e-12) << "point " << i;
    EXPECT_EQ(points[i].row, expected[i].row) << "point " << i;
  }
}

// ---- what is read ----

TEST_F(Coordinates, XlsExampleHoldsTheBumpsOfTheEightByEightGrid) {
  const auto points = read_coordinates(examples / "bumps_8x8.xls");
  ASSERT_EQ(points.size(), 24U);
  EXPECT_EQ(points.front().x_mm, 1.0);
  EXPECT_EQ(points.front().y_mm, 1.0);
  EXPECT_EQ(points.front().row, 2U);
  EXPECT_EQ(points.back().x_mm, 3.0);
  EXPECT_EQ(points.back().y_mm, 8.0);
  EXPECT_EQ(points.back().row, 25U);
}

TEST_F(Coordinates, XlsTimesPitchIsTheCsvExample) {
  CoordinateOptions options;
  options.pitch_mm = 0.8;
  expect_points(read_coordinates(examples / "bumps_8x8.xls", options),
                read_coordinates(examples / "bumps.csv"));
}

TEST_F(Coordinates, XlsReadsFirstSheetByColumnNamesAndSkipsBlankRows) {
  expect_points(read_coordinates(data / "named_columns.xls"), {{2.5005, 1.5, 2}, {4.5, 3.5, 4}});
}

TEST_F(Coordinates, TheFirstSheetOfAnOldWorkbookThatIsShownIsRead) {
  const CoordinateFile file =
      read_coordinate_file(data / "first_sheet_hidden.xls", {.travel = {{-9.0, 9.0}, {-9.0, 9.0}, {}}});
  ASSERT_EQ(file.points.size(), 2U);
  EXPECT_EQ(file.points[0].x_mm, 1.0);
  EXPECT_EQ(file.points[1].y_mm, 4.0);
}

TEST_F(Coordinates, XlsWithoutHeaderTakesTheFirstTwoNumericColumns) {
  expect_points(read_coordinates(data / "no_header.xls"), {{0.5, 1.5, 1}, {2.5, 3.5, 2}});
}

TEST_F(Coordinates, XlsFormulasHaveTheValueThatWasSaved) {
  expect_points(read_coordinates(data / "formulas.xls"), {{10.0, 20.0, 2}, {12.5, 20.0, 3}, {15.0, 20.0, 4}});
}

TEST_F(Coordinates, FormatsOfAnXlsAreThoseOfItsNumbers) {
  const CoordinateFile file =
      read_coordinate_file(data / "shown_in_mil.xls", {.travel = {{-9.0, 9.0}, {-9.0, 9.0}, {}}});
  EXPECT_TRUE(file.has_unit);
  expect_points(file.points, {{2.54, 5.08, 2}, {7.6327, -0.00635, 3}});
  expect_points(read_coordinate_file(data / "shown_in_um.xls").points, {{1.5, 2.5, 2}});
  EXPECT_THAT(error_of(data / "shown_as_percent.xls"),
              StartsWith("row 2, column 1 (x): found '1, shown as a percentage', expected a number"));
  EXPECT_THAT(
      error_of(data / "shown_in_thousands.xls"),
      StartsWith("row 2, column 1 (x): found '1500, shown in another scale or sign', expected a number"));
}

TEST_F(Coordinates, XlsErrorIsNoNumber) {
  EXPECT_THAT(error_of(data / "error_cell.xls"),
              StartsWith("row 3, column 2 (y): found '#N/A', expected a number"));
}

TEST_F(Coordinates, KicadExampleTurnsYUpwards) {
  CoordinateOptions options;
  options.origin_x_mm = options.origin_y_mm = 10.0;
  const auto points = read_coordinates(examples / "bga.kicad_mod", options);
  ASSERT_EQ(points.size(), 32U);
  EXPECT_NEAR(points[0].x_mm, 8.0, 1e-12);  // A1 is at (-2, -2) in the file: up and to the left
  EXPECT_NEAR(points[0].y_mm, 12.0, 1e-12);
  EXPECT_EQ(points[0].row, 9U);
}

TEST_F(Coordinates, KicadTakesCopperPadsOfBothKindsAndNoOthers) {
  const auto path =
      write("pads.kicad_mod",
            "\xEF\xBB\xBF(module test (layer F.Cu)\r\n"
            "  (pad 1 thru_hole circle (at 1 -2 90) (size 1 1) (drill 0.5) (layers *.Cu *.Mask))\r\n"
            "  (pad \"a \\\" ) b\" smd rect (at 3 -4) (layers \"F.Cu\"))\r\n"
            "  (pad \"\" smd rect (at 3 -4) (layers \"F.Paste\"))\r\n"
            "  (pad \"\" np_thru_hole circle (at 5 -5) (layers *.Cu))\r\n"
            "  (pad 9 connect rect (at 6 -6) (layers F.Cu)))\r\n");
  const auto file = read_coordinate_file(path);
  expect_points(file.points, {{1, 2, 2}, {3, 4, 3}});
  EXPECT_THAT(file.notes, ::testing::ElementsAre("1 copperless aperture, in row 4, holds no bump",
                                                 "1 unplated hole, in row 5, holds no bump",
                                                 "1 connect pad, in row 6, holds no bump"));
}

// KiCad's y points down and its angles turn counter-clockwise as one sees them: (0.3, 0.1) of a pad that is
// turned by 90 degrees is 0.1 to the right and 0.3 up.
TEST_F(Coordinates, KicadMayShiftTheCopperOfAPad) {
  const auto path =
      write("offset.kicad_mod",
            "(footprint \"a\"\n"
            "  (pad 1 smd rect (at 5 -5) (size 1 1) (drill (offset 0.3 0.1)) (layers F.Cu))\n"
            "  (pad 2 smd rect (at 7 -5 90) (size 1 1) (drill (offset 0.3 0.1)) (layers F.Cu))\n"
            "  (pad 3 thru_hole rect (at 9 -5 90) (size 1 1) (drill 0.5 (offset 0.3 0.1)) (layers *.Cu)))\n");
  expect_points(read_coordinates(path), {{5.3, 4.9, 2}, {7.1, 5.3, 3}, {9, 5, 4}});
  EXPECT_THAT(error_of(write("bad.kicad_mod",
                             "(footprint \"a\" (pad 1 smd rect (at 5 -5 east) (drill (offset 1 "
                             "0)) (layers F.Cu)))")),
              StartsWith("line 1, column 41 (angle of pad '1'): found 'east'"));
}

TEST_F(Coordinates, EveryBgaFootprintOfKicadReads) {
  std::size_t files = 0, pads = 0;
  for (const auto& entry : fs::directory_iterator("/usr/share/kicad/footprints/Package_BGA.pretty")) {
    CoordinateOptions options;
    options.origin_x_mm = options.origin_y_mm = 100.0;
    const auto points = read_coordinates(entry.path(), options);
    // The file says it in its own way: one (pad "name" ...) line a ball, paste apertures have no name.
    const std::string text = read_file(entry.path());
    std::size_t expected = 0;
    for (auto at = text.find("(pad "); at != std::string::npos; at = text.find("(pad ", at + 1))
      if (!std::string_view(text).substr(at).starts_with("(pad \"\"")) ++expected;
    EXPECT_EQ(points.size(), expected) << entry.path();
    ++files;
    pads += points.size();
  }
  EXPECT_GT(files, 100U);
  EXPECT_GT(pads, 50'000U);
}

struct CsvCase {
  const char* name;
  std::string content;
};
class CsvForms : public Coordinates, public ::testing::WithParamInterface<CsvCase> {};

TEST_P(CsvForms, ReadsTheSamePoints) {
  auto points = read_coordinates(write("bumps.csv", GetParam().content));
  for (Point& point : points) point.row = 0;
  expect_points(points, {{1.5, 2.0, 0}, {30.0, 4.25, 0}});
}

INSTANTIATE_TEST_SUITE_P(
    All, CsvForms,
    ::testing::Values(CsvCase{"plain", "1.5,2\n30,4.25\n"}, CsvCase{"no_last_line_end", "1.5,2\n30,4.25"},
                      CsvCase{"header", "x,y\n1.5,2\n30,4.25\n"},
                      CsvCase{"header_upper", "X,Y\n1.5,2\n30,4.25\n"},
                      CsvCase{"unit_suffix", "x_mm,y_mm\n1.5,2\n30,4.25\n"},
                      CsvCase{"unit_in_brackets", "\"X (mm)\",Y [mm]\n1.5,2\n30,4.25\n"},
                      CsvCase{"unit_micrometre", "x_um,Y (\u00b5m)\n1500,2000\n30000,4250\n"},
                      CsvCase{"swapped_columns", "pad,Y,type,X\nA1,2,smd,1.5\nA2,4.25,smd,30\n"},
                      CsvCase{"labels_without_header", "A1,1.5,2\nA2,30,4.25\n"},
                      CsvCase{"byte_order_mark", "\xEF\xBB\xBFx,y\n1.5,2\n30,4.25\n"},
                      CsvCase{"crlf", "x,y\r\n1.5,2\r\n30,4.25\r\n"},
                      CsvCase{"semicolon", "x;y\n1.5;2\n30;4.25\n"},
                      CsvCase{"tab", "x\ty\n1.5\t2\n30\t4.25\n"},
                      CsvCase{"quotes", "\"x\",\"y\"\n\"1.5\",\"2\"\n\"30\",\"4.25\"\n"},
                      CsvCase{"separator_in_quotes", "\"name;a\",x,y\n\"b;c\",1.5,2\n\"d\",30,4.25\n"},
                      CsvCase{"blank_lines", "\n\nx,y\n\n1.5,2\n,\n30,4.25\n\n"},
                      CsvCase{"comment", "# a \"quick\" try; by us\n\n#, more\nx,y\n1.5,2\n30,4.25\n"},
                      CsvCase{"comment_and_crlf", "\xEF\xBB\xBF# of x, y\r\n1.5;2\r\n30;4.25\r\n"},
                      CsvCase{"header_behind_a_hash", "# x_um, y_um\n1500,2000\n30000,4250\n"},
                      CsvCase{"numbered", "#,x,y\n1,1.5,2\n2,30,4.25\n"},
                      CsvCase{"blank_cells_behind", "x,y\n1.5,2,,\n30,4.25, \n"},
                      CsvCase{"spaces_and_signs", "x, y\n +1.5 , 2e0\n3.0E+1 ,4.25\n"}),
    [](const auto& test) { return test.param.name; });

TEST_F(Coordinates, CsvRowsAreLinesOfTheFile) {
  const auto points = read_coordinates(write("a.csv", "x,y,name\r\n\r\n1,2,\"two\nlines\"\r\n3,4,b\r\n"));
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[0].row, 3U);
  EXPECT_EQ(points[1].row, 5U);
}

TEST_F(Coordinates, CsvRowsCountLeadingComments) {
  const auto points = read_coordinates(write("a.csv", "# one\r\n# two\r\nx,y\r\n1,2\r\n"));
  ASSERT_EQ(points.size(), 1U);
  EXPECT_EQ(points[0].row, 4U);
}

TEST_F(Coordinates, ColumnsThatNoRowNamesAreTold) {
  EXPECT_THAT(read_coordinate_file(write("a.csv", "1,5,2,5\n3,5,4,5\n")).notes,
              testing::ElementsAre("no row names the columns: x is column 1 and y column 2 of 4"));
  EXPECT_THAT(read_coordinate_file(write("b.csv", "A1,1,5\nA2,3,5\n")).notes, testing::IsEmpty());
  // Words above that speak of x and y may tell another order.
  EXPECT_THAT(read_coordinate_file(write("c.csv", "# erst y und dann x\n1,2\n3,4\n")).notes,
              testing::ElementsAre("no row names the columns: x is column 1 and y column 2 of 2"));
}

TEST_F(Coordinates, RemarksMayNameTheColumns) {
  for (const char* names : {"# Y-Achse X-Achse", "# y-axis x-axis", "# y x"}) {
    const auto points = read_coordinates(write("a.txt", std::string(names) + "\n1 2\n3 5\n"));
    EXPECT_EQ(points.at(1).x_mm, 5.0) << names;
  }
  for (const char* names :
       {"# columns: y_mm, x_mm", "# Spalten: y (mm), x (mm)", "# Format: Y,X", "# order=y,x"}) {
    const auto points = read_coordinates(write("a.csv", std::string(names) + "\n1,2\n3,5\n"));
    EXPECT_EQ(points.at(1).x_mm, 5.0) << names;
  }
}

TEST_F(Coordinates, DecimalCommasMayHaveAUnit) {
  const auto points = read_coordinates(write("a.csv", "x;y\n1,5 mm;250um\n+0,5mm;2,25 mm\n"));
  ASSERT_EQ(points.size(), 2U);
  EXPECT_DOUBLE_EQ(points[0].x_mm, 1.5);
  EXPECT_DOUBLE_EQ(points[0].y_mm, 0.25);
  EXPECT_DOUBLE_EQ(points[1].x_mm, 0.5);
  EXPECT_DOUBLE_EQ(points[1].y_mm, 2.25);
}

TEST_F(Coordinates, ExtensionCountsInAnyCase) {
  EXPECT_EQ(read_coordinates(write("A.CSV", "1,2\n")).size(), 1U);
}

TEST_F(Coordinates, MirrorScaleRotateAndShiftFollowInThisOrder) {
  CoordinateOptions options;
  options.mirror_x = true;
  options.pitch_mm = 2.0;
  options.rotation_deg = 90.0;
  options.origin_x_mm = 100.0;
  options.origin_y_mm = 50.0;
  // (3, 4) -> (-3, 4) -> (-6, 8) -> (-8, -6) -> (92, 44)
  expect_points(read_coordinates(write("a.csv", "3,4\n"), options), {{92, 44, 1}});
}

TEST_F(Coordinates, RotationTurnsCounterClockwise) {
  CoordinateOptions options;
  options.rotation_deg = 30.0;
  expect_points(read_coordinates(write("a.csv", "10,0\n"), options), {{8.660254037844386, 5.0, 1}});
}

TEST_F(Coordinates, BumpsNearerThanATenthOfAMicrometreAreOne) {
  for (const char* near : {"1,2\n1.00005,2\n", "1,2\n0.99995,2\n", "1,2\n1.00009,2.00009\n",
                           "1,2\n1,1.99992\n", "1.00004,2\n1.00013,2\n", "1.00013,2.00008\n1.00004,2\n"})
    EXPECT_THAT(error_of_csv(near), StartsWith("row 2: found (")) << near;
  EXPECT_THAT(error_of_csv("5,5\n1.00005,2\n1,2\n1,2\n"), HasSubstr("again, first in row "));
  for (const char* apart :
       {"1,2\n1.0001,2\n", "1,2\n1,2.0001\n", "1,2\n1.0002,2\n", "0.00004,1\n0.00014,1\n"})
    EXPECT_EQ(read_coordinates(write("a.csv", apart)).size(), 2U) << apart;
}

TEST_F(Coordinates, EndsOfTheTravelBelongToIt) {
  EXPECT_EQ(read_coordinates(write("a.csv", "0,0\n200,200\n")).size(), 2U);
}

RC_GTEST_FIXTURE_PROP(Coordinates, CsvRoundTripIsExact, ()) {
  const auto raw = *rc::gen::unique<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(0, 200'000), rc::gen::inRange(0, 200'000)));
  RC_PRE(!raw.empty());
  std::string text;
  for (const auto& [x, y] : raw) text += fmt::format("{},{}\n", x / 1000.0, y / 1000.0);
  const auto points = read_coordinates(write("a.csv", text));
  RC_ASSERT(points.size() == raw.size());
  for (std::size_t i = 0; i < raw.size(); ++i) {
    RC_ASSERT(points[i].x_mm == raw[i].first / 1000.0);
    RC_ASSERT(points[i].y_mm == raw[i].second / 1000.0);
  }
}

// ---- what is refused: the file as a whole ----

TEST_F(Coordinates, MissingFile) { EXPECT_THAT(error_of(folder_ / "none.csv"), StartsWith("no such file")); }

TEST_F(Coordinates, Directory) {
  fs::create_directory(folder_ / "folder.csv");
  EXPECT_THAT(error_of(folder_ / "folder.csv"), StartsWith("found a folder"));
}

TEST_F(Coordinates, Pipe) {
  ASSERT_EQ(mkfifo((folder_ / "pipe.csv").c_str(), 0600), 0);
  EXPECT_THAT(error_of(folder_ / "pipe.csv"), StartsWith("found a pipe"));
}

TEST_F(Coordinates, EmptyFile) {
  for (const char* name : {"a.xls", "a.csv", "a.kicad_mod"})
    EXPECT_THAT(error_of(write(name, "")), StartsWith("the file is empty"));
}

TEST_F(Coordinates, UnknownExtension) {
  EXPECT_THAT(error_of(write("a.ods", "PK\x03\x04")),
              StartsWith("found extension '.ods', expected one of .xls, .xlsx, .csv, .tsv, .txt, .mnt"));
}

TEST_F(Coordinates, ContentOfAnotherKind) {
  const std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16);
  EXPECT_THAT(error_of(write("a.xls", png)), StartsWith("found a PNG image, expected an Excel"));
  EXPECT_THAT(error_of(write("b.xls", "x,y\n1,2\n")), StartsWith("found text, expected an Excel"));
  EXPECT_THAT(error_of(write("c.xls", "PK\x03\x04 xlsx")), StartsWith("found a ZIP archive (.xlsx"));
  EXPECT_THAT(error_of(write("d.csv", png)), StartsWith("found a PNG image, expected separated text"));
  EXPECT_THAT(error_of(write("e.csv", read_file(examples / "bumps_8x8.xls"))),
              StartsWith("found an OLE2 file"));
  EXPECT_THAT(error_of(write("f.csv", std::string("1,2\n\0", 5))), StartsWith("found binary data"));
  EXPECT_THAT(error_of(write("g.csv", std::string("\xFF\xFEx\0,\0y\0", 8))), StartsWith("found no points"));
  EXPECT_THAT(error_of(write("h.kicad_mod", png)),
              StartsWith("found a PNG image, expected a KiCad footprint"));
  EXPECT_THAT(error_of(write("i.kicad_mod", "x,y\n1,2\n")),
              StartsWith("line 1, column 1: found 'x,y', expected (foot"));
  EXPECT_THAT(error_of(write("j.kicad_mod", "(kicad_pcb (version 1))")),
              StartsWith("line 1, column 1: found '(kicad_pcb', expected a footprint"));
}

TEST_F(Coordinates, XlsThatIsAnotherOleDocument) {
  const std::string signature = "\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1";
  EXPECT_THAT(error_of(write("a.xls", signature + std::string(2000, '\0'))),
              StartsWith("the workbook can't be opened"));
}

TEST_F(Coordinates, XlsCutOffAnywhereIsRefused) {
  const std::string whole = read_file(examples / "bumps_8x8.xls");
  for (std::size_t size = 1; size < whole.size(); size += 61)
    EXPECT_NE(error_of(write("cut.xls", whole.substr(0, size))), "") << size;
}

// One byte changed: a record length that leads freexl 1.0.6 to a second sheet size, and out of its buffer.
TEST_F(Coordinates, XlsThatCrashesItsReaderIsRefusedInOneLine) {
  const std::string message = error_of(data / "damaged_record_length.xls");
  EXPECT_THAT(message, StartsWith("damaged: the spreadsheet reader failed (signal "));
  EXPECT_THAT(message,
              EndsWith("); expected an .xls of Excel 97-2003; save the file again or export it as .csv"));
}

// The parent must leave no child behind, whether it read all rows, stopped at a bad one or lost the child.
TEST_F(Coordinates, XlsReaderLeavesNoChildProcess) {
  for (const char* name : {"named_columns.xls", "bad_number.xls", "damaged_record_length.xls"}) {
    try {
      read_coordinates(data / name);
    } catch (const UserError&) {
    }
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << name;
    EXPECT_EQ(errno, ECHILD) << name;
  }
}

/// The content with one to four places damaged: a bit, a byte, a stretch, or the rest cut off.
std::string damaged(std::string content, std::mt19937& random) {
  for (unsigned n = 1 + random() % 4; n > 0; --n) {
    const std::size_t at = random() % content.size();
    switch (random() % 8) {
      case 0:
        content[at] = static_cast<char>(content[at] ^ 1 << random() % 8);
        break;
      case 1:
        for (std::size_t i = at; i < std::min(content.size(), at + 32); ++i)
          content[i] = static_cast<char>(random());
        break;
      case 2:
        content.resize(at + 1);
        break;
      default:
        content[at] = static_cast<char>(random());
    }
  }
  return content;
}

TEST_F(Coordinates, DamagedFilesGivePointsOrOneLine) {
  const fs::path originals[] = {examples / "bumps_8x8.xls", data / "damaged_record_length.xls",
                                data / "named_columns.xls", data / "header_only.xls",
                                examples / "bumps.csv",     examples / "bga.kicad_mod"};
  std::mt19937 random(20260711);
  int refused = 0, crashed = 0;
  constexpr int kFiles = 700;
  for (int i = 0; i < kFiles; ++i) {
    const fs::path& original = originals[random() % std::size(originals)];
    const fs::path path =
        write("damaged" + original.extension().string(), damaged(read_file(original), random));
    try {
      EXPECT_FALSE(read_coordinates(path).empty());
    } catch (const UserError& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      EXPECT_THAT(message, StartsWith(path.string() + ": "));
      ++refused;
      crashed += message.find("reader failed") != std::string::npos ? 1 : 0;
    }
  }
  EXPECT_GT(refused, kFiles / 4);
  EXPECT_LT(refused, kFiles);
  EXPECT_GT(crashed, 0) << "no file reached the separate process's purpose";
}

TEST_F(Coordinates, NoPoints) {
  const std::string expected = "found no points, expected at least one";
  EXPECT_EQ(error_of_csv("\n\n"), expected);
  EXPECT_EQ(error_of_csv("x,y\n"), expected);
  EXPECT_EQ(error_of(data / "header_only.xls"), expected);
  EXPECT_EQ(error_of(data / "empty_sheet.xls"), expected);
  EXPECT_THAT(error_of(write("a.kicad_mod", "(footprint \"a\")")),
              StartsWith("found no pads, expected pads"));
}

TEST_F(Coordinates, MoreThanTwoMillionPoints) {
  std::string text;
  for (std::size_t i = 0; i <= kMaxPoints; ++i) text += "1,1\n";
  EXPECT_THAT(error_of_csv(text), StartsWith("found more than 2000000 points"));
}

// ---- what is refused: one row ----

struct BadCsv {
  const char* name;
  std::string content;
  const char* message;
};
class BadCsvForms : public Coordinates, public ::testing::WithParamInterface<BadCsv> {};

TEST_P(BadCsvForms, NamesPlaceAndValue) {
  EXPECT_THAT(error_of_csv(GetParam().content), StartsWith(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    All, BadCsvForms,
    ::testing::Values(
        BadCsv{"word", "x,y\n1,2\n3,abc\n", "row 3, column 2 (y): found 'abc', expected a number"},
        BadCsv{"two_points", "x,y\n1.2.3,2\n", "row 2, column 1 (x): found '1.2.3', expected a number"},
        BadCsv{"first_row_malformed", "1.2.3,4.5,6.7\n",
               "row 1, column 1 (x): found '1.2.3', expected a number"},
        BadCsv{"two_decimal_marks", "x;y\n1,5;2.5\n",
               "row 2, column 2: found '1,5' in row 2 and '2.5' in row 2, expected one decimal mark"},
        BadCsv{"thousands", "x;y\n1,234,5;2\n", "row 2, column 1 (x): found '1,234,5', expected a number"},
        BadCsv{"hexadecimal", "x,y\n0x10,2\n", "row 2, column 1 (x): found '0x10', expected a number"},
        BadCsv{"too_large", "x,y\n1e999,2\n", "row 2, column 1 (x): found '1e999', expected a number"},
        BadCsv{"plus_minus", "x,y\n+-1,2\n", "row 2, column 1 (x): found '+-1', expected a number"},
        BadCsv{"control_sign", "x,y\n1\x01,2\n", "row 2, column 1 (x): found '1\\x01', expected a number"},
        BadCsv{"nan", "x,y\n1,nan\n", "row 2, column 2 (y): found 'nan', expected a finite number"},
        BadCsv{"inf", "x,y\n-inf,1\n", "row 2, column 1 (x): found '-inf', expected a finite number"},
        BadCsv{"nan_first", "NaN,1\n", "row 1, column 1 (x): found 'NaN', expected a finite number"},
        BadCsv{"empty_cell", "x,y\n1,\n3,4\n", "row 2, column 2 (y): found nothing, expected a number"},
        BadCsv{"short_row", "x,y\n1\n3,4\n", "row 2, column 2 (y): found nothing, expected a number"},
        BadCsv{"one_column", "5\n", "row 1, column 2 (y): found nothing, expected a number"},
        BadCsv{"word_after_number", "5,abc\n", "row 1, column 2 (y): found 'abc', expected a number"},
        BadCsv{"no_y", "x,z\n1,2\n",
               "row 1: no column named y, found 'x', 'z'; expected a header with x and y"},
        BadCsv{"no_x", "a,y\n1,2\n", "row 1: no column named x, found 'a', 'y'"},
        BadCsv{"neither", "left,top\n1,2\n", "row 1: no column named x and y, found 'left', 'top'"},
        BadCsv{"two_x", "x,X,y\n1,2,3\n", "row 1, column 2: found a second column named x"},
        BadCsv{"unknown_unit", "x_px,y_px\n1,2\n",
               "row 1, column 1: found unit 'px' in the name 'x_px', expected mm"},
        BadCsv{"unit_at_one", "x_mm,y\n1,2\n", "row 1: found a unit at one of x and y only"},
        BadCsv{"ends_in_row", "x,y\n1,2\n3", "row 3, column 2 (y): the file ends in the middle of the row"},
        BadCsv{"ends_behind_separator", "x,y\n1,2\n3,",
               "row 3, column 2 (y): the file ends in the middle of the row"},
        BadCsv{"ends_in_quotes", "x,y\n1,2\n3,\"4", "row 3, column 2: the file ends inside a quoted cell"},
        BadCsv{"stray_quote", "x,y\n1,2\n3,4\"5\n", "row 3, column 2: found a quote inside a cell"},
        BadCsv{"row_after_blank_crlf", "x,y\r\n\r\n1,2\r\n\r\n1,q\r\n", "row 5, column 2 (y): found 'q'"},
        BadCsv{"commas_for_both", "x,y\n10,5,20,5\n30,5,40,5\n",
               "row 2: found 4 cells, expected at most 2, as row 1 has; where a comma is the decimal mark"},
        BadCsv{"more_cells_than_the_first_row", "1,2\n3,4\n5,6,7\n",
               "row 3: found 3 cells, expected at most 2, as row 1 has"},
        BadCsv{
            "more_cells_between_semicolons", "x;y\n1;2\n3;4;5\n",
            "row 3: found 3 cells, expected at most 2, as row 1 has; quote a cell that holds the separator"},
        BadCsv{"comment_inside", "x,y\n1,2\n# the end\n", "row 3, column 1 (x): found '# the end'"},
        BadCsv{"duplicate", "x,y\n1,2\n3,4\n1.0,2.0\n", "row 4: found (1, 2) mm again, first in row 2"},
        BadCsv{"duplicate_in_g_code", "x,y\n1,1\n1.00001,1\n",
               "row 3: found (1.00001, 1) mm again, first in row 2"},
        BadCsv{"duplicate_by_rounding", "x,y\n1,2\n1.0000001,2\n",
               "row 3: found (1, 2) mm again, first in row 2"},
        BadCsv{"above_travel", "x,y\n1,2\n200.001,2\n",
               "row 3: x is 200.001 mm on the stage, expected 0..200 mm (travel)"},
        BadCsv{"below_travel", "x,y\n1,-0.5\n",
               "row 2: y is -0.5 mm on the stage, expected 0..200 mm (travel)"}),
    [](const auto& test) { return test.param.name; });

TEST_F(Coordinates, LongValuesAreCutInMessages) {
  const std::string message = error_of_csv("x,y\n1," + std::string(5000, 'q') + "\n");
  EXPECT_LT(message.size(), 200U);
  EXPECT_THAT(message, HasSubstr("qqq...'"));
}

TEST_F(Coordinates, XlsBadNumberNamesSheetRowAndColumn) {
  EXPECT_THAT(error_of(data / "bad_number.xls"),
              StartsWith("row 3, column 2 (y): found 'abc', expected a number"));
}

TEST_F(Coordinates, XlsMissingCellNamesSheetRowAndColumn) {
  EXPECT_THAT(error_of(data / "missing_cell.xls"),
              StartsWith("row 3, column 2 (y): found nothing, expected a number"));
}

struct BadKicad {
  const char* name;
  std::string content;
  const char* message;
};
class BadKicadForms : public Coordinates, public ::testing::WithParamInterface<BadKicad> {};

TEST_P(BadKicadForms, NamesPlaceAndValue) {
  EXPECT_THAT(error_of(write("a.kicad_mod", GetParam().content)), StartsWith(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    All, BadKicadForms,
    ::testing::Values(
        BadKicad{"bad_x", "(footprint a\n (pad A1 smd circle (at 1,5 2)))",
                 "line 2, column 25 (x of pad 'A1'): found '1,5', expected a finite number"},
        BadKicad{"nan_y", "(footprint a\n (pad A1 smd circle (at 1 nan)))",
                 "line 2, column 27 (y of pad 'A1'): found 'nan', expected a finite number"},
        BadKicad{"no_y", "(footprint a\n (pad A1 smd circle (at 1)))",
                 "line 2, column 21: found no y, expected (at x y)"},
        BadKicad{"no_at", "(footprint a\n (pad A1 smd circle))",
                 "line 2, column 2: found pad 'A1' without a position"},
        BadKicad{
            "two_places", "(footprint a\n (pad A1 smd circle (at 1 -2)\n (at 5 -6) (layers F.Cu)))",
            "line 3, column 2: found a second (at ...), expected one; the first is in line 2, column 21"},
        BadKicad{"two_lists_of_layers",
                 "(footprint a\n (pad A1 smd circle (at 1 -2) (layers F.Cu) (layers B.Cu)))",
                 "line 2, column 45: found a second (layers ...), expected one"},
        BadKicad{"two_offsets",
                 "(footprint a\n (pad A1 smd circle (at 1 -2) (drill (offset 1 0) (offset 2 0))))",
                 "line 2, column 51: found a second (offset ...), expected one"},
        BadKicad{"ends_in_list", "(footprint a\n (pad A1 smd (at 1 2)",
                 "line 2, column 2: the file ends inside the list"},
        BadKicad{"ends_in_text", "(footprint \"a", "line 1, column 12: the file ends inside the text"},
        BadKicad{"ends_at_once", "(", "line 1, column 1: the file ends inside the list"},
        BadKicad{"no_name", "()", "line 1, column 2: found ')', expected the word footprint"},
        BadKicad{"blank", " \n ", "line 2, column 2: found the end of the file, expected (footprint ...)"},
        BadKicad{"too_many_brackets", "(footprint a))", "line 1, column 14: found ')' behind the footprint"},
        BadKicad{"too_deep", "(footprint a " + std::string(100'000, '('), "line 1, column 77: found '(((("},
        BadKicad{"two_sides",
                 "(footprint a\n(pad 1 smd r (at 1 -2) (layers F.Cu F.Paste))\n(pad 2 thru_hole r (at 2 -2) "
                 "(layers *.Cu))\n(pad 3 smd r (at 3 -2) (layers \"B.Cu\")))",
                 "row 4: found side 'bottom' behind bumps of side 'top', expected one side"},
        BadKicad{"duplicate", "(footprint a\n(pad 1 smd (at 1 -2))\n(pad 2 smd (at 1 -2)))",
                 "row 3: found (1, 2) mm again, first in row 2"},
        BadKicad{"out_of_travel", "(footprint a\n(pad 1 smd r (at 1 2)))", "row 2: y is -2 mm on the stage"}),
    [](const auto& test) { return test.param.name; });

// ---- what is refused: options ----

TEST_F(Coordinates, PitchForCoordinatesWithAUnit) {
  CoordinateOptions options;
  options.pitch_mm = 0.5;
  EXPECT_THAT(error_of(examples / "bumps.csv", options),
              StartsWith("found pitch 0.5 mm for coordinates that have a unit"));
  EXPECT_THAT(error_of(examples / "bga.kicad_mod", options),
              StartsWith("found pitch 0.5 mm for coordinates that have"));
}

TEST_F(Coordinates, OptionsOutOfRange) {
  const auto message = [](const CoordinateOptions& options) -> std::string {
    try {
      read_coordinates(examples / "bumps.csv", options);
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  };
  CoordinateOptions options;
  options.pitch_mm = 0.0;
  EXPECT_EQ(message(options), "pitch: found 0 mm, expected a finite number above 0");
  options = {};
  options.origin_x_mm = std::numeric_limits<double>::infinity();
  EXPECT_EQ(message(options), "origin x: found inf, expected a finite number");
  options = {};
  options.rotation_deg = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message(options), "rotation: found nan, expected a finite number");
  options = {};
  options.travel.y = {10.0, 5.0};
  EXPECT_EQ(message(options), "travel y: found 10..5 mm, expected finite ends, the smaller first");
}

TEST_F(Coordinates, NameTheSystemRefuses) {
  EXPECT_THAT(error_of(folder_ / (std::string(300, 'n') + ".csv")), StartsWith("can't be read ("));
}

}  // namespace
}  // namespace meltstage::motion
