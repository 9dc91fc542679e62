// SPDX-License-Identifier: Apache-2.0
// Tables in dialects drawn at random: each is read as it was meant, or refused.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

struct Unit {
  const char* name;
  double mm;
};

constexpr std::array kUnits{Unit{"mm", 1.0},  Unit{"um", 1e-3},  Unit{"mil", 0.0254},  Unit{"inch", 25.4},
                            Unit{"cm", 10.0}, Unit{"m", 1000.0}, Unit{"\u00b5m", 1e-3}};

constexpr std::array<std::pair<const char*, const char*>, 10> kNames{{{"x", "y"},
                                                                      {"X", "Y"},
                                                                      {"Mid X", "Mid Y"},
                                                                      {"Center-X", "Center-Y"},
                                                                      {"PosX", "PosY"},
                                                                      {"Pos. X", "Pos. Y"},
                                                                      {"X Coord", "Y Coord"},
                                                                      {"Ref X", "Ref Y"},
                                                                      {"Pad X", "Pad Y"},
                                                                      {"Xpos", "Ypos"}}};

enum class UnitPlace { name, row_below, title, cell, column, none };

// One table, and what it holds.
class Dialect {
 public:
  explicit Dialect(std::mt19937_64& random) : random_(random) {
    separator_ = pick(std::array{",", ";", "\t", " "});
    decimal_ = pick(std::array{'.', ','});
    unit_ = pick(kUnits);
    place_ = static_cast<UnitPlace>(below(6));
    if (chance(0.15)) lines_.push_back("# made by a layout system 1.0");
    if (place_ == UnitPlace::title)
      lines_.push_back(fmt::format(
          fmt::runtime(pick(std::array{"Units used: {}", "# units: {}", "Dimensions in {}"})), unit_.name));
    write_names();
    const std::size_t count = 1 + below(8);
    for (std::size_t row = 0; row < count; ++row) write_bump(row);
    line_end_ = pick(std::array{"\n", "\r\n"});
  }

  std::string text() const {
    std::string out = has_mark_ ? "\xEF\xBB\xBF" : "";
    for (const std::string& line : lines_) out += line + line_end_;
    return out;
  }
  const std::vector<std::array<double, 2>>& expected_mm() const { return expected_mm_; }

  // Numbers without a unit count in this.
  double pitch_mm() const { return place_ == UnitPlace::none ? unit_.mm : 1.0; }

 private:
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(random_() % count); }
  bool chance(double share) { return static_cast<double>(random_() >> 11) * 0x1p-53 < share; }
  template <class List>
  typename List::value_type pick(const List& list) {
    return list[below(list.size())];
  }

  std::string cell(const std::string& text) {
    const bool needed = text.find(separator_) != std::string::npos || (*separator_ == ' ' && text.empty());
    return needed || chance(0.1) ? "\"" + text + "\"" : text;
  }

  // "x", "y", or the name of a column that is neither.
  void write_names() {
    columns_ = {"x", "y"};
    for (const char* other : {"Ref", "Value", "Rotation", "Side", "No", "Comment"})
      if (chance(0.3)) columns_.emplace_back(other);
    if (chance(0.5)) std::shuffle(columns_.begin(), columns_.end(), random_);
    if (place_ == UnitPlace::column) columns_.emplace_back("Unit");
    const std::pair<const char*, const char*> axes = pick(kNames);
    const char* form = pick(std::array{"{} ({})", "{}_{}", "{} [{}]", "{} in {}"});
    std::string names, units;
    for (const std::string& column : columns_) {
      const bool place = column == "x" || column == "y";
      std::string name = column == "x" ? axes.first : column == "y" ? axes.second : column;
      if (place && place_ == UnitPlace::name) name = fmt::format(fmt::runtime(form), name, unit_.name);
      names += (&column == columns_.data() ? "" : separator_) + cell(name);
      units += (&column == columns_.data() ? "" : separator_) + cell(place ? unit_.name : "");
    }
    lines_.push_back(names);
    if (place_ == UnitPlace::row_below) lines_.push_back(units);
  }

  // Its text, and how much it is in millimetres.
  std::pair<std::string, double> length() {
    const double value = static_cast<double>(below(150'000)) / 1000.0 / unit_.mm;
    std::string text = chance(0.05) ? fmt::format("{:.6e}", value)
                                    : fmt::format("{}{:.{}f}", chance(0.05) ? "+" : "", value, 3 + below(4));
    const double mm = std::stod(text) * unit_.mm;
    std::replace(text.begin(), text.end(), '.', decimal_);
    if (place_ == UnitPlace::cell) text += std::string(chance(0.5) ? " " : "") + unit_.name;
    return {text, mm};
  }

  std::string other(const std::string& column, std::size_t row) {
    if (column == "Ref") return fmt::format("R{}", row);
    if (column == "Value") return pick(std::array{"10k", "0R", "100n"});
    if (column == "Rotation") return pick(std::array{"0", "90", "180"});
    if (column == "Side") return "top";
    if (column == "No") return fmt::format("{}", row + 1);
    if (column == "Unit") return unit_.name;
    return pick(std::array{"ok", "bottom", "see note", ""});
  }

  void write_bump(std::size_t row) {
    const auto [x, x_mm] = length();
    const auto [y, y_mm] = length();
    expected_mm_.push_back({x_mm, y_mm});
    std::string line;
    for (const std::string& column : columns_)
      line += (&column == columns_.data() ? "" : separator_) + cell(column == "x"   ? x
                                                                    : column == "y" ? y
                                                                                    : other(column, row));
    lines_.push_back(line);
    if (chance(0.03)) lines_.emplace_back();
  }

  std::mt19937_64& random_;
  const char* separator_ = nullptr;
  const char* line_end_ = nullptr;
  char decimal_ = '.';
  Unit unit_{};
  UnitPlace place_{};
  bool has_mark_ = chance(0.2);
  std::vector<std::string> columns_, lines_;
  std::vector<std::array<double, 2>> expected_mm_;
};

TEST_F(Readers, AnyDialectIsReadAsItWasMeantOrRefused) {
  constexpr int kTables = 4000;
  std::mt19937_64 random(testing::UnitTest::GetInstance()->random_seed());
  int taken = 0;
  for (int i = 0; i < kTables; ++i) {
    const Dialect dialect(random);
    const fs::path path = write(fmt::format("{}.csv", i), dialect.text());
    CoordinateFile file;
    try {
      file = read_coordinate_file(path,
                                  {.pitch_mm = dialect.pitch_mm(), .travel = {{-1e9, 1e9}, {-1e9, 1e9}, {}}});
    } catch (const UserError&) {
      continue;
    }
    ++taken;
    ASSERT_EQ(file.points.size(), dialect.expected_mm().size()) << dialect.text();
    for (std::size_t k = 0; k < file.points.size(); ++k) {
      const auto [x_mm, y_mm] = dialect.expected_mm()[k];
      ASSERT_NEAR(file.points[k].x_mm, x_mm, 1e-9 * (1.0 + x_mm)) << dialect.text();
      ASSERT_NEAR(file.points[k].y_mm, y_mm, 1e-9 * (1.0 + y_mm)) << dialect.text();
    }
  }
  // Many are ambiguous, such as decimal commas between commas. A table that is refused shows nothing.
  EXPECT_GT(taken, kTables / 3);
}

}  // namespace
}  // namespace meltstage::motion
