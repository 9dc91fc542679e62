// SPDX-License-Identifier: Apache-2.0
// What tests of the bumps' readers share: files in a folder of their own, and what is read from them.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "motion/bumps/coordinates.hpp"

namespace meltstage::motion {

namespace fs = std::filesystem;

class Readers : public ::testing::Test {
 protected:
  Readers() {
    std::string pattern = (fs::temp_directory_path() / "meltstage-readers-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~Readers() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, std::string_view content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }

  std::string error_of(const std::string& name, std::string_view content,
                       const CoordinateOptions& options = {}) const {
    return error_of(write(name, content), options);
  }

  static std::string error_of(const fs::path& path, const CoordinateOptions& options = {}) {
    try {
      read_coordinates(path, options);
    } catch (const UserError& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos);
      EXPECT_THAT(message, ::testing::StartsWith(path.string() + ": "));
      return message.substr(std::min(message.size(), path.string().size() + 2));
    }
    return "read without an error";
  }

  CoordinateFile read(const std::string& name, std::string_view content,
                      const CoordinateOptions& options = {}) const {
    return read_coordinate_file(write(name, content), options);
  }

  fs::path folder_;
};

inline std::string read_file(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void expect_points(const std::vector<Point>& points, const std::vector<Point>& expected) {
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(points[i].x_mm, expected[i].x_mm, 1e-9) << "point " << i;
    EXPECT_NEAR(points[i].y_mm, expected[i].y_mm, 1e-9) << "point " << i;
    EXPECT_EQ(points[i].row, expected[i].row) << "point " << i;
  }
}

// ---- .xlsx, written by another maker's library ----

class Xlsx : public Readers {
 protected:
  /// Runs openpyxl over `body`, in which `sheet` is the active sheet of `book`.
  fs::path make(const std::string& body) const {
    const fs::path script =
        write("make.py", "import openpyxl\nbook = openpyxl.Workbook()\nsheet = book.active\n" + body +
                             "\nbook.save('" + (folder_ / "a.xlsx").string() + "')\n");
    EXPECT_EQ(std::system(("/usr/bin/python3 " + script.string()).c_str()), 0);
    return folder_ / "a.xlsx";
  }

  /// The same, and each formula has this value: openpyxl calculates none.
  fs::path make_calculated(const std::string& body, const std::string& value) const {
    const fs::path path = make(body);
    const fs::path script =
        write("calculate.py",
              "import re, shutil, sys, zipfile\n"
              "path, value = sys.argv[1:]\n"
              "with zipfile.ZipFile(path) as old, zipfile.ZipFile(path + '.new', 'w') as new:\n"
              "  for name in old.namelist():\n"
              "    text = old.read(name)\n"
              "    if name.endswith('sheet1.xml'):\n"
              "      text = re.sub(rb'</f><v ?/>|</f><v></v>', b'</f><v>' + value.encode() + b'</v>', text)\n"
              "    new.writestr(name, text)\n"
              "shutil.move(path + '.new', path)\n");
    EXPECT_EQ(
        std::system(("/usr/bin/python3 " + script.string() + " " + path.string() + " " + value).c_str()), 0);
    return path;
  }

  /// The workbook with other text in its first sheet.
  fs::path with_sheet_text(const fs::path& workbook, const std::string& from, const std::string& to) const {
    const fs::path script = write("change.py",
                                  "import zipfile, sys\n"
                                  "a = zipfile.ZipFile(sys.argv[1])\n"
                                  "b = zipfile.ZipFile(sys.argv[2], 'w')\n"
                                  "for name in a.namelist():\n"
                                  "  text = a.read(name)\n"
                                  "  if name.endswith('sheet1.xml'):\n"
                                  "    assert sys.argv[3].encode() in text, text\n"
                                  "    text = text.replace(sys.argv[3].encode(), sys.argv[4].encode())\n"
                                  "  b.writestr(name, text)\n"
                                  "b.close()\n");
    const std::string changed = (folder_ / ("changed_" + workbook.filename().string())).string();
    EXPECT_EQ(std::system(("/usr/bin/python3 " + script.string() + " " + workbook.string() + " " + changed +
                           " '" + from + "' '" + to + "'")
                              .c_str()),
              0);
    return changed;
  }
};

inline std::vector<std::string> bottom_notes(const CoordinateFile& file) {
  std::vector<std::string> notes;
  for (const std::string& note : file.notes)
    if (note.starts_with("the bumps lie on the bottom of the board and mirror_x is false"))
      notes.push_back(note);
  return notes;
}

/// A layer in millimetres with two apertures; the body begins in row 5.
inline std::string gerber(std::string_view body) {
  return "%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,0.5*%\n%ADD11R,0.5X0.3*%\n" + std::string(body) + "M02*\n";
}

/// A placement file; its rows of bumps are 6 and 7.
inline constexpr std::string_view kPos =
    "### Footprint positions - created on 2026-01-01 ###\n"
    "### Printed by KiCad version 7.0\n"
    "## Unit = mm, Angle = deg.\n"
    "## Side : top\n"
    "# Ref     Val       Package                PosX       PosY       Rot  Side\n"
    "C1        100 nF    C_0603              12.5000    45.6000   90.0000  top\n"
    "U1        MCU       BGA                 20.0000    30.2500    0.0000  top\n"
    "## End\n";

}  // namespace meltstage::motion
