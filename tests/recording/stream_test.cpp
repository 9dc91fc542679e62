// SPDX-License-Identifier: Apache-2.0
#include "recording/stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <stdexcept>

#include "support.hpp"

namespace meltstage::recording {
namespace {

using ::testing::ElementsAre;

std::vector<Change> changes_of(const Stream& stream) {
  std::vector<Change> changes;
  ChangeReader reader(stream);
  for (Change change; reader.next(change);) changes.push_back(change);
  return changes;
}

// --- the rules of Sink ---

class SinkRules : public ::testing::Test {
 protected:
  SinkRules() {
    stream.begin(small_header());
    stream.change({10, 0, 1});
    stream.change({10, 1, 7});
  }
  void complete_first_cycle() { stream.change({10, 2, 0}); }

  Stream stream;
};

TEST_F(SinkRules, FirstCycleStatesEveryPin) {
  EXPECT_THROW(stream.change({11, 0, 0}), std::invalid_argument);
}

TEST_F(SinkRules, EndWithoutWholeFirstCycleIsRefused) { EXPECT_THROW(stream.end(12), std::invalid_argument); }

TEST_F(SinkRules, FirstCycleMayStateZero) { EXPECT_NO_THROW(complete_first_cycle()); }

TEST_F(SinkRules, CycleGoingBackwardsIsRefused) {
  complete_first_cycle();
  stream.change({15, 0, 0});
  EXPECT_THROW(stream.change({14, 1, 1}), std::invalid_argument);
}

TEST_F(SinkRules, PinTwiceInACycleIsRefused) {
  complete_first_cycle();
  stream.change({15, 1, 8});
  EXPECT_THROW(stream.change({15, 1, 9}), std::invalid_argument);
}

TEST_F(SinkRules, PinsOutOfOrderAreRefused) {
  complete_first_cycle();
  stream.change({15, 1, 8});
  EXPECT_THROW(stream.change({15, 0, 0}), std::invalid_argument);
}

TEST_F(SinkRules, UnchangedValueInANewCycleIsRefused) {
  complete_first_cycle();
  EXPECT_THROW(stream.change({15, 1, 7}), std::invalid_argument);
}

TEST_F(SinkRules, UnchangedValueBehindAChangeOfTheSameCycleIsRefused) {
  complete_first_cycle();
  stream.change({15, 0, 0});
  EXPECT_THROW(stream.change({15, 1, 7}), std::invalid_argument);
}

TEST_F(SinkRules, SecondBeginIsRefusedAndTakesNothingAway) {
  EXPECT_THROW(stream.begin(small_header()), std::invalid_argument);
  complete_first_cycle();
  stream.end(12);
  const Stream before = stream;
  EXPECT_THROW(stream.begin(small_header()), std::invalid_argument);
  EXPECT_TRUE(stream.complete());
  EXPECT_EQ(stream, before);
}

TEST(SinkOrder, NothingComesBeforeBegin) {
  Stream stream;
  EXPECT_THROW(stream.change({0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(stream.end(0), std::invalid_argument);
  EXPECT_THROW(stream.begin({}), std::invalid_argument);
  EXPECT_NO_THROW(stream.begin(small_header()));  // a header that was refused is no begin
}

TEST_F(SinkRules, ValueWiderThanThePinIsRefused) {
  complete_first_cycle();
  EXPECT_NO_THROW(stream.change({15, 1, 0xfff}));
  EXPECT_THROW(stream.change({16, 1, 0x1000}), std::invalid_argument);
}

TEST_F(SinkRules, PinOutsideTheHeaderIsRefused) {
  complete_first_cycle();
  EXPECT_THROW(stream.change({15, 3, 0}), std::invalid_argument);
}

TEST_F(SinkRules, EndBeforeTheLastChangeIsRefused) {
  complete_first_cycle();
  EXPECT_THROW(stream.end(9), std::invalid_argument);
}

TEST_F(SinkRules, EndPastTheLargestCycleIsRefused) {
  complete_first_cycle();
  EXPECT_THROW(stream.end(kMaxCycle + 1), std::invalid_argument);
  EXPECT_NO_THROW(stream.end(kMaxCycle));
}

TEST_F(SinkRules, NothingMayFollowTheEnd) {
  complete_first_cycle();
  stream.end(12);
  EXPECT_THROW(stream.change({13, 0, 0}), std::invalid_argument);
  EXPECT_THROW(stream.end(13), std::invalid_argument);
}

TEST(Stream, ChangeBeforeBeginIsRefused) {
  Stream stream;
  EXPECT_THROW(stream.change({0, 0, 0}), std::invalid_argument);
}

TEST(Stream, ReadingBeforeTheEndIsRefused) {
  Stream stream;
  stream.begin(small_header());
  EXPECT_THROW(Cursor{stream}, std::invalid_argument);
}

TEST(Stream, AFreshOneTakesThePlaceOfARecording) {
  Stream stream = small_stream();
  stream = Stream();
  const Stream same = small_stream();
  copy(same, stream);
  EXPECT_EQ(stream, same);
}

// --- the header ---

struct HeaderDefect {
  const char* name;
  void (*spoil)(Header&);
};

class HeaderDefects : public ::testing::TestWithParam<HeaderDefect> {};

TEST_P(HeaderDefects, AreRefused) {
  Header header = small_header();
  EXPECT_NO_THROW(validate(header));
  GetParam().spoil(header);
  EXPECT_THROW(validate(header), std::invalid_argument);
}

INSTANTIATE_TEST_SUITE_P(
    All, HeaderDefects,
    ::testing::Values(
        HeaderDefect{"no_pin", [](Header& h) { h.pins.clear(); }},
        HeaderDefect{"too_many_pins",
                     [](Header& h) {
                       for (std::size_t i = 0; i <= kMaxPins; ++i)
                         h.pins.push_back({fmt::format("q{}", i), {}, 1, "chip"});
                     }},
        HeaderDefect{"empty_name", [](Header& h) { h.pins[1].name = ""; }},
        HeaderDefect{"name_with_space", [](Header& h) { h.pins[1].name = "a b"; }},
        HeaderDefect{"name_with_digit_first", [](Header& h) { h.pins[1].name = "1a"; }},
        HeaderDefect{"name_too_long",
                     [](Header& h) { h.pins[1].name = std::string(kMaxNameBytes + 1, 'a'); }},
        HeaderDefect{"name_twice", [](Header& h) { h.pins[1].name = h.pins[0].name; }},
        HeaderDefect{"width_0", [](Header& h) { h.pins[1].width = 0; }},
        HeaderDefect{"width_65", [](Header& h) { h.pins[1].width = 65; }},
        HeaderDefect{"direction", [](Header& h) { h.pins[1].direction = static_cast<Direction>(3); }},
        HeaderDefect{"owner", [](Header& h) { h.pins[1].owner = "the chip"; }},
        HeaderDefect{"clock_zero", [](Header& h) { h.clock_hz = 0; }},
        HeaderDefect{"clock_nan", [](Header& h) { h.clock_hz = std::numeric_limits<double>::quiet_NaN(); }},
        HeaderDefect{"clock_too_fast", [](Header& h) { h.clock_hz = 1.1e10; }},
        HeaderDefect{"no_origin", [](Header& h) { h.origin = ""; }},
        HeaderDefect{"origin_too_long", [](Header& h) { h.origin = std::string(kMaxStringBytes + 1, 'a'); }},
        HeaderDefect{"meta_key", [](Header& h) { h.meta["a=b"] = ""; }},
        HeaderDefect{"meta_value", [](Header& h) { h.meta["a"] = std::string(kMaxStringBytes + 1, 'a'); }}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Header, FindsPinsByName) {
  EXPECT_EQ(find_pin(small_header(), "step_x"), 2U);
  EXPECT_EQ(find_pin(small_header(), "step_y"), std::nullopt);
}

// --- walking ---

TEST(Cursor, StandsOnTheFirstCycle) {
  const Stream stream = small_stream();
  const Cursor cursor(stream);
  EXPECT_EQ(cursor.cycle(), 0U);
  EXPECT_THAT(cursor.values(), ElementsAre(0, 0, 0));
  EXPECT_THAT(cursor.changed(), ElementsAre(0, 1, 2));
  EXPECT_EQ(cursor.next_event_cycle(), 5U);
}

TEST(Cursor, WalksEventByEvent) {
  const Stream stream = small_stream();
  Cursor cursor(stream);
  ASSERT_TRUE(cursor.next_event());
  EXPECT_EQ(cursor.cycle(), 5U);
  EXPECT_THAT(cursor.values(), ElementsAre(1, 0, 0));
  EXPECT_THAT(cursor.changed(), ElementsAre(0));
  ASSERT_TRUE(cursor.next_event());
  EXPECT_EQ(cursor.cycle(), 9U);
  EXPECT_THAT(cursor.values(), ElementsAre(1, 0xabc, 1));
  EXPECT_EQ(cursor.next_event_cycle(), std::nullopt);
  EXPECT_FALSE(cursor.next_event());
  EXPECT_EQ(cursor.cycle(), 9U);
}

TEST(Cursor, StepsToTheFinalCycleAndNoFurther) {
  const Stream stream = small_stream();
  Cursor cursor(stream);
  for (std::uint64_t cycle = 1; cycle <= 20; ++cycle) {
    ASSERT_TRUE(cursor.step());
    EXPECT_EQ(cursor.cycle(), cycle);
    EXPECT_EQ(cursor.changed().empty(), cycle != 5 && cycle != 9);
  }
  EXPECT_FALSE(cursor.step());
  EXPECT_EQ(cursor.cycle(), 20U);
}

TEST(Cursor, AdvancesOverSeveralEvents) {
  const Stream stream = small_stream();
  Cursor cursor(stream);
  cursor.advance_to(12);
  EXPECT_THAT(cursor.values(), ElementsAre(1, 0xabc, 1));
  EXPECT_THAT(cursor.changed(), ElementsAre(0, 1, 2));
}

TEST(Cursor, RefusesToGoBackOrPastTheEnd) {
  const Stream stream = small_stream();
  Cursor cursor(stream);
  cursor.advance_to(12);
  EXPECT_THROW(cursor.advance_to(11), std::invalid_argument);
  EXPECT_THROW(cursor.advance_to(21), std::invalid_argument);
}

RC_GTEST_PROP(Cursor, ShowsEveryRowOfTheTable, ()) {
  const Table table = random_table();
  const Stream stream = record(table);
  Cursor cursor(stream);
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    RC_ASSERT(cursor.cycle() == table.first_cycle + i);
    RC_ASSERT(std::equal(cursor.values().begin(), cursor.values().end(), table.rows[i].begin(),
                         table.rows[i].end()));
    RC_ASSERT(cursor.step() == (i + 1 < table.rows.size()));
  }
}

// --- recording ---

TEST(Recorder, FirstCommitStatesEveryPin) {
  Stream stream;
  Recorder recorder(stream, small_header());
  recorder.set(1, 5);
  recorder.commit(3);
  recorder.finish(3);
  EXPECT_THAT(changes_of(stream), ElementsAre(Change{3, 0, 0}, Change{3, 1, 5}, Change{3, 2, 0}));
}

TEST(Recorder, PassesRealChangesOnlyInHeaderOrder) {
  Stream stream;
  Recorder recorder(stream, small_header());
  recorder.commit(0);
  recorder.set(2, 1);
  recorder.set(0, 1);
  recorder.set(1, 9);
  recorder.set(1, 0);  // back before the commit
  recorder.commit(1);
  recorder.commit(2);
  recorder.set(2, 1);  // as it is
  recorder.commit(3);
  recorder.finish(9);
  EXPECT_THAT(changes_of(stream), ElementsAre(Change{0, 0, 0}, Change{0, 1, 0}, Change{0, 2, 0},
                                              Change{1, 0, 1}, Change{1, 2, 1}));
  EXPECT_EQ(stream.final_cycle(), 9U);
}

TEST(Recorder, ValueWiderThanThePinIsRefused) {
  Stream stream;
  Recorder recorder(stream, small_header());
  recorder.set(0, 2);
  EXPECT_THROW(recorder.commit(0), std::invalid_argument);
}

TEST(Stream, NeedsAFewBytesAChange) {
  Stream stream;
  Recorder recorder(stream, small_header());
  for (std::uint64_t cycle = 0; cycle < 1000; ++cycle) {
    recorder.set(2, cycle & 1);
    recorder.commit(cycle);
  }
  recorder.finish(1000);
  EXPECT_EQ(stream.change_count(), 1002U);
  EXPECT_LE(stream.size_bytes(), 3 * stream.change_count());
}

}  // namespace
}  // namespace meltstage::recording
