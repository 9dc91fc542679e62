// SPDX-License-Identifier: Apache-2.0
#include "base/number.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace meltstage {
namespace {

TEST(Number, TakesWholeTextsInRange) {
  EXPECT_EQ(number_in("12.5", 0.0, 100.0), 12.5);
  EXPECT_EQ(number_in("+12.5", 0.0, 100.0), 12.5);
  EXPECT_EQ(number_in("-1e2", -100.0, 100.0), -100.0);
  EXPECT_EQ(number_in("0", 0, 0), 0);
  EXPECT_EQ(number_in<std::uint64_t>("18446744073709551615", 0, UINT64_MAX), UINT64_MAX);
  EXPECT_EQ(number_in<std::uint8_t>("255", 0, 255), 255);
}

TEST(Number, RefusesEverythingElse) {
  for (const char* text : {"", " ", "+", "-", "+-1", "--1", "1 ", " 1", "1,5", "1.5.", "0x10", "1e", "inf",
                           "-inf", "nan", "1e999", "1_000", "101", "-0.5"})
    EXPECT_FALSE(number_in(text, 0.0, 100.0)) << text;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const char* text : {"inf", "-inf", "+inf", "infinity", "nan"})
    EXPECT_FALSE(number_in(text, -kInfinity, kInfinity)) << text;
  for (const char* text : {"1.0", "1e2", "-1", "256", "18446744073709551616", "99999999999999999999"})
    EXPECT_FALSE(number_in<std::uint8_t>(text, 0, 255)) << text;
}

}  // namespace
}  // namespace meltstage
