// SPDX-License-Identifier: Apache-2.0
#include "recording/diff.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "support.hpp"

namespace meltstage::recording {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Table table_of(std::vector<std::vector<std::uint64_t>> rows) { return {small_header(), 0, std::move(rows)}; }

TEST(Diff, EqualStreamsAreTheSame) {
  const DiffReport report = diff(small_stream(), small_stream());
  EXPECT_TRUE(report.same());
  EXPECT_EQ(report.cycles_compared, 21U);
  EXPECT_EQ(report.pins_compared, 3U);
}

TEST(Diff, NamesTheFirstDifferenceAndCountsCycles) {
  const Stream a = record(table_of({{0, 1, 0}, {0, 1, 0}, {0, 2, 1}, {0, 2, 1}}));
  const Stream b = record(table_of({{0, 1, 0}, {0, 3, 1}, {0, 3, 1}, {0, 2, 0}}));
  const DiffReport report = diff(a, b);
  EXPECT_FALSE(report.same());
  ASSERT_TRUE(report.first);
  EXPECT_EQ(report.first->cycle, 1U);
  EXPECT_EQ(report.first->pin, "duty");
  EXPECT_EQ(report.first->value_a, 1U);
  EXPECT_EQ(report.first->value_b, 3U);
  ASSERT_EQ(report.pins.size(), 2U);
  EXPECT_EQ(report.pins[0].pin, "duty");
  EXPECT_EQ(report.pins[0].cycles, 2U);
  EXPECT_EQ(report.pins[1].pin, "step_x");
  EXPECT_EQ(report.pins[1].cycles, 2U);
}

TEST(Diff, PairsPinsByNameNotByPlace) {
  const Table a = table_of({{0, 1, 0}, {1, 5, 0}});
  Table b = a;
  std::swap(b.header.pins[0], b.header.pins[1]);
  for (auto& row : b.rows) std::swap(row[0], row[1]);
  EXPECT_TRUE(diff(record(a), record(b)).same());
}

TEST(Diff, FirstDifferenceIsTheFirstPinInTheOrderOfA) {
  const Table a = table_of({{0, 1, 0}, {0, 1, 0}});
  Table b = table_of({{0, 1, 0}, {1, 5, 0}});
  std::swap(b.header.pins[0], b.header.pins[1]);
  for (auto& row : b.rows) std::swap(row[0], row[1]);
  const DiffReport report = diff(record(a), record(b));
  ASSERT_TRUE(report.first);
  EXPECT_EQ(report.first->pin, "rst_n");
}

TEST(Diff, PinWithoutPartnerIsNamed) {
  const Table a = table_of({{0, 1, 0}});
  Table b = a;
  b.header.pins[2].name = "step_y";
  b.header.pins[1].width = 11;
  const DiffReport report = diff(record(a), record(b));
  EXPECT_FALSE(report.same());
  EXPECT_THAT(report.only_in_a, ElementsAre("duty", "step_x"));
  EXPECT_THAT(report.only_in_b, ElementsAre("duty", "step_y"));
  EXPECT_EQ(report.pins_compared, 1U);
}

TEST(Diff, ShorterRecordingIsNotTheSame) {
  const DiffReport report = diff(record(table_of({{0, 1, 0}, {0, 1, 0}})), record(table_of({{0, 1, 0}})));
  EXPECT_FALSE(report.same());
  EXPECT_FALSE(report.first);
  EXPECT_EQ(report.cycles_compared, 1U);
}

TEST(Diff, DifferenceBehindTheSharedSpanDoesNotCount) {
  const DiffReport report = diff(record(table_of({{0, 1, 0}, {0, 2, 0}})), record(table_of({{0, 1, 0}})));
  EXPECT_THAT(report.pins, IsEmpty());
}

TEST(Diff, RecordingsThatDoNotOverlapAreNotTheSame) {
  const Table a = table_of({{0, 1, 0}});
  Table b = a;
  b.first_cycle = 7;
  const DiffReport report = diff(record(a), record(b));
  EXPECT_FALSE(report.same());
  EXPECT_EQ(report.cycles_compared, 0U);
}

RC_GTEST_PROP(Diff, AgreesWithComparingEveryCycle, ()) {
  const Table a = random_table();
  Table b = a;
  const auto flips = *rc::gen::inRange(0, 6);
  for (int i = 0; i < flips; ++i) {
    const auto pin = *rc::gen::inRange<std::size_t>(0, a.header.pins.size());
    const auto row = *rc::gen::inRange<std::size_t>(0, a.rows.size());
    b.rows[row][pin] ^= *rc::gen::arbitrary<std::uint64_t>() & max_value(a.header.pins[pin].width);
  }
  const auto late = *rc::gen::inRange<std::size_t>(0, std::min<std::size_t>(3, b.rows.size()));
  b.rows.erase(b.rows.begin(), b.rows.begin() + static_cast<std::ptrdiff_t>(late));
  b.first_cycle += late;

  std::vector<std::uint64_t> expected(a.header.pins.size());
  std::optional<std::pair<std::uint64_t, std::string>> first;
  for (std::size_t row = 0; row < b.rows.size(); ++row) {
    for (std::size_t pin = 0; pin < expected.size(); ++pin) {
      if (a.rows[row + late][pin] == b.rows[row][pin]) continue;
      ++expected[pin];
      if (!first) first = {b.first_cycle + row, a.header.pins[pin].name};
    }
  }

  const DiffReport report = diff(record(a), record(b));
  RC_ASSERT(report.cycles_compared == b.rows.size());
  RC_ASSERT(report.first.has_value() == first.has_value());
  if (first) RC_ASSERT(std::pair(report.first->cycle, report.first->pin) == *first);
  RC_ASSERT(report.same() == (!first && late == 0));
  std::size_t next = 0;
  for (std::size_t pin = 0; pin < expected.size(); ++pin) {
    if (expected[pin] == 0) continue;
    RC_ASSERT(next < report.pins.size());
    RC_ASSERT(report.pins[next].pin == a.header.pins[pin].name);
    RC_ASSERT(report.pins[next].cycles == expected[pin]);
    ++next;
  }
  RC_ASSERT(next == report.pins.size());
}

}  // namespace
}  // namespace meltstage::recording
