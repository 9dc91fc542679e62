// SPDX-License-Identifier: Apache-2.0
// advance() against step(): every flop at every stop and every pin change in between are equal.
#include "cmodel/advance.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tb/regress/suites.hpp"
#include "tb/stimulus/random_run.hpp"
#include "tb/trials/upset.hpp"
#include "twins.hpp"

namespace meltstage::tb {
namespace {

std::vector<std::uint64_t> seeds(unsigned count) {
  std::vector<std::uint64_t> list;
  std::ifstream file(MELTSTAGE_SOURCE_DIR "/tests/seeds/advance.txt");  // seeds that once failed
  for (std::uint64_t seed; file >> seed;) list.push_back(seed);
  for (std::uint64_t seed = 1; seed <= count; ++seed) list.push_back(seed);
  return list;
}

TEST(Advance, TwinsStayEqualWhateverHappens) {
  TwinCount all;
  for (const std::uint64_t seed : seeds(6)) {
    const TwinCount run = run_twins(seed, 14'000'000);
    all.clocks += run.clocks;
    all.stops += run.stops;
    all.pin_changes += run.pin_changes;
    all.looks += run.looks;
  }
  EXPECT_GE(all.clocks, 84'000'000u);  // and the runs below: 10^8
  EXPECT_GT(all.stops, 500u);
  EXPECT_GT(all.pin_changes, 100'000u);
  EXPECT_LT(all.looks, all.clocks / 10) << "nothing to speak of was skipped";
}

// A bench's device: the model stepped on every clock; the stretches between changes of the input pins are
// advanced on a twin.
class BesideAdvance final : public Device {
 public:
  explicit BesideAdvance(const chip::Chip& start) : stepped_(start) { twin_.chip = start; }

  chip::Outputs step(const chip::Inputs& in) override {
    if (!(in == in_)) catch_up();
    if (waiting_ == 0) {
      in_ = in;
      twin_.out = stepped_.outputs(in);  // as the caller saw it
      before_ = twin_.out;
    }
    ++waiting_;
    const chip::Outputs out = stepped_.step(in);
    if (!(out == before_)) changes_.emplace_back(twin_.cycle + waiting_, out);
    before_ = out;
    return out;
  }
  const chip::Chip& model() const override { return stepped_; }
  void restart(const chip::Chip& state, const chip::Inputs&) override {
    catch_up();
    stepped_ = state;
    twin_.chip = state;
  }
  Compared finish() override {
    catch_up();
    return {.clocks = twin_.cycle};
  }

 private:
  struct Constant {
    chip::Inputs in;
    chip::Inputs step(std::uint64_t, const chip::Outputs&) const { return in; }
    std::uint64_t next_event() const { return chip::kForever; }
  };

  void catch_up() {
    if (waiting_ == 0) return;
    std::vector<std::pair<std::uint64_t, chip::Outputs>> seen;
    chip::Outputs last = twin_.out;
    const auto see = [&](std::uint64_t cycle, const chip::Outputs& out) {
      if (!(out == last)) seen.emplace_back(cycle, out);
      last = out;
    };
    Constant around{in_};
    chip::advance(
        twin_, twin_.cycle + waiting_, around,
        [&](std::uint64_t cycle, const chip::Inputs&, const chip::Outputs& out) { see(cycle, out); });
    see(twin_.cycle, twin_.out);
    waiting_ = 0;
    EXPECT_TRUE(seen == changes_) << "pin changes before cycle " << twin_.cycle;
    const std::string flops = different_flops(stepped_, twin_.chip);
    if (!flops.empty()) throw TwinsDiffer("cycle " + std::to_string(twin_.cycle) + "\n" + flops);
    changes_.clear();
  }

  chip::Chip stepped_;
  chip::Run twin_;
  chip::Inputs in_;
  chip::Outputs before_{};
  std::uint64_t waiting_ = 0;  // clocks that the twin is behind
  std::vector<std::pair<std::uint64_t, chip::Outputs>> changes_;
};

// The random runs of suite pr: every state, fault, function code and exception.
TEST(Advance, EqualsStepInTheRandomRunsOfTheLockstepSuite) {
  Coverage all;
  std::uint64_t clocks = 0;
  const std::vector<Suite> suites = standard_suites();
  for (const RegressRun& planned : find_suite(suites, "pr").runs) {
    if (planned.test != "random") continue;
    const RandomRun run =
        random_run(std::make_unique<BesideAdvance>(random_start(planned.seed)), planned.seed, planned.amount);
    all.add(run.coverage);
    clocks += run.compared.clocks;
  }
  EXPECT_GE(clocks, 18'900'000u);
  EXPECT_THAT(all.holes(), testing::IsEmpty());
}

TEST(Advance, OneFlopMoreOrLessIsSeen) {
  chip::Chip a;
  chip::Chip b;
  EXPECT_EQ(different_flops(a, b), "");
  for (std::size_t bit = 0; bit < flop_bits().size(); ++bit) {
    invert_flop_bit(b, bit);
    EXPECT_NE(different_flops(a, b), "") << bit;
    invert_flop_bit(b, bit);
  }
  EXPECT_EQ(different_flops(a, b), "");
}

TEST(Advance, AnIdleChipIsQuietForAsLongAsNothingHappens) {
  struct Silence {
    chip::Inputs step(std::uint64_t, const chip::Outputs&) const { return {}; }
    std::uint64_t next_event() const { return chip::kForever; }
  } silence;
  chip::Run run;
  std::uint64_t looks = 0;
  constexpr std::uint64_t kHour = 3600 * std::uint64_t{chip::spec::kClkHz};
  chip::advance(run, kHour, silence, [&](auto...) { ++looks; });
  EXPECT_EQ(run.cycle, kHour);
  EXPECT_LT(looks, 3600 * 50u);  // ten tenths of a second, each a few clocks of work
}

}  // namespace
}  // namespace meltstage::tb
