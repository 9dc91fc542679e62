// SPDX-License-Identifier: Apache-2.0
// Planning, checking and joining windows.
#include "tb/windows/windows.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.hpp"
#include "recording.hpp"
#include "recording/text.hpp"
#include "tb/windows/window_plan.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

WindowPlan plan_recording(const fs::path& folder, const recording::Stream& pins, WindowBorders borders) {
  WindowPlanner planner(folder, {"test", 7}, std::move(borders));
  recording::copy(pins, planner);
  return planner.publish();
}

JoinedWindows check_all(const fs::path& folder, const WindowPlan& plan) {
  for (std::size_t i = 0; i < plan.windows.size(); ++i) write_result(folder, check_window(folder, plan, i));
  return join_folder(folder, plan);
}

// The first clocks of the lively recording.
recording::Stream head_of_recording(std::uint64_t clocks) {
  recording::Stream cut;
  cut.begin(lively_recording().pins.header());
  recording::ChangeReader reader(lively_recording().pins);
  for (recording::Change change; reader.next(change) && change.cycle < clocks;) cut.change(change);
  cut.end(clocks - 1);
  return cut;
}

class Windows : public ::testing::Test {
 protected:
  fs::path work() const { return folder_ / "work"; }
  TemporaryFolder folder_;
};

TEST_F(Windows, TheRecordingHasEveryLandmark) {
  for (const char* name :
       {"start bit of a frame", "inside a frame", "answer begins", "inside an answer", "inside an SPI word",
        "PWM rises", "PWM falls", "commit", "control step", "telemetry", "reset falls", "inhibit"})
    EXPECT_TRUE(lively_recording().landmarks.contains(name)) << name;
}

TEST_F(Windows, BordersAtEveryAwkwardClockGiveAWholeCheck) {
  WindowBorders borders;
  for (const auto& [name, cycle] : lively_recording().landmarks)
    for (std::uint64_t border = cycle - 1; border <= cycle + 2; ++border) borders.at.push_back(border);
  std::sort(borders.at.begin(), borders.at.end());
  borders.at.erase(std::unique(borders.at.begin(), borders.at.end()), borders.at.end());
  const WindowPlan plan = plan_recording(work(), lively_recording().pins, borders);
  EXPECT_EQ(plan.windows.size(), borders.at.size() + 1);
  const JoinedWindows joined = check_all(work(), plan);
  EXPECT_THAT(joined.faults, IsEmpty());
  EXPECT_TRUE(joined.whole);
  EXPECT_EQ(joined.compared.clocks, lively_recording().pins.final_cycle() + 1);
  EXPECT_EQ(joined.compared.flop_values, joined.compared.clocks * joined.flop_bits);
  EXPECT_GT(joined.flop_bits, 4000u);
  EXPECT_GE(joined.compared.frames, 5u);
  EXPECT_GE(joined.compared.samples, 2u);
  EXPECT_EQ(state_hash(read_state(state_file(work(), plan.windows.size()))), plan.windows.back().end_state);
}

TEST_F(Windows, OfOneClockEachGiveAWholeCheck) {
  const WindowPlan plan = plan_recording(work(), head_of_recording(80), {.every = 1});
  EXPECT_EQ(plan.windows.size(), 80u);
  EXPECT_TRUE(check_all(work(), plan).whole);
}

// Equal lengths; the last window is the rest, and a run that ends on a border has no empty one behind it.
TEST_F(Windows, HaveEqualLengths) {
  const WindowPlan uneven = plan_recording(work(), head_of_recording(1000), {.every = 300});
  ASSERT_EQ(uneven.windows.size(), 4u);
  EXPECT_EQ(uneven.windows[3].first_cycle, 900u);
  EXPECT_EQ(uneven.windows[3].last_cycle, 999u);
  const WindowPlan even = plan_recording(work(), head_of_recording(900), {.every = 300});
  EXPECT_EQ(even.windows.size(), 3u);
}

TEST_F(Windows, BordersComeInAnyOrderAndTwice) {
  const WindowPlan plan = plan_recording(work(), head_of_recording(1000), {.at = {700, 300, 700}});
  ASSERT_EQ(plan.windows.size(), 3u);
  EXPECT_EQ(plan.windows[1].first_cycle, 300u);
  EXPECT_EQ(plan.windows[2].first_cycle, 700u);
}

TEST_F(Windows, ABorderOutsideTheRunIsRefused) {
  EXPECT_THROW(plan_recording(work(), head_of_recording(1000), {.at = {0, 300}}), UserError);
  EXPECT_THROW(plan_recording(work(), head_of_recording(1000), {.at = {300, 1000}}), UserError);
}

TEST_F(Windows, SlicesTogetherAreTheRecording) {
  const WindowPlan plan = plan_recording(work(), lively_recording().pins, {.every = 70'001});
  recording::Stream joined;
  recording::Recorder recorder(joined, lively_recording().pins.header());
  for (std::size_t i = 0; i < plan.windows.size(); ++i) {
    const recording::Stream slice = recording::read_text(stimulus_file(work(), i));
    EXPECT_EQ(slice.first_cycle(), i * 70'001);
    recording::ChangeReader reader(slice);
    recording::Change change;
    for (bool more = reader.next(change); more;) {
      const std::uint64_t cycle = change.cycle;
      for (; more && change.cycle == cycle; more = reader.next(change))
        recorder.set(change.pin, change.value);
      recorder.commit(cycle);
    }
  }
  recorder.finish(plan.cycles - 1);
  EXPECT_EQ(joined, lively_recording().pins);
}

TEST_F(Windows, AreThoseOfThePlanFile) {
  const WindowPlan plan = plan_recording(work(), head_of_recording(3000), {.every = 1000});
  EXPECT_EQ(plan_hash(read_plan(work())), plan_hash(plan));
}

TEST_F(Windows, ARecordingOfAnotherChipIsRefused) {
  recording::Stream wrong;
  wrong.begin(lively_recording().pins.header());
  recording::ChangeReader reader(lively_recording().pins);
  std::uint64_t wrong_at = 0;
  for (recording::Change change; reader.next(change) && change.cycle < 2'500'000;) {
    // One edge of the heater a clock late.
    if (change.pin == kPinHeater && change.cycle > 0 && wrong_at == 0) wrong_at = change.cycle++;
    if (change.cycle != wrong_at || wrong_at == 0) wrong.change(change);
  }
  wrong.end(2'499'999);
  ASSERT_NE(wrong_at, 0u);
  try {
    plan_recording(work(), wrong, {});
    FAIL() << "taken";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("cycle " + std::to_string(wrong_at) + ": heater_o recorded 0, chip 1"));
  }
  EXPECT_FALSE(fs::exists(work()));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

// The last cycle, too: `end` names it.
TEST_F(Windows, AWrongOutputInTheVeryLastCycleIsRefused) {
  recording::Stream wrong = head_of_recording(5000), turned;
  EXPECT_EQ(plan_recording(work(), wrong, {}).cycles, 5000u);
  recording::Recorder recorder(turned, wrong.header());
  recording::Cursor cursor(wrong);
  do {
    for (std::uint32_t pin = 0; pin < kChipPinCount; ++pin) recorder.set(pin, cursor.values()[pin]);
    if (cursor.cycle() == wrong.final_cycle()) recorder.set(kPinSafeEn, cursor.values()[kPinSafeEn] ^ 1);
    recorder.commit(cursor.cycle());
  } while (cursor.step());
  recorder.finish(wrong.final_cycle());
  EXPECT_THAT([&] { plan_recording(folder_ / "turned", turned, {}); },
              ThrowsMessage<UserError>(HasSubstr("cycle 4999: safe_en_o recorded")));
}

TEST_F(Windows, ARecordingOfOneClockIsChecked) {
  const WindowPlan plan = plan_recording(work(), head_of_recording(1), {});
  EXPECT_EQ(plan.cycles, 1u);
  EXPECT_TRUE(check_all(work(), plan).whole);
}

TEST_F(Windows, ARecordingWithoutThePinsIsRefused) {
  recording::Header header = lively_recording().pins.header();
  header.pins[kPinTlmTx].name = "tlm_tx";
  WindowPlanner planner(work(), {"test", 7}, {});
  EXPECT_THROW(planner.begin(header), UserError);
}

TEST_F(Windows, ARecordingOfAScanTestIsRefused) {
  for (const char* pin : {"scan_en_i", "scan_o"}) {
    recording::Header header = lively_recording().pins.header();
    const auto scan = static_cast<std::uint32_t>(header.pins.size());
    const auto direction = pin[5] == 'e' ? recording::Direction::in : recording::Direction::out;
    header.pins.push_back({pin, direction, 1, "chip"});
    recording::Stream stream;
    stream.begin(header);
    recording::ChangeReader reader(lively_recording().pins);
    for (recording::Change change; reader.next(change) && change.cycle == 0;) stream.change(change);
    stream.change({0, scan, 0});
    stream.change({300, scan, 1});
    stream.end(400);
    EXPECT_THAT([&] { plan_recording(work(), stream, {}); },
                ThrowsMessage<UserError>(HasSubstr(std::string("cycle 300: found ") + pin)));
  }
}

TEST_F(Windows, ARecordingThatDoesNotBeginInResetIsRefused) {
  recording::Stream released;
  released.begin(lively_recording().pins.header());
  recording::ChangeReader reader(lively_recording().pins);
  for (recording::Change change; reader.next(change) && change.cycle == 0;) {
    if (change.pin == kPinRstN) change.value = 1;
    released.change(change);
  }
  released.end(10);
  EXPECT_THROW(plan_recording(work(), released, {}), UserError);
}

// The pins of the first cycle, in reset.
void begin_as_recorded(WindowPlanner& planner) {
  planner.begin(lively_recording().pins.header());
  recording::ChangeReader reader(lively_recording().pins);
  for (recording::Change change; reader.next(change) && change.cycle == 0;) planner.change(change);
}

// A recording of one cycle and a long end: whoever listens may stop it anywhere in there.
TEST_F(Windows, ALongEndIsPlannedWithAnEarForInterrupts) {
  struct Stop {};
  for (const WindowBorders& borders : {WindowBorders{1'000'000'000'000}, WindowBorders{1, {3}}}) {
    int told = 0;
    const auto listen = [&](std::string_view, double) {
      if (++told == 5) throw Stop();
    };
    WindowPlanner planner(work(), {"test", 7}, borders, listen);
    begin_as_recorded(planner);
    EXPECT_THROW(planner.end(99'000'000'000'000), Stop);
  }
  EXPECT_FALSE(fs::exists(work()));
}

TEST_F(Windows, TooManyAreRefusedBeforeTheyAreRun) {
  WindowPlanner planner(work(), {"test", 7}, {10'000});
  begin_as_recorded(planner);
  EXPECT_THAT(
      [&] { planner.end(recording::kMaxCycle - 1); },
      ThrowsMessage<UserError>(HasSubstr("windows of 10000 clocks up to cycle 9223372036854775806, expected "
                                         "at most 100000; choose --window-clocks 92233720368548 or more")));
}

TEST_F(Windows, AForeignFolderIsNotReplaced) {
  fs::create_directories(work());
  set_text(work() / "thesis.txt", "x");
  EXPECT_THROW(WindowPlanner(work(), {"test", 7}, {}), UserError);
  EXPECT_TRUE(fs::exists(work() / "thesis.txt"));
}

TEST_F(Windows, ResultsStayForTheSamePlanOnly) {
  const WindowPlan plan = plan_recording(work(), head_of_recording(3000), {.every = 1000});
  write_result(work(), check_window(work(), plan, 1));
  plan_recording(work(), head_of_recording(3000), {.every = 1000});
  EXPECT_THAT(windows_to_run(work(), plan), ElementsAre(0u, 2u));
  const WindowPlan other = plan_recording(work(), head_of_recording(3001), {.every = 1000});
  EXPECT_THAT(windows_to_run(work(), other), ElementsAre(0u, 1u, 2u, 3u));
}

// A wrong flop in a saved state, with all hashes made to fit: the window before must end in another state.
TEST_F(Windows, AFlopThatDiffersIsNamedWithItsWindow) {
  WindowPlan plan = plan_recording(work(), head_of_recording(600'000), {.every = 300'000});
  SavedState state = read_state(state_file(work(), 1));
  state.chip.algor.i_q ^= 4;
  write_state(state_file(work(), 1), state);
  plan.windows[0].end_state = plan.windows[1].start_state = state_hash(state);
  write_plan(work(), plan);
  const JoinedWindows joined = check_all(work(), plan);
  EXPECT_FALSE(joined.whole);
  EXPECT_EQ(joined.windows[0], WindowState::differs);
  EXPECT_THAT(joined.faults, Contains(AllOf(HasSubstr("window 0 differs"), HasSubstr("u_algor.i_q"))));
}

// The same for a flop that acts on a pin: the window after it leaves the recorded pins.
TEST_F(Windows, APinThatDiffersFromTheRecordingIsNamed) {
  WindowPlan plan = plan_recording(work(), head_of_recording(60'000), {.every = 30'000});
  SavedState state = read_state(state_file(work(), 1));
  state.chip.guard.safe_en_q ^= 1;
  write_state(state_file(work(), 1), state);
  plan.windows[0].end_state = plan.windows[1].start_state = state_hash(state);
  write_plan(work(), plan);
  const WindowResult result = check_window(work(), plan, 1);
  EXPECT_FALSE(result.equal);
  EXPECT_THAT(result.report, AllOf(HasSubstr("window 1, cycle 30000"), HasSubstr("safe_en_o")));
}

TEST_F(Windows, AChangedStimulusIsRefused) {
  const WindowPlan plan = plan_recording(work(), head_of_recording(3000), {.every = 1000});
  std::string text = text_of(stimulus_file(work(), 2));
  text[text.size() / 2] ^= 1;
  set_text(stimulus_file(work(), 2), text);
  EXPECT_THROW(check_window(work(), plan, 2), UserError);
  EXPECT_THROW(check_files(work(), plan), UserError);
  EXPECT_NO_THROW(check_window(work(), plan, 1));
}

// ---- Joining: made-up results of a plan of five windows of 100 clocks ----

class Joining : public ::testing::Test {
 protected:
  Joining() {
    plan_.cycles = 500;
    for (std::uint64_t i = 0; i < 5; ++i) {
      plan_.windows.push_back({i * 100, i * 100 + 99, i == 0 ? state_hash({}) : "s" + std::to_string(i),
                               "s" + std::to_string(i + 1), "stimulus" + std::to_string(i)});
    }
    for (std::uint64_t i = 0; i < 5; ++i) {
      const PlannedWindow& w = plan_.windows[i];
      results_.push_back({.file = {},
                          .plan = plan_hash(plan_),
                          .window = i,
                          .first_cycle = w.first_cycle,
                          .last_cycle = w.last_cycle,
                          .start_state = w.start_state,
                          .end_state = w.end_state,
                          .stimulus = w.stimulus,
                          .flop_bits = 7,
                          .compared = {.clocks = 100, .pin_values = 1000, .flop_values = 700},
                          .equal = true,
                          .report = "",
                          .host = "h",
                          .wall_s = 1.0});
    }
  }
  void expect_fault(const std::string& part) const {
    const JoinedWindows joined = join_windows(plan_, results_);
    EXPECT_FALSE(joined.whole);
    EXPECT_THAT(joined.faults, Contains(HasSubstr(part)));
  }
  WindowPlan plan_;
  std::vector<WindowResult> results_;
};

TEST_F(Joining, AChainFromResetToTheEndIsWhole) {
  const JoinedWindows joined = join_windows(plan_, results_);
  EXPECT_TRUE(joined.whole);
  EXPECT_THAT(joined.faults, IsEmpty());
  EXPECT_EQ(joined.equal, 5u);
  EXPECT_EQ(joined.compared.clocks, 500u);
  EXPECT_EQ(joined.compared.flop_values, 3500u);
}

TEST_F(Joining, TheOrderOfResultsDoesNotMatter) {
  std::reverse(results_.begin(), results_.end());
  EXPECT_TRUE(join_windows(plan_, results_).whole);
}

TEST_F(Joining, NoResultsAreNoProof) {
  results_.clear();
  expect_fault("windows 0-4: no result");
  expect_fault("gap at the end: cycles 0 to 499");
}

TEST_F(Joining, AMissingWindowIsNamed) {
  results_.erase(results_.begin() + 2);
  expect_fault("window 2: no result");
  expect_fault("gap before window 3: cycles 200 to 299");
}

TEST_F(Joining, MissingWindowsAreNamedAsRanges) {
  results_.erase(results_.begin() + 1, results_.begin() + 4);
  expect_fault("windows 1-3: no result");
}

TEST_F(Joining, TheFirstAndTheLastMustBeThere) {
  auto all = results_;
  results_.erase(results_.begin());
  expect_fault("gap before window 1: cycles 0 to 99");
  results_ = all;
  results_.pop_back();
  expect_fault("gap at the end: cycles 400 to 499");
}

TEST_F(Joining, ARepeatedWindowIsNamedAndCountedOnce) {
  results_.push_back(results_[3]);
  expect_fault("window 3: more than one result");
  EXPECT_EQ(join_windows(plan_, results_).compared.clocks, 500u);
}

TEST_F(Joining, AnOverlapIsNamed) {
  results_[2].first_cycle -= 1;
  results_[2].compared = {.clocks = 101, .pin_values = 1010, .flop_values = 707};
  expect_fault("window 2 begins at cycle 199, inside the window before it");
}

TEST_F(Joining, ABrokenChainIsNamed) {
  results_[2].start_state = "other";
  expect_fault("window 2 does not start in the state that the window before it ended in");
}

TEST_F(Joining, TheFirstStateMustBeReset) {
  results_[0].start_state = "other";
  expect_fault("window 0 does not start in the state that reset gives");
}

TEST_F(Joining, ADifferingWindowIsNamed) {
  results_[4].equal = false;
  results_[4].report = "MISMATCH\n  flop u_x.y_q\n";
  expect_fault("window 4 differs: MISMATCH\n  flop u_x.y_q");
}

TEST_F(Joining, ResultsOfAnotherPlanAreRefused) {
  results_[1].plan = "other";
  expect_fault("window 1: its result is of another plan");
}

TEST_F(Joining, AnotherStimulusIsRefused) {
  results_[1].stimulus = "other";
  expect_fault("window 1: its result ran on another stimulus");
}

TEST_F(Joining, TooFewComparisonsAreRefused) {
  auto all = results_;
  results_[1].compared.clocks = 99;
  expect_fault("window 1: its result compared 99 clocks of 100");
  results_ = all;
  results_[1].compared.flop_values = 0;
  expect_fault("too few");
  results_ = all;
  results_[1].flop_bits = 3;
  results_[1].compared.flop_values = 300;
  expect_fault("flop bits compared a clock, others");
}

TEST_F(Joining, AWindowBeyondThePlanIsRefused) {
  results_[1].window = 5;
  expect_fault("window 5: its result is not one of the plan's 5");
}

}  // namespace
}  // namespace meltstage::tb
