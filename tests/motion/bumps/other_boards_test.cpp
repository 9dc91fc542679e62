// SPDX-License-Identifier: Apache-2.0
// Other people's boards, and damaged files of every kind.
#include <fmt/format.h>

#include <cstdlib>
#include <random>
#include <string>
#include <utility>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::StartsWith;

const fs::path boards = "/usr/share/doc/gerbv/examples";

CoordinateOptions wide() {
  CoordinateOptions options;
  options.travel.x = options.travel.y = {-1e5, 1e5};
  return options;
}

// gerbv's example board alone and as a panel of two by three.
TEST(Boards, PanelIsTheBoardRepeated) {
  const auto board = read_coordinates(boards / "dan" / "top.gbx", wide());
  const auto panel = read_coordinates(boards / "dan" / "top_sr.gbx", wide());
  ASSERT_EQ(panel.size(), 6 * board.size());
  auto place = panel.begin();
  for (int column = 0; column < 2; ++column)
    for (int line = 0; line < 3; ++line)
      for (const Point& p : board) {
        EXPECT_NEAR(place->x_mm, p.x_mm + column * 4.0 * 25.4, 1e-9);
        EXPECT_NEAR(place->y_mm, p.y_mm + line * 3.0 * 25.4, 1e-9);
        ++place;
      }
}

TEST(Boards, EveryExampleOfGerbvGivesPointsOrOneLine) {
  int read = 0, refused = 0;
  for (const auto& entry : fs::recursive_directory_iterator(boards)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".gbr" && extension != ".grb" && extension != ".gbx" && extension != ".ger" &&
        extension != ".exc" && extension != ".drl" && extension != ".cnc")
      continue;
    try {
      EXPECT_GT(read_coordinates(entry.path(), wide()).size(), 0U);
      ++read;
    } catch (const UserError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      ++refused;
      if (std::getenv("MELTSTAGE_SHOW_REFUSALS") != nullptr) fmt::print("{}\n", error.what());
    }
  }
  EXPECT_GT(read, 10);
}

std::string damaged(std::string content, std::mt19937& random) {
  if (content.empty()) return content;
  for (std::size_t damages = 1 + random() % 3; damages > 0; --damages) {
    const std::size_t at = random() % content.size();
    switch (random() % 4) {
      case 0:
        content.resize(at + 1);
        break;
      case 1:
        content.erase(at, random() % 8);
        break;
      default:
        content[at] = static_cast<char>(random());
    }
    if (content.empty()) return content;
  }
  return content;
}

TEST_F(Xlsx, DamagedFilesGivePointsOrOneLine) {
  const fs::path book = make("for i in range(40):\n  sheet.append([i, 'a%d' % i, 2 * i])");
  const std::pair<std::string, std::string> originals[] = {
      {"a.xlsx", read_file(book)},
      {"b.pos", std::string(kPos)},
      {"c.gbr", gerber("%ABD20*%D10*X1000000Y0D03*X0Y500000D03*%AB*%\nD20*%SRX3Y2I5.0J4.0*%"
                       "X10000000Y10000000D03*%SR*%\n%LR90*%X20000000D03*\n")},
      {"d.drl", "M48\nMETRIC,TZ\nT1C0.5\n%\nT1\nX1.0Y1.0\nR3X2.0\nG91\nX0.5Y0.5\nM30\n"}};
  std::mt19937 random(20261121);
  int refused = 0;
  constexpr int kFiles = 2000;
  for (int i = 0; i < kFiles; ++i) {
    const auto& [name, content] = originals[random() % std::size(originals)];
    const fs::path path = write(name, damaged(content, random));
    try {
      EXPECT_FALSE(read_coordinates(path).empty());
    } catch (const UserError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      EXPECT_THAT(error.what(), StartsWith(path.string() + ": "));
      ++refused;
    }
  }
  EXPECT_GT(refused, kFiles / 4);
  EXPECT_LT(refused, kFiles);
}

}  // namespace
}  // namespace meltstage::motion
