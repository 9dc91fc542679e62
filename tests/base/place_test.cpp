// SPDX-License-Identifier: Apache-2.0
#include "base/place.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/number.hpp"

namespace meltstage {
namespace {

TEST(Place, LinesAndColumnsCountFromOne) {
  const auto place = [](std::size_t offset) {
    const Place p = place_of("ab\ncd\n", offset);
    return std::pair(static_cast<int>(p.line), static_cast<int>(p.column));
  };
  EXPECT_EQ(place(0), std::pair(1, 1));
  EXPECT_EQ(place(2), std::pair(1, 3));
  EXPECT_EQ(place(3), std::pair(2, 1));
  EXPECT_EQ(place(6), std::pair(3, 1));
  EXPECT_EQ(place(99), std::pair(3, 1));
}

TEST(Place, ControlBytesAreShownNotSent) {
  EXPECT_EQ(shown("\x1b[31m\n"), "\\x1B[31m\\x0A");
  EXPECT_EQ(shown(std::string(81, 'a')), std::string(80, 'a') + "...");
}

TEST(Number, IsWholeFiniteAndInRange) {
  EXPECT_EQ(number_in<double>("+1.5e3", -1e4, 1e4), 1500.0);
  EXPECT_EQ(number_in<int>("-7", -7, 7), -7);
  for (const char* text : {"", "+", "+-1", "1x", " 1", "inf", "nan", "1e999", "20000"})
    EXPECT_FALSE(number_in<double>(text, -1e4, 1e4)) << text;
  EXPECT_FALSE(number_in<int>("8", -7, 7));
  EXPECT_FALSE(number_in<int>("99999999999999999999", -7, 7));
}

TEST(File, EndlessAndMissingFilesAreRefused) {
  const auto fails = [](const char* path, const char* message) {
    EXPECT_THAT([&] { read_file(path, "a table", 1000); },
                testing::ThrowsMessage<UserError>(testing::HasSubstr(message)));
  };
  fails("/dev/zero", "/dev/zero: found more than 1000 bytes, expected a table of at most so many");
  fails("/nowhere", "/nowhere: can't be read, expected a table");
  fails("/tmp", "/tmp: can't be read, expected a table");
}

}  // namespace
}  // namespace meltstage
