// SPDX-License-Identifier: Apache-2.0
// MEM: the stored sets, their codes, the scrubbing pass, and the synchroniser cells.
#include "cmodel/mem.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <random>
#include <type_traits>
#include <utility>
#include <vector>

#include "cmodel/math.hpp"
#include "cmodel/sync.hpp"

namespace meltstage::chip {
namespace {

constexpr unsigned kWords = spec::kHoldingCount - 1;
constexpr unsigned kWalk = spec::kMemColumns + 1;  // clocks for a set: its rows, and one to judge
constexpr unsigned kPass = 2 * kWalk;

void write(Mem& mem, unsigned index, std::uint16_t value) {
  mem.step({.wr = true, .wr_index = static_cast<std::uint8_t>(index), .wr_data = value});
}

std::uint16_t data_bits(unsigned index) { return static_cast<std::uint16_t>(spec::kHolding[index].stored); }

// Until the pass in work has ended; returns its clocks.
unsigned finish(Mem& mem) {
  unsigned clocks = 0;
  while (mem.scrub_busy() && clocks < 1000) {
    mem.step({});
    ++clocks;
  }
  return clocks;
}

// A whole pass; returns its clocks.
unsigned scrub(Mem& mem) {
  mem.step({.scrub_start = true});
  return finish(mem);
}

TEST(Secded, CodeWordsDifferInAtLeastFourBits) {
  // The code is linear: its distance is the smallest weight of a word that is not zero.
  int least = 22;
  for (unsigned data = 1; data < 65536; ++data) {
    least = std::min(least, std::popcount(secded_encode(static_cast<std::uint16_t>(data))));
  }
  EXPECT_EQ(least, 4);
  for (unsigned a = 0; a < 65536; a += 257) {
    for (unsigned b = 0; b < 65536; b += 129) {
      ASSERT_EQ(secded_encode(static_cast<std::uint16_t>(a ^ b)),
                secded_encode(static_cast<std::uint16_t>(a)) ^ secded_encode(static_cast<std::uint16_t>(b)));
    }
  }
}

TEST(Secded, EverySingleFlipIsFoundAndNoDoubleFlipTakenForOne) {
  for (unsigned data = 0; data < 65536; ++data) {
    const std::uint32_t code = secded_encode(static_cast<std::uint16_t>(data));
    ASSERT_EQ(secded_flip(code), 0u);
    for (unsigned i = 0; i < 22; ++i) {
      ASSERT_EQ(secded_flip(code ^ 1u << i), 1u << i) << data;
      for (unsigned j = 0; j < i; ++j)
        ASSERT_EQ(secded_flip(code ^ 1u << i ^ 1u << j), 0u) << data << ' ' << i << ' ' << j;
    }
  }
}

// The product code: rows and columns of what differs from the reset values are even.
void expect_even(const std::array<std::uint32_t, spec::kMemRows>& set) {
  const Mem reset;
  std::uint32_t columns = 0;
  for (unsigned i = 1; i < spec::kMemRows; ++i) {
    const std::uint32_t row = set[i] ^ reset.staged_q[i];
    EXPECT_EQ(std::popcount(row) % 2, 0) << i;
    EXPECT_EQ(row & ~mem_stored(i), 0u) << i;
    columns ^= row;
  }
  EXPECT_EQ(columns, 0u);
}

TEST(Mem, ResetHoldsTheResetValuesInBothSets) {
  const Mem mem;
  for (unsigned i = 1; i <= kWords; ++i) {
    EXPECT_EQ(mem.rd_data(i), static_cast<std::uint16_t>(spec::kHolding[i].reset)) << spec::kHolding[i].name;
    EXPECT_EQ(mem.params().value[i], mem.rd_data(i)) << spec::kHolding[i].name;
    EXPECT_EQ(mem.active_q[i], mem_row(spec::kHolding[i].corrected, mem.rd_data(i)));
  }
  EXPECT_EQ(mem.t_max_staged(), 1500);
  EXPECT_FALSE(mem.bad());
}

TEST(Mem, WriteReachesTheStagedSetAlone) {
  for (unsigned i = 1; i <= kWords; ++i) {
    Mem mem;
    const std::uint16_t value = static_cast<std::uint16_t>(mem.rd_data(i) ^ (0xA5C3u & data_bits(i)));
    write(mem, i, value);
    EXPECT_EQ(mem.rd_data(i), value);
    for (unsigned k = 1; k <= kWords; ++k) {
      EXPECT_EQ(mem.params().value[k], static_cast<std::uint16_t>(spec::kHolding[k].reset));
      if (k == i) continue;
      EXPECT_EQ(mem.rd_data(k), static_cast<std::uint16_t>(spec::kHolding[k].reset));
    }
  }
}

TEST(Mem, RowsAndColumnsOfBothSetsAreEven) {
  Mem mem;
  for (unsigned round = 0; round < 3; ++round) {
    for (unsigned i = 1; i <= kWords; ++i) {
      const spec::RegisterInfo& info = spec::kHolding[i];
      write(mem, i, static_cast<std::uint16_t>(round == 0 ? info.max : round == 1 ? info.min : info.reset));
      expect_even(mem.staged_q);
    }
    if (round == 1) mem.step({.commit = true});
    expect_even(mem.active_q);
  }
  EXPECT_EQ(mem.staged_q, Mem().staged_q);
  EXPECT_NE(mem.active_q, Mem().active_q);
  scrub(mem);
  EXPECT_FALSE(mem.bad());
  EXPECT_EQ(mem.corrected(), 0);
}

TEST(Mem, PresetIsAWordOfBothSets) {
  Mem mem;
  write(mem, spec::kRegFormat, 3);
  mem.preset(spec::kRegTs, 10);
  EXPECT_EQ(mem.rd_data(spec::kRegTs), 10);
  EXPECT_EQ(mem.params()[spec::kRegTs], 10);
  EXPECT_EQ(mem.params()[spec::kRegFormat], 0);
  expect_even(mem.staged_q);
  expect_even(mem.active_q);
}

TEST(Mem, CmdAndIndicesBeyondTheMapAreNotStored) {
  Mem mem;
  const auto staged = mem.staged_q;
  for (const unsigned i : {0u, spec::kMemColumns, 62u, 63u}) {
    write(mem, i, 0xFFFF);
    EXPECT_EQ(mem.rd_data(i), 0);
  }
  EXPECT_EQ(mem.staged_q, staged);
}

TEST(Mem, AWordHasTheBitsThatDifferWithinItsRange) {
  unsigned bits = 0;
  for (unsigned i = 1; i <= kWords; ++i) {
    const spec::RegisterInfo& r = spec::kHolding[i];
    const std::uint32_t reset = mem_row(r.corrected, static_cast<std::uint16_t>(r.reset));
    std::uint32_t differ = 0;
    for (std::int32_t value = r.min; value <= r.max; ++value)
      differ |= reset ^ mem_row(r.corrected, static_cast<std::uint16_t>(value));
    EXPECT_EQ(r.stored, differ) << r.name;
    bits += static_cast<unsigned>(std::popcount(r.stored));
    Mem mem;
    write(mem, i, 0xFFFF);
    EXPECT_EQ((mem.staged_q[i] ^ reset) & ~r.stored, 0u) << r.name;
  }
  EXPECT_LT(bits, kWords * 22);
  EXPECT_EQ(spec::kHolding[0].stored, 0u);
  for (unsigned i = 1; i <= kWords; ++i) EXPECT_EQ(mem_stored(i) & ~mem_stored(spec::kMemColumns), 0u);
}

TEST(Mem, CommitTakesAllWritesAtOnce) {
  Mem mem;
  write(mem, spec::kRegSetpoint, 1100);
  write(mem, spec::kRegFormat, 3);
  EXPECT_EQ(mem.params()[spec::kRegSetpoint], 0);
  mem.step({.commit = true});
  EXPECT_EQ(mem.params()[spec::kRegSetpoint], 1100);
  EXPECT_EQ(mem.params()[spec::kRegFormat], 3);
}

TEST(Mem, DiscardBringsTheActiveSetBack) {
  Mem mem;
  write(mem, spec::kRegSetpoint, 1100);
  mem.step({.commit = true});
  write(mem, spec::kRegSetpoint, 2000);
  mem.step({.discard = true});
  EXPECT_TRUE(mem.discarding());
  EXPECT_EQ(finish(mem), kPass);
  EXPECT_FALSE(mem.discarding());
  EXPECT_EQ(mem.rd_data(spec::kRegSetpoint), 1100);
  EXPECT_EQ(mem.params()[spec::kRegSetpoint], 1100);
}

TEST(Mem, DiscardTakesEveryWordBackAndCorrectsIt) {
  const Mem reset;
  for (unsigned i = 1; i <= kWords; ++i) {
    if (spec::kHolding[i].stored == 0) continue;
    Mem mem;
    write(mem, i, static_cast<std::uint16_t>(~mem.rd_data(i)));
    mem.active_q[i] ^= std::bit_floor(spec::kHolding[i].stored);
    mem.refresh_params();
    mem.step({.discard = true});
    finish(mem);
    ASSERT_EQ(mem.staged_q, reset.staged_q) << i;
    ASSERT_EQ(mem.active_q, reset.active_q) << i;
    ASSERT_EQ(mem.params().value, reset.params().value) << i;
    ASSERT_EQ(mem.corrected(), 1);
    ASSERT_FALSE(mem.bad());
  }
}

TEST(Mem, DiscardMendsAStagedWordWithoutBad) {
  Mem mem;
  const Mem before = mem;
  mem.staged_q[spec::kRegSetpoint] ^= 6;
  mem.step({.discard = true});
  while (mem.discarding()) {
    mem.step({});
    ASSERT_FALSE(mem.bad());
  }
  EXPECT_EQ(mem.staged_q, before.staged_q);
}

TEST(Mem, DiscardBeginsThePassAnew) {
  Mem mem;
  write(mem, 1, 7);
  mem.step({.scrub_start = true});
  for (unsigned k = 0; k < 10; ++k) mem.step({});
  mem.step({.discard = true});
  EXPECT_EQ(finish(mem), kPass);
  EXPECT_EQ(mem.rd_data(1), 0);
  write(mem, 1, 7);
  scrub(mem);
  EXPECT_EQ(mem.rd_data(1), 7) << "the next pass only corrects";
}

TEST(Mem, TakesNoWriteTogetherWithACommit) {
  Mem mem;
  write(mem, spec::kRegSetpoint, 800);
  mem.step({.wr = true, .wr_index = spec::kRegSetpoint, .wr_data = 900, .commit = true});
  EXPECT_EQ(mem.params()[spec::kRegSetpoint], 800);
  EXPECT_EQ(mem.rd_data(spec::kRegSetpoint), 800);
  expect_even(mem.staged_q);
}

TEST(Mem, CommitWinsOverDiscard) {
  Mem mem;
  write(mem, spec::kRegSetpoint, 900);
  mem.step({.commit = true, .discard = true});
  EXPECT_EQ(mem.params()[spec::kRegSetpoint], 900);
  finish(mem);
  EXPECT_EQ(mem.params()[spec::kRegSetpoint], 900);
  EXPECT_EQ(mem.rd_data(spec::kRegSetpoint), 900);
}

TEST(Mem, PassTakesAClockForEachRowOfBothSetsAndOneToJudgeAndChangesNothing) {
  Mem mem;
  const Mem before = mem;
  EXPECT_EQ(scrub(mem), kPass);
  EXPECT_EQ(mem.staged_q, before.staged_q);
  EXPECT_EQ(mem.active_q, before.active_q);
  EXPECT_EQ(mem.corrected(), 0);
  EXPECT_FALSE(mem.bad());
}

// Words of any value, so that no flip is found by what stands beside it.
Mem written(unsigned seed) {
  Mem mem;
  std::mt19937 random(seed);
  for (unsigned i = 1; i <= kWords; ++i) {
    const spec::RegisterInfo& info = spec::kHolding[i];
    write(mem, i, static_cast<std::uint16_t>(std::uniform_int_distribution(info.min, info.max)(random)));
    if (i == kWords / 2) mem.step({.commit = true});
  }
  return mem;
}

struct Place {
  unsigned row;
  std::uint32_t bit;
};
std::vector<Place> all_places() {
  std::vector<Place> places;
  for (unsigned row = 1; row < spec::kMemRows; ++row)
    for (std::uint32_t bit = 1; bit < 1U << 22; bit <<= 1)
      if ((mem_stored(row) & bit) != 0) places.push_back({row, bit});
  return places;
}

TEST(Mem, PassCorrectsEverySingleFlipOfBothSets) {
  const Mem before = written(1);
  const std::vector<Place> places = all_places();
  for (std::size_t k = 0; k < places.size(); ++k) {
    Mem mem = before;
    const Place other = places[(k + 500) % places.size()];
    mem.staged_q[places[k].row] ^= places[k].bit;
    mem.active_q[other.row] ^= other.bit;
    mem.refresh_params();
    EXPECT_EQ(scrub(mem), kPass);
    ASSERT_EQ(mem.staged_q, before.staged_q);
    ASSERT_EQ(mem.active_q, before.active_q);
    ASSERT_EQ(mem.params().value, before.params().value);
    ASSERT_EQ(mem.corrected(), 2);
    ASSERT_FALSE(mem.bad());
  }
}

TEST(Mem, EveryDoubleFlipIsBadAndNoneTakenForASingleOne) {
  const Mem before = written(2);
  const std::vector<Place> places = all_places();
  std::mt19937 random(3);
  std::uniform_int_distribution<std::size_t> any(0, places.size() - 1);
  std::vector<std::pair<Place, Place>> pairs;
  for (const Place a : places) {
    for (const Place b : places)
      if (a.row == b.row && a.bit < b.bit) pairs.emplace_back(a, b);  // a row: its parity says nothing
    for (unsigned k = 0; k < 20; ++k) {
      const Place b = places[any(random)];
      if (b.row != a.row) pairs.emplace_back(a, b);
    }
    pairs.emplace_back(a, Place{a.row == spec::kMemColumns ? unsigned{spec::kRegTs} : spec::kMemColumns,
                                a.bit});  // a column
    if ((mem_stored(pairs.back().second.row) & a.bit) == 0) pairs.pop_back();
  }
  ASSERT_GT(pairs.size(), 20'000u);
  for (const auto& [a, b] : pairs) {
    Mem mem = before;
    mem.staged_q[a.row] ^= a.bit;
    mem.staged_q[b.row] ^= b.bit;
    const Mem struck = mem;
    EXPECT_EQ(scrub(mem), kPass + kWalk);
    ASSERT_TRUE(mem.bad()) << a.row << ' ' << a.bit << ' ' << b.row << ' ' << b.bit;
    ASSERT_EQ(mem.staged_q, struck.staged_q);
    ASSERT_EQ(mem.corrected(), 0);
  }
}

TEST(Mem, TwoFlipsAreBadAtTheEndOfTheSecondWalkAndUntilAPassFindsNone) {
  for (const unsigned i : {1u, 30u, kWords}) {
    Mem mem;
    mem.active_q[i] ^= 0x21 & mem_stored(i) ? 0x21 : 0x3;
    mem.refresh_params();
    mem.step({.scrub_start = true});
    for (unsigned k = 1; k < 2 * kWalk; ++k) mem.step({});
    EXPECT_FALSE(mem.bad());
    mem.step({});
    EXPECT_TRUE(mem.bad()) << "word " << i;
    finish(mem);
    EXPECT_TRUE(mem.bad());
    mem.step({.commit = true});  // a sound staged set repairs the active one
    EXPECT_TRUE(mem.bad());
    scrub(mem);
    EXPECT_FALSE(mem.bad());
  }
}

// Beyond what the code promises, but no reason to change a third word.
TEST(Mem, ThreeFlipsOfAColumnAreBadAndNotTakenForOne) {
  for (std::uint32_t bit = 1; bit <= mem_stored(spec::kMemColumns); bit <<= 1) {
    Mem mem;
    unsigned flips = 0;
    for (unsigned row = spec::kMemColumns; row >= 1 && flips < 3; --row) {
      if ((mem_stored(row) & bit) == 0) continue;
      mem.active_q[row] ^= bit;
      ++flips;
    }
    if (flips < 3) continue;
    const auto struck = mem.active_q;
    scrub(mem);
    EXPECT_TRUE(mem.bad()) << bit;
    EXPECT_EQ(mem.active_q, struck) << bit;
  }
}

TEST(Mem, DiscardRepairsTheStagedSet) {
  Mem mem;
  mem.staged_q[kWords] ^= 0x3;
  scrub(mem);
  EXPECT_TRUE(mem.bad());
  mem.step({.discard = true});
  finish(mem);
  EXPECT_FALSE(mem.bad());
  EXPECT_EQ(mem.staged_q, Mem().staged_q);
}

// A write over a flip leaves it in the columns alone; over two of them a pass finds what the write has
// hidden.
TEST(Mem, WriteOverAFlipIsCorrectedInTheColumns) {
  Mem mem;
  mem.staged_q[spec::kRegSetpoint] ^= 4;
  write(mem, spec::kRegSetpoint, 900);
  EXPECT_EQ(mem.rd_data(spec::kRegSetpoint), 900);
  scrub(mem);
  EXPECT_EQ(mem.rd_data(spec::kRegSetpoint), 900);
  EXPECT_EQ(mem.corrected(), 1);
  expect_even(mem.staged_q);
  mem.staged_q[spec::kRegSetpoint] ^= 6;
  write(mem, spec::kRegSetpoint, 901);
  scrub(mem);
  EXPECT_TRUE(mem.bad());
}

// A flip of what the pass itself keeps: the walk is done once more, and nothing is changed or called bad.
TEST(Mem, FlipOfTheWalkChangesNothing) {
  const Mem before = written(4);
  for (const unsigned at : {0u, 1u, 30u, kWalk - 2, kWalk - 1, kWalk, kPass - 2, kPass - 1}) {
    const auto strike = [&](auto&& flip) {
      Mem mem = before;
      mem.step({.scrub_start = true});
      for (unsigned k = 0; k < at; ++k) mem.step({});
      flip(mem);
      finish(mem);
      EXPECT_FALSE(mem.scrub_busy());
      EXPECT_FALSE(mem.bad()) << at;
      EXPECT_EQ(mem.staged_q, before.staged_q) << at;
      EXPECT_EQ(mem.active_q, before.active_q) << at;
    };
    for (unsigned bit = 0; bit < 22; ++bit) strike([&](Mem& mem) { mem.syndrome_q ^= 1U << bit; });
    for (unsigned bit = 0; bit < 6; ++bit) {
      strike([&](Mem& mem) { mem.scrub_index_q ^= static_cast<std::uint8_t>(1U << bit); });
      strike([&](Mem& mem) { mem.odd_row_q ^= static_cast<std::uint8_t>(1U << bit); });
    }
    strike([](Mem& mem) { mem.odd_rows_q ^= 1; });
    strike([](Mem& mem) { mem.scrub_staged_q ^= 1; });
    strike([](Mem& mem) { mem.scrub_busy_q ^= 1; });
  }
}

TEST(Mem, StartWhileBusyIsIgnored) {
  Mem mem;
  mem.step({.scrub_start = true});
  for (unsigned k = 0; k < 10; ++k) mem.step({});
  mem.step({.scrub_start = true});
  EXPECT_EQ(finish(mem), kPass - 11);
}

TEST(Mem, PassBeginsAnewWithAWriteOrCommit) {
  for (const bool commit : {false, true}) {
    for (const unsigned at : {0u, 1u, 20u, kWalk, kWalk + 20, kPass - 1}) {
      Mem mem;
      mem.staged_q[1] ^= 1;
      mem.active_q[1] ^= 2;
      mem.refresh_params();
      mem.step({.scrub_start = true});
      for (unsigned k = 0; k < at; ++k) mem.step({});
      mem.step({.wr = !commit, .wr_index = 5, .wr_data = 77, .commit = commit});
      EXPECT_EQ(finish(mem), kPass);
      EXPECT_EQ(mem.rd_data(1), 0);
      EXPECT_EQ(mem.params().value[1], 0);
      EXPECT_FALSE(mem.bad());
      expect_even(mem.staged_q);
      expect_even(mem.active_q);
    }
  }
}

TEST(Mem, PassWaitsForAReadAndLosesNoCorrection) {
  Mem mem;
  mem.active_q[1] ^= 1;
  mem.step({.scrub_start = true});
  for (unsigned k = 0; k < 5; ++k) mem.step({.rd = true});
  EXPECT_EQ(mem.corrected(), 0);
  EXPECT_EQ(finish(mem), kPass);
  EXPECT_EQ(mem.corrected(), 1);
}

TEST(Mem, CorrectedCountWraps) {
  Mem mem;
  mem.corrected_q = 0xFFFF;
  mem.active_q[5] ^= 4;
  scrub(mem);
  EXPECT_EQ(mem.corrected(), 0);
}

TEST(Mem, CopyRestoresTheWholeState) {
  static_assert(std::is_trivially_copyable_v<Mem>);
  Mem mem;
  write(mem, spec::kRegSetpoint, 1234);
  const Mem saved = mem;
  mem.step({.commit = true});
  mem = saved;
  EXPECT_EQ(mem.rd_data(spec::kRegSetpoint), 1234);
  EXPECT_EQ(mem.params()[spec::kRegSetpoint], 0);
}

TEST(Sync, ShowsThePinsTwoClocksLater) {
  Sync sync;
  EXPECT_EQ(sync.q(), 0b1) << "the serial line idles high";
  sync.step(0b1010101);
  EXPECT_EQ(sync.q(), 0b1);
  sync.step(0b0101010);
  EXPECT_EQ(sync.q(), 0b1010101);
  sync.step(0);
  EXPECT_EQ(sync.q(), 0b0101010);
}

TEST(RstSync, AssertsAtOnceAndReleasesAtTheSecondEdge) {
  RstSync rst;
  EXPECT_FALSE(rst.rst_n());
  rst.step();
  EXPECT_FALSE(rst.rst_n());
  rst.step();
  EXPECT_TRUE(rst.rst_n());
  rst.assert_reset();
  EXPECT_FALSE(rst.rst_n());
  rst.step();
  EXPECT_FALSE(rst.rst_n());
}

}  // namespace
}  // namespace meltstage::chip
