// SPDX-License-Identifier: Apache-2.0
#include "base/place.hpp"

#include <gtest/gtest.h>

namespace meltstage {
namespace {

TEST(Place, CountsLinesAndColumnsFromOne) {
  const auto at = [](std::size_t offset) {
    const Place place = place_of("ab\n\nc", offset);
    return std::pair(place.line, place.column);
  };
  EXPECT_EQ(at(0), std::pair(std::size_t{1}, std::size_t{1}));
  EXPECT_EQ(at(2), std::pair(std::size_t{1}, std::size_t{3}));
  EXPECT_EQ(at(3), std::pair(std::size_t{2}, std::size_t{1}));
  EXPECT_EQ(at(4), std::pair(std::size_t{3}, std::size_t{1}));
  EXPECT_EQ(at(99), std::pair(std::size_t{3}, std::size_t{2}));
}

TEST(Escaped, LeavesTextAndShowsControlBytes) {
  EXPECT_EQ(escaped("plain µm, 温度, 🖨"), "plain µm, 温度, 🖨");
  EXPECT_EQ(escaped("\x1b[31mred\a\r\n\t\x7f"), "\\x1B[31mred\\x07\\x0D\\x0A\\x09\\x7F");
  EXPECT_EQ(escaped(std::string_view("\0", 1)), "\\x00");
  EXPECT_EQ(escaped("\xc2\x9b"
                    "31m"),
            "\\xC2\\x9B31m");  // CSI of 8-bit terminals
}

TEST(Escaped, ShowsBytesThatAreNoUtf8) {
  EXPECT_EQ(escaped("\xff\xfe"), "\\xFF\\xFE");
  EXPECT_EQ(escaped("\xc3"), "\\xC3");           // cut off
  EXPECT_EQ(escaped("\xc0\xaf"), "\\xC0\\xAF");  // overlong
  EXPECT_EQ(escaped("\xe0\x80\xaf"), "\\xE0\\x80\\xAF");
  EXPECT_EQ(escaped("\xed\xa0\x80"), "\\xED\\xA0\\x80");           // a surrogate
  EXPECT_EQ(escaped("\xf4\x90\x80\x80"), "\\xF4\\x90\\x80\\x80");  // beyond U+10FFFF
  EXPECT_EQ(escaped("\x80 a"), "\\x80 a");
}

TEST(Shown, CutsLongTextBetweenCharacters) {
  EXPECT_EQ(shown(std::string(80, 'a')), std::string(80, 'a'));
  EXPECT_EQ(shown(std::string(81, 'a')), std::string(80, 'a') + "...");
  EXPECT_EQ(shown(std::string(79, 'a') + "µm"), std::string(79, 'a') + "...");
  EXPECT_EQ(shown(std::string(77, 'a') + "🖨🖨"), std::string(77, 'a') + "...");
}

TEST(Defect, IsOneLine) {
  EXPECT_EQ(defect_at("a.lib", {3, 7}, "\"x\"", "a number"), "a.lib:3:7: found \"x\", expected a number");
}

}  // namespace
}  // namespace meltstage
