// SPDX-License-Identifier: Apache-2.0
// Saved states: exact, whole, and refused when they are not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "cmodel/chip.hpp"
#include "recording.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/windows/window_state.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;
namespace spec = chip::spec;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// The model at a cycle of the recording.
SavedState state_at(std::uint64_t cycle) {
  SavedState state;
  recording::Cursor cursor(lively_recording().pins);
  for (; state.cycle < cycle; ++state.cycle) {
    cursor.advance_to(state.cycle);
    state.before = inputs_of(cursor.values());
    state.chip.step(state.before);
  }
  return state;
}

// Flops whose model values differ, signs included.
unsigned unequal_members(const chip::Chip& a, const chip::Chip& b) {
  unsigned count = 0;
#define TC_FLOP(type, name, width, reset) count += a.TC_MEMBER.name != b.TC_MEMBER.name;
#define TC_ARRAY(type, name, number, width) count += a.TC_MEMBER.name != b.TC_MEMBER.name;
#include "cmodel/for_each_flop.inc"
  return count;
}

class State : public ::testing::Test {
 protected:
  fs::path path() const { return folder_ / "s.state"; }
  void expect_refused(const std::string& part) const {
    try {
      read_state(path());
      FAIL() << "taken";
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr(path().string()), HasSubstr(part), Not(HasSubstr("\n"))));
    }
  }
  TemporaryFolder folder_;
};

TEST_F(State, EveryFlopComesBack) {
  for (const std::uint64_t cycle :
       {0u, 1u, 19u, 22u, 600'000u, 2'450'001u, 2'590'100u, 2'784'310u, 2'800'000u}) {
    const SavedState saved = state_at(cycle);
    write_state(path(), saved);
    const SavedState read = read_state(path());
    EXPECT_EQ(read.cycle, saved.cycle);
    EXPECT_EQ(read.before, saved.before);
    EXPECT_EQ(unequal_members(read.chip, saved.chip), 0u) << "cycle " << cycle;
    EXPECT_EQ(state_hash(read), state_hash(saved));
  }
}

TEST_F(State, ExtremeNumbersComeBack) {
  SavedState saved = state_at(2'500'000);
  saved.chip.algor.e_q = -32768;
  saved.chip.algor.filt_q = -1;
  saved.chip.algor.work_q = INT32_MIN;
  saved.chip.algor.pd_q = -(std::int64_t{1} << 33);
  saved.chip.algor.i_q = UINT32_MAX;
  write_state(path(), saved);
  EXPECT_EQ(unequal_members(read_state(path()).chip, saved.chip), 0u);
}

// What is no flop (the parameters beside MEM) must be there again too: the run goes on alike.
TEST_F(State, TheRunGoesOnAlike) {
  SavedState saved = state_at(2'500'000);
  write_state(path(), saved);
  SavedState read = read_state(path());
  recording::Cursor cursor(lively_recording().pins);
  for (std::uint64_t cycle = saved.cycle; cycle <= lively_recording().pins.final_cycle(); ++cycle) {
    cursor.advance_to(cycle);
    const chip::Inputs in = inputs_of(cursor.values());
    ASSERT_EQ(read.chip.step(in), saved.chip.step(in)) << "cycle " << cycle;
  }
  EXPECT_EQ(unequal_members(read.chip, saved.chip), 0u);
  EXPECT_EQ(unequal_members(read.chip, lively_recording().end), 0u);
}

TEST_F(State, TheHashSeesEveryFlop) {
  const SavedState saved = state_at(2'500'000);
  const std::string hash = state_hash(saved);
  unsigned flops = 0;
  const auto expect_seen = [&](auto flip) {
    SavedState other = saved;
    flip(other.chip);
    EXPECT_NE(state_hash(other), hash) << "flop " << flops;
    EXPECT_EQ(flop_differences(other.chip, saved.chip).size(), 1u) << "flop " << flops;
    ++flops;
  };
#define TC_FLOP(type, name, width, reset) \
  expect_seen([](chip::Chip& c) { c.TC_MEMBER.name = static_cast<type>(c.TC_MEMBER.name ^ 1); });
#define TC_ARRAY(type, name, count, width) \
  for (std::size_t i = 1; i < count; ++i)  \
    expect_seen([&](chip::Chip& c) { c.TC_MEMBER.name[i] = static_cast<type>(c.TC_MEMBER.name[i] ^ 1); });
#include "cmodel/for_each_flop.inc"
  EXPECT_GT(flops, 200u);
}

TEST_F(State, TheHashSeesCycleAndPins) {
  const SavedState saved = state_at(2'500'000);
  SavedState later = saved;
  ++later.cycle;
  SavedState in_reset = saved;
  in_reset.before.rst_n = !in_reset.before.rst_n;
  EXPECT_NE(state_hash(later), state_hash(saved));
  EXPECT_NE(state_hash(in_reset), state_hash(saved));
}

TEST_F(State, EveryDamagedByteIsRefused) {
  write_state(path(), state_at(2'500'000));
  const std::string good = text_of(path());
  for (std::size_t at = 0; at < good.size(); at += 97) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 1);
    set_text(path(), bad);
    EXPECT_THROW(read_state(path()), UserError) << "byte " << at;
  }
}

TEST_F(State, TruncatedEmptyOrMissingIsRefused) {
  write_state(path(), state_at(2'500'000));
  const std::string good = text_of(path());
  set_text(path(), good.substr(0, good.size() / 2));
  expect_refused("truncated");
  set_text(path(), "");
  expect_refused("truncated");
  set_text(path(), good.substr(0, good.size() - 20));
  expect_refused("damaged");
  fs::remove(path());
  expect_refused("no such file");
}

TEST_F(State, AnotherBuildIsNamed) {
  write_state(path(), state_at(2'500'000));
  std::string text = text_of(path());
  text.replace(text.find("build ") + 6, 4, "beef");
  set_text(path(), sealed_state(text));
  expect_refused("another build");
}

TEST_F(State, AnotherSpecIsNamed) {
  write_state(path(), state_at(2'500'000));
  std::string text = text_of(path());
  text.replace(text.find("crc 0x") + 6, 4, "0000");
  set_text(path(), sealed_state(text));
  expect_refused("another spec");
}

TEST_F(State, AForeignFlopIsNamedWithItsLine) {
  write_state(path(), state_at(2'500'000));
  std::string text = text_of(path());
  text.replace(text.find("u_algor.i_q"), 11, "u_algor.j_q");
  set_text(path(), sealed_state(text));
  expect_refused("expected \"flop u_algor.i_q ...\"");
}

TEST_F(State, ANumberTooWideForItsFlopIsRefused) {
  write_state(path(), state_at(2'500'000));
  std::string text = text_of(path());
  const std::size_t at = text.find("flop u_rst_sync.out_q ") + 22;
  text.replace(at, 1, "3");
  set_text(path(), sealed_state(text));
  expect_refused("a number of 1 bits");
}

}  // namespace
}  // namespace meltstage::tb
