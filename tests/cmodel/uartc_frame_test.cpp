// SPDX-License-Identifier: Apache-2.0
// UARTC: what is a frame and what is not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <vector>

#include "uartc_port.hpp"

namespace meltstage::chip {
namespace {

using ::testing::IsEmpty;

TEST(UartcFrame, SixteenWordsOfAWrite) {
  Port port;
  port.answers = false;
  Bytes request{kOwn, 0x10, 0x01, 0x0D, 0x00, 0x10, 0x20};
  for (unsigned i = 0; i < 16; ++i) {
    request.push_back(static_cast<std::uint8_t>(0x80 + i));
    request.push_back(static_cast<std::uint8_t>(i * 17));
  }
  port.send(sealed(request));
  port.run_bits(45);
  ASSERT_TRUE(port.chip.cmd_valid());
  EXPECT_EQ(port.chip.cmd_count(), 0x20);
  EXPECT_EQ(port.chip.cmd_len(), 41);
  for (unsigned i = 0; i < 16; ++i) EXPECT_EQ(port.chip.cmd_word(i), (0x80 + i) << 8 | i * 17) << i;
}

TEST(UartcFrame, WrongCrcIsCountedAndDropped) {
  Port port;
  Bytes frame = sealed(kReadTwo);
  frame.back() ^= 1u;
  port.send(frame);
  port.settle();
  EXPECT_THAT(port.goods, IsEmpty());
  EXPECT_EQ(port.chip.crc_errors(), 1);
  EXPECT_EQ(port.chip.char_errors(), 0);
}

TEST(UartcFrame, OtherAddressIsDroppedInSilence) {
  Port port;
  Bytes frame = kReadTwo;
  frame[0] = kOwn + 1;
  port.send(sealed(frame));
  port.settle();
  EXPECT_THAT(port.goods, IsEmpty());
  EXPECT_EQ(port.chip.crc_errors(), 0);
  EXPECT_EQ(port.chip.messages(), 0);
}

// Two bytes FF FF leave a CRC residue of zero: only the length tells that they are no frame.
TEST(UartcFrame, TooShort) {
  Port port;
  port.send({0xFF, 0xFF});
  port.settle();
  port.send(sealed({0x00}));
  port.settle();
  EXPECT_THAT(port.goods, IsEmpty());
  EXPECT_EQ(port.chip.crc_errors(), 2);
}

TEST(UartcFrame, ShortestAndLongest) {
  for (const std::size_t length : {4u, 256u}) {
    Port port(5000);
    Bytes frame(length - 2, 0x11);
    frame[0] = kOwn;
    port.send(sealed(frame));
    port.settle();
    EXPECT_EQ(port.goods.size(), 1u) << length;
    EXPECT_EQ(port.chip.cmd_len(), length);
  }
}

TEST(UartcFrame, OverLongIsOneCharacterError) {
  for (const std::size_t length : {257u, 700u}) {
    Port port(5000);
    Bytes frame(length - 2, 0x11);
    frame[0] = kOwn;
    port.send(sealed(frame));
    port.settle();
    EXPECT_THAT(port.goods, IsEmpty());
    EXPECT_EQ(port.chip.char_errors(), 1) << length;
    EXPECT_EQ(port.chip.crc_errors(), 0) << length;
    port.send(sealed(kReadTwo));
    port.settle();
    EXPECT_EQ(port.goods.size(), 1u) << "the next frame is heard";
  }
}

TEST(UartcFrame, HostMayPauseUpTo1_75MillisecondsWhereFormatSaysSo) {
  const Bytes frame = sealed(kReadTwo);
  for (std::size_t cut = 1; cut < frame.size(); ++cut) {
    Port port;
    port.in.cfg_pause = true;
    port.run(1);
    port.send({frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(cut)});
    port.run(static_cast<std::uint64_t>(0.0017 * kClkHz));
    port.send({frame.begin() + static_cast<std::ptrdiff_t>(cut), frame.end()});
    port.settle();
    EXPECT_EQ(port.goods.size(), 1u) << cut;
  }
}

TEST(UartcFrame, LongerPauseEndsTheFrame) {
  const Bytes frame = sealed(kReadTwo);
  Port port;
  port.in.cfg_pause = true;
  port.run(1);
  port.send({frame.begin(), frame.begin() + 3});
  port.run(static_cast<std::uint64_t>(0.00176 * kClkHz));
  EXPECT_EQ(port.chip.crc_errors(), 1);
  port.send({frame.begin() + 3, frame.end()});
  port.settle();
  EXPECT_THAT(port.goods, IsEmpty());
  EXPECT_EQ(port.chip.crc_errors(), 2);
}

TEST(UartcFrame, FramesWithoutSilenceBetweenThemAreOne) {
  Port port;
  port.send(sealed(kReadTwo));
  port.send(sealed(kReadTwo));
  port.settle();
  EXPECT_THAT(port.goods, IsEmpty());
  EXPECT_EQ(port.chip.crc_errors(), 1);
}

TEST(UartcFrame, ParityErrorSpoilsTheFrame) {
  Port port;
  Bytes frame = sealed(kReadTwo);
  port.send({frame.begin(), frame.begin() + 4});
  std::vector<int> levels = char_levels(frame[4], spec::kFormat8E1);
  levels[9] ^= 1;
  for (const int level : levels) port.hold(level, port.bit());
  port.send({frame.begin() + 5, frame.end()});
  port.settle();
  EXPECT_THAT(port.goods, IsEmpty());
  EXPECT_EQ(port.chip.char_errors(), 1);
  EXPECT_EQ(port.chip.crc_errors(), 0);
}

TEST(UartcFrame, LowStopBitSpoilsTheFrame) {
  Port port(1152, spec::kFormat8N1);
  const Bytes frame = sealed(kReadTwo);
  for (std::size_t i = 0; i < frame.size(); ++i) {
    std::vector<int> levels = char_levels(frame[i], spec::kFormat8N1);
    if (i == 3) levels.back() = 0;
    for (const int level : levels) port.hold(level, port.bit());
    port.hold(1, port.bit());
  }
  port.settle();
  EXPECT_THAT(port.goods, IsEmpty());
  EXPECT_EQ(port.chip.char_errors(), 1);
}

TEST(UartcFrame, BreakIsOneCharacterErrorAndTheNextFrameIsHeard) {
  Port port;
  port.hold(0, 500 * port.bit());
  EXPECT_EQ(port.chip.char_errors(), 1);
  EXPECT_EQ(port.chip.rx.state_q, UartRx::kBreak);
  port.settle();
  port.send(sealed(kReadTwo));
  port.settle();
  EXPECT_EQ(port.goods.size(), 1u);
}

TEST(UartcFrame, GlitchShorterThanHalfABitLeavesNoTrace) {
  Port port(96);
  port.hold(0, 0.48 * port.bit());
  port.run_bits(60);
  EXPECT_EQ(port.chip.char_errors(), 0);
  EXPECT_EQ(port.chip.crc_errors(), 0);
  EXPECT_FALSE(port.chip.frame.open());
  // Inside a frame's silence and between its characters, too.
  const Bytes frame = sealed(kReadTwo);
  for (const std::uint8_t byte : frame) {
    port.send({byte});
    port.run_bits(1);
    port.hold(0, 0.48 * port.bit());
    port.run_bits(2);
  }
  port.settle();
  EXPECT_EQ(port.goods.size(), 1u);
}

TEST(UartcFrame, StartBitOfHalfABitAndMoreCounts) {
  Port port(96, spec::kFormat8N1);
  port.hold(0, 0.57 * port.bit());
  port.run_bits(60);
  EXPECT_EQ(port.chip.crc_errors(), 1) << "a character FF came in";
}

// One spoilt sample of the three around the middle of every bit does no harm.
TEST(UartcFrame, MajorityOfThreeSamples) {
  for (const double where : {7.0, 8.0, 9.0}) {
    Port port(96);
    for (const std::uint8_t byte : sealed(kReadTwo)) {
      for (const int level : char_levels(byte, spec::kFormat8E1)) {
        const double tick = port.bit() / 16;
        port.hold(level, (where - 0.5) * tick);
        port.hold(1 - level, tick);
        port.hold(level, (15.5 - where) * tick);
      }
    }
    port.settle();
    EXPECT_EQ(port.goods.size(), 1u) << "tick " << where;
  }
}

TEST(UartcFrame, DroppedAsAWholeWhileACommandWaits) {
  Port port;
  port.answers = false;
  port.send(sealed({kOwn, 0x06, 0x01, 0x01, 0x00, 0x64}));
  port.run_bits(45);
  ASSERT_TRUE(port.chip.cmd_valid());
  port.send(sealed({kOwn, 0x10, 0x01, 0x02, 0x00, 0x01, 0x02, 0x12, 0x34}));
  port.run_bits(300);
  EXPECT_EQ(port.chip.cmd_fc(), 0x06);
  EXPECT_EQ(port.chip.cmd_a(), 0x0101);
  EXPECT_EQ(port.chip.cmd_b(), 0x0064);
  EXPECT_EQ(port.chip.messages(), 1);
  port.answers = true;
  port.settle();
  port.send(sealed(kReadTwo));
  port.settle();
  EXPECT_EQ(port.chip.messages(), 2);
  EXPECT_EQ(port.chip.crc_errors(), 0);
  EXPECT_EQ(port.chip.char_errors(), 0);
}

TEST(UartcFrame, BegunDuringAnAnswerIsDroppedToItsEnd) {
  Port port;
  port.kind = spec::kRspEcho;
  port.send(sealed(kReadTwo));
  port.run_bits(38.5 + 60);
  ASSERT_TRUE(port.chip.de());
  Bytes longer(60, 0x22);
  longer[0] = kOwn;
  port.send(sealed(longer));  // outlasts the answer
  EXPECT_FALSE(port.chip.rsp_busy());
  port.settle();
  EXPECT_EQ(port.chip.messages(), 1);
  EXPECT_EQ(port.chip.crc_errors(), 0);
  port.send(sealed(kReadTwo));
  port.settle();
  EXPECT_EQ(port.chip.messages(), 2);
}

TEST(UartcFrame, OwnEchoOnATwoWireBusIsNotHeard) {
  Port port;
  port.echo = true;
  EXPECT_EQ(port.ask(kReadTwo, spec::kRspRead).size(), 9u);
  EXPECT_EQ(port.chip.messages(), 1);
  EXPECT_EQ(port.ask(kReadTwo, spec::kRspRead).size(), 9u);
  EXPECT_EQ(port.chip.messages(), 2);
  EXPECT_EQ(port.chip.crc_errors(), 0);
  EXPECT_EQ(port.chip.char_errors(), 0);
}

TEST(UartcFrame, CountersWrap) {
  Port port;
  port.chip.frame.messages_q = 0xFFFF;
  port.chip.frame.crc_errors_q = 0xFFFF;
  port.chip.frame.char_errors_q = 0xFFFF;
  port.send(sealed(kReadTwo));
  port.settle();
  port.send({1, 2, 3, 4, 5});
  port.settle();
  port.hold(0, 20 * port.bit());
  port.settle();
  EXPECT_EQ(port.chip.messages(), 0);
  EXPECT_EQ(port.chip.crc_errors(), 0);
  EXPECT_EQ(port.chip.char_errors(), 0);
}

RC_GTEST_PROP(UartcProperty, AnySoundFrameToThisSlaveIsAccepted, ()) {
  Port port(*rc::gen::inRange(2000u, 5001u), *rc::gen::inRange<std::uint8_t>(0, 4));
  auto body = *rc::gen::container<Bytes>(rc::gen::arbitrary<std::uint8_t>());
  body.resize(std::max<std::size_t>(body.size(), 2));
  body[0] = *rc::gen::element<std::uint8_t>(0, kOwn);
  port.send(sealed(body));
  port.settle();
  RC_ASSERT(port.chip.messages() == 1);
  RC_ASSERT(port.chip.cmd_len() == body.size() + 2);
  RC_ASSERT(port.chip.cmd_fc() == body[1]);
}

RC_GTEST_PROP(UartcProperty, AFrameWithFlippedBitsIsNeverACommand, ()) {
  Port port(5000, spec::kFormat8N1);
  Bytes frame = sealed(kReadTwo);
  const auto first = *rc::gen::inRange<unsigned>(0, 64);
  const auto second = *rc::gen::inRange<unsigned>(0, 64);
  frame[first / 8] ^= static_cast<std::uint8_t>(1u << (first % 8));
  if (second != first) frame[second / 8] ^= static_cast<std::uint8_t>(1u << (second % 8));
  port.send(frame);
  port.settle();
  RC_ASSERT(port.goods.empty());
  RC_ASSERT(port.chip.crc_errors() == 1);
}

}  // namespace
}  // namespace meltstage::chip
