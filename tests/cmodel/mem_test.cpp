// SPDX-License-Identifier: Apache-2.0
// MEM: the stored sets, their SECDED code, the scrubbing pass, and the synchroniser cells.
#include "cmodel/mem.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <type_traits>

#include "cmodel/math.hpp"
#include "cmodel/sync.hpp"

namespace meltstage::chip {
namespace {

constexpr unsigned kWords = spec::kHoldingCount - 1;
constexpr unsigned kPass = 2 * kWords;  // clocks

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

TEST(Secded, EverySingleFlipIsFoundAndEveryDoubleFlipIsBad) {
  for (unsigned data = 0; data < 65536; ++data) {
    const std::uint32_t code = secded_encode(static_cast<std::uint16_t>(data));
    ASSERT_EQ(secded_flip(code), 0u);
    ASSERT_FALSE(secded_bad(code));
    for (unsigned i = 0; i < 22; ++i) {
      ASSERT_EQ(secded_flip(code ^ 1u << i), 1u << i) << data;
      ASSERT_FALSE(secded_bad(code ^ 1u << i)) << data;
      for (unsigned j = 0; j < i; ++j) {
        const std::uint32_t twice = code ^ 1u << i ^ 1u << j;
        ASSERT_TRUE(secded_bad(twice) && secded_flip(twice) == 0) << data << ' ' << i << ' ' << j;
      }
    }
  }
}

TEST(Mem, ResetHoldsTheResetValuesInBothSets) {
  const Mem mem;
  for (unsigned i = 1; i <= kWords; ++i) {
    EXPECT_EQ(mem.rd_data(i), static_cast<std::uint16_t>(spec::kHolding[i].reset)) << spec::kHolding[i].name;
    EXPECT_EQ(mem.params().value[i], mem.rd_data(i)) << spec::kHolding[i].name;
    EXPECT_EQ(mem.active_q[i], secded_encode(mem.rd_data(i)));
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

TEST(Mem, CmdAndIndicesBeyondTheMapAreNotStored) {
  Mem mem;
  const auto staged = mem.staged_q;
  for (const unsigned i : {0u, kWords + 1, 63u}) {
    write(mem, i, 0xFFFF);
    EXPECT_EQ(mem.rd_data(i), 0);
  }
  EXPECT_EQ(mem.staged_q, staged);
}

TEST(Mem, AWordHasTheBitsThatDifferWithinItsRange) {
  unsigned bits = 0;
  for (unsigned i = 1; i <= kWords; ++i) {
    const spec::RegisterInfo& r = spec::kHolding[i];
    const std::uint32_t reset = secded_encode(static_cast<std::uint16_t>(r.reset));
    std::uint32_t differ = 0;
    for (std::int32_t value = r.min; value <= r.max; ++value)
      differ |= reset ^ secded_encode(static_cast<std::uint16_t>(value));
    EXPECT_EQ(r.stored, differ) << r.name;
    bits += static_cast<unsigned>(std::popcount(r.stored));
    Mem mem;
    write(mem, i, 0xFFFF);
    EXPECT_EQ((mem.staged_q[i] ^ reset) & ~r.stored, 0u) << r.name;
  }
  EXPECT_LT(bits, kWords * 22);
  EXPECT_EQ(spec::kHolding[0].stored, 0u);
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
    ASSERT_EQ(mem.corrected(), 1);
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

TEST(Mem, WriteTogetherWithCommitIsStagedForTheNext) {
  Mem mem;
  mem.step({.wr = true, .wr_index = spec::kRegSetpoint, .wr_data = 900, .commit = true});
  EXPECT_EQ(mem.params()[spec::kRegSetpoint], 0);
  EXPECT_EQ(mem.rd_data(spec::kRegSetpoint), 900);
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

TEST(Mem, PassTakesAClockForEachWordOfBothSetsAndChangesNoCleanWord) {
  Mem mem;
  const Mem before = mem;
  EXPECT_EQ(scrub(mem), kPass);
  EXPECT_EQ(mem.staged_q, before.staged_q);
  EXPECT_EQ(mem.active_q, before.active_q);
  EXPECT_EQ(mem.corrected(), 0);
  EXPECT_FALSE(mem.bad());
}

TEST(Mem, PassCorrectsEverySingleFlipOfBothSets) {
  for (unsigned i = 1; i <= kWords; ++i) {
    for (unsigned bit = 0; bit < 22; ++bit) {
      if ((spec::kHolding[i].stored >> bit & 1) == 0) continue;
      Mem mem;
      const Mem before = mem;
      mem.staged_q[i] ^= 1u << bit;
      mem.active_q[i] ^= std::bit_floor(spec::kHolding[i].stored & ~(1u << bit));
      mem.refresh_params();
      scrub(mem);
      ASSERT_EQ(mem.staged_q, before.staged_q);
      ASSERT_EQ(mem.active_q, before.active_q);
      ASSERT_EQ(mem.params().value, before.params().value);
      ASSERT_EQ(mem.corrected(), 2);
      ASSERT_FALSE(mem.bad());
    }
  }
}

TEST(Mem, DoubleFlipIsBadAtOnceAndUntilAPassFindsNone) {
  for (const unsigned i : {1u, 30u, kWords}) {
    Mem mem;
    mem.active_q[i] ^= 0x21;
    mem.step({.scrub_start = true});
    for (unsigned k = 1; k < 2 * i; ++k) mem.step({});
    EXPECT_FALSE(mem.bad());
    mem.step({});
    EXPECT_TRUE(mem.bad()) << "word " << i;
    while (mem.scrub_busy()) mem.step({});
    EXPECT_TRUE(mem.bad());
    mem.step({.commit = true});  // a sound staged set repairs the active one
    EXPECT_TRUE(mem.bad());
    scrub(mem);
    EXPECT_FALSE(mem.bad());
  }
}

TEST(Mem, DoubleFlipInTheStagedSetIsBadToo) {
  Mem mem;
  mem.staged_q[kWords] ^= 0x300000;
  scrub(mem);
  EXPECT_TRUE(mem.bad());
  EXPECT_EQ(mem.corrected(), 0);
}

TEST(Mem, StartWhileBusyIsIgnored) {
  Mem mem;
  mem.step({.scrub_start = true});
  for (unsigned k = 0; k < 10; ++k) mem.step({});
  mem.step({.scrub_start = true});
  EXPECT_EQ(finish(mem), kPass - 11);
}

TEST(Mem, PassWaitsForAChangeAndLosesNoCorrection) {
  Mem mem;
  mem.staged_q[1] ^= 1;
  mem.active_q[1] ^= 2;
  mem.refresh_params();
  mem.step({.scrub_start = true});
  mem.step({.wr = true, .wr_index = 1, .wr_data = 77});  // in the clock in which the pass stands on word 1
  EXPECT_EQ(mem.rd_data(1), 77);
  EXPECT_EQ(mem.corrected(), 0);
  EXPECT_EQ(finish(mem), kPass);
  EXPECT_EQ(mem.rd_data(1), 77);
  EXPECT_EQ(mem.params().value[1], 0);
  EXPECT_EQ(mem.corrected(), 1);
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
