// SPDX-License-Identifier: Apache-2.0
// UARTC at every baud rate and format, and with a host whose clock is off.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "uartc_port.hpp"

namespace meltstage::chip {
namespace {

using ::testing::IsEmpty;

struct Line {
  unsigned baud;  // 100 Bd
  std::uint8_t format;
};
class UartcLine : public ::testing::TestWithParam<Line> {};

INSTANTIATE_TEST_SUITE_P(
    BaudsAndFormats, UartcLine, ::testing::ValuesIn([] {
      std::vector<Line> lines;
      for (const unsigned baud : {12u, 96u, 192u, 384u, 576u, 1152u, 2304u, 3777u, 4608u, 5000u}) {
        for (std::uint8_t format = 0; format < 4; ++format) lines.push_back({baud, format});
      }
      return lines;
    }()),
    [](const auto& test) {
      return "Baud" + std::to_string(test.param.baud) + "Format" + std::to_string(test.param.format);
    });

TEST_P(UartcLine, CommandArrives) {
  Port port(GetParam().baud, GetParam().format);
  port.answers = false;
  port.send(sealed({kOwn, 0x03, 0x01, 0x02, 0x00, 0x1F}));
  port.run_bits(45);
  ASSERT_TRUE(port.chip.cmd_valid());
  EXPECT_FALSE(port.chip.cmd_broadcast());
  EXPECT_EQ(port.chip.cmd_fc(), 0x03);
  EXPECT_EQ(port.chip.cmd_a(), 0x0102);
  EXPECT_EQ(port.chip.cmd_b(), 0x001F);
  EXPECT_EQ(port.chip.cmd_len(), 8);
  EXPECT_EQ(port.chip.messages(), 1);
  EXPECT_EQ(port.goods.size(), 1u);
}

// Bit n of the answer starts n bit times after the first, to the clock: ceil of the exact time.
TEST_P(UartcLine, AnswerIsExactToTheClock) {
  const auto [baud, format] = GetParam();
  Port port(baud, format);
  port.exc = 0x02;
  port.ask(kReadTwo, spec::kRspException);
  std::vector<int> levels(3, 1);  // lead of the driver enable
  for (const std::uint8_t byte : sealed({kOwn, 0x83, 0x02})) {
    for (const int level : char_levels(byte, format)) levels.push_back(level);
  }
  const auto rise = std::find(port.de_line.begin(), port.de_line.end(), 1);
  ASSERT_NE(rise, port.de_line.end());
  const auto from = static_cast<std::size_t>(rise - port.de_line.begin());
  const std::size_t shift = port.de_line.size() - port.tx_line.size();  // ask() clears the record of the line
  const auto bit_start = [&, baud = baud](std::uint64_t n) {
    return static_cast<std::size_t>((n * spec::kClkHz + baud * 100 - 1) / (baud * 100));
  };
  for (std::size_t n = 0; n < levels.size(); ++n) {
    for (std::size_t clock = bit_start(n); clock < bit_start(n + 1); ++clock) {
      ASSERT_EQ(port.de_line[from + clock], 1) << "bit " << n << " clock " << clock;
      ASSERT_EQ(port.tx_line[from - shift + clock], levels[n]) << "bit " << n << " clock " << clock;
    }
  }
  EXPECT_EQ(port.de_line[from + bit_start(levels.size())], 0) << "driver off right after the last stop bit";
}

// The frame ends 2.5 bits before the host's 3.5 characters are over; the answer's first start bit comes after
// them.
TEST_P(UartcLine, AnswerStartsThreeAndAHalfCharactersAfterTheRequest) {
  const auto [baud, format] = GetParam();
  Port port(baud, format);
  port.kind = spec::kRspEcho;
  port.send(sealed(kReadTwo));
  const std::uint64_t end_of_frame = port.clock;
  port.run_bits(45);
  const double gap = 3.5 * char_bits(format);
  ASSERT_EQ(port.goods.size(), 1u);
  const double silence = static_cast<double>(port.goods[0] - end_of_frame) / port.bit();
  EXPECT_GE(silence, gap - 2.5);
  EXPECT_LE(silence, gap - 2.5 + 2.0 / 16 + 4 / port.bit());
  const auto start = std::find(port.tx_line.begin(), port.tx_line.end(), 0);
  const auto before = static_cast<double>(start - port.tx_line.begin()) - static_cast<double>(end_of_frame);
  EXPECT_GE(before / port.bit(), gap);
  EXPECT_LE(before / port.bit(), gap + 0.5 + 2.0 / 16 + 8 / port.bit());
}

// What a host may send that is no frame, as the levels of its bits.
struct Noise {
  std::string name;
  std::vector<int> levels;
};

std::vector<int> levels_of(const Bytes& bytes, std::uint8_t format) {
  std::vector<int> levels;
  for (const std::uint8_t byte : bytes) {
    const std::vector<int> more = char_levels(byte, format);
    levels.insert(levels.end(), more.begin(), more.end());
  }
  return levels;
}

std::vector<Noise> noises(std::uint8_t format) {
  const Bytes frame = sealed(kReadTwo);
  Bytes wrong = frame;
  wrong.back() ^= 1u;
  Bytes longest(260, 0x55);
  std::vector<Noise> list{{"wrong CRC", levels_of(wrong, format)},
                          {"over-long", levels_of(longest, format)},
                          {"all zero", levels_of(Bytes(8, 0), format)},
                          {"all one", levels_of(Bytes(8, 0xFF), format)},
                          {"break", std::vector<int>(30, 0)}};
  for (std::size_t cut = 1; cut < frame.size(); ++cut)
    list.push_back({"cut after " + std::to_string(cut),
                    levels_of({frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(cut)}, format)});
  // A start bit that got lost: the receiver takes the first zero after it for one, and ends late.
  const std::size_t bits = char_bits(format);
  for (std::size_t i = 0; i < frame.size(); ++i) {
    Noise lost{"start bit lost of byte " + std::to_string(i), levels_of(frame, format)};
    lost.levels[i * bits] = 1;
    list.push_back(lost);
  }
  // A stop bit that got lost: of 8N2's the receiver takes the second for a start bit.
  Noise stop{"last stop bit low", levels_of(frame, format)};
  stop.levels.back() = 0;
  list.push_back(stop);
  for (const std::uint8_t last : Bytes{0x7F, 0x3F, 0xFE, 0x00}) {
    Noise lost{"start bit lost of a last byte " + std::to_string(last), levels_of({1, 2, last}, format)};
    lost.levels[2 * bits] = 1;
    list.push_back(lost);
  }
  return list;
}

// Whatever came before: a valid frame that starts 3.5 characters later, by the host's own clock, is heard.
TEST_P(UartcLine, HeardAgainThreeAndAHalfCharactersAfterAnythingWrong) {
  const auto [baud, format] = GetParam();
  if (baud != 384 && baud != 1152 && baud != 5000) return;
  for (const double host : {0.965, 1.0, 1.035}) {
    const double bit = bit_clocks(baud) / host;
    Port port(baud, format);
    unsigned heard = 0;
    for (const Noise& noise : noises(format)) {
      for (const int level : noise.levels) port.hold(level, bit);
      port.hold(1, 3.5 * char_bits(format) * bit);
      port.send(sealed(kReadTwo), format, bit);
      port.settle();
      EXPECT_EQ(port.goods.size(), ++heard) << noise.name << ", host's clock x " << host;
      heard = static_cast<unsigned>(port.goods.size());
    }
  }
}

// Modbus allows a pause of 1.5 characters; the chip takes nearly 2.5.
TEST_P(UartcLine, TwoAndAHalfCharactersEndAnIncompleteFrame) {
  const auto [baud, format] = GetParam();
  const Bytes frame = sealed(kReadTwo);
  const double limit = format == spec::kFormat8N1 ? 23.5 : 27.0;
  for (const bool complete : {true, false}) {
    Port port(baud, format);
    port.send({frame.begin(), frame.begin() + 3});
    port.run_bits(limit + (complete ? -0.2 : 0.4));
    port.send({frame.begin() + 3, frame.end()});
    port.settle();
    EXPECT_EQ(port.goods.size() == 1, complete);
  }
}

// -- Tolerance
// ------------------------------------------------------------------------------------------------------------------

class UartcTolerance : public ::testing::TestWithParam<Line> {};
INSTANTIATE_TEST_SUITE_P(BaudsAndFormats, UartcTolerance,
                         ::testing::Values(Line{96, spec::kFormat8E1}, Line{192, spec::kFormat8N2},
                                           Line{1152, spec::kFormat8E1}, Line{1152, spec::kFormat8N1},
                                           Line{4608, spec::kFormat8O1}, Line{5000, spec::kFormat8E1}),
                         [](const auto& test) {
                           return "Baud" + std::to_string(test.param.baud) + "Format" +
                                  std::to_string(test.param.format);
                         });

TEST_P(UartcTolerance, ReceivesBackToBackCharactersOfAHostThatIsUpTo3_5PercentOff) {
  const auto [baud, format] = GetParam();
  Port port(baud, format);
  Bytes request{kOwn, 0x10, 0x01, 0x01, 0x00, 0x10, 0x20};
  for (unsigned i = 0; i < 32; ++i) request.push_back(static_cast<std::uint8_t>(i % 3 == 0 ? 0xFF : i * 37u));
  request = sealed(request);
  unsigned sent = 0;
  for (int permille = -35; permille <= 35; permille += 5) {
    port.send(request, format, bit_clocks(baud) * (1 + permille / 1000.0));
    port.settle();
    EXPECT_EQ(port.goods.size(), ++sent) << permille << " permille";
  }
  EXPECT_EQ(port.chip.char_errors(), 0);
  EXPECT_EQ(port.chip.crc_errors(), 0);
}

TEST_P(UartcTolerance, AnswerIsReadByAHostThatIsUpTo3_5PercentOff) {
  const auto [baud, format] = GetParam();
  Port port(baud, format);
  const Bytes answer = port.ask({kOwn, 0x04, 0x00, 0x00, 0x00, 0x10}, spec::kRspRead);
  ASSERT_EQ(answer.size(), 37u);
  for (int permille = -35; permille <= 35; permille += 5) {
    const Decoded heard = decode(port.tx_line, bit_clocks(baud) * (1 + permille / 1000.0), format);
    EXPECT_EQ(heard.errors, 0u) << permille << " permille";
    EXPECT_EQ(heard.bytes, answer) << permille << " permille";
  }
}

TEST_P(UartcTolerance, HostFarOffIsNotUnderstood) {
  const auto [baud, format] = GetParam();
  Port port(baud, format);
  for (const double factor : {0.90, 1.10}) {
    port.send(sealed(kReadTwo), format, bit_clocks(baud) * factor);
    port.settle();
  }
  EXPECT_THAT(port.goods, IsEmpty());
}

// Where the receiver says that it only counts, it does, from whatever state an upset has left.
TEST(UartcLine, ReceiverSkipsAsItStepsFromEveryState) {
  std::mt19937 draw(::testing::UnitTest::GetInstance()->random_seed());
  int skipped = 0;
  for (int run = 0; run < 200'000; ++run) {
    UartRx rx;
#define DRAW(type, name, width, reset) rx.name = static_cast<type>(draw() & ((1u << (width)) - 1u));
    TC_UART_RX_FLOPS(DRAW)
#undef DRAW
    rx.valid_q = 0;  // a pulse: UARTC asks while there is none
    const auto baud = static_cast<std::uint16_t>(draw() & 0x1FFFu);
    const auto level = static_cast<std::uint8_t>(draw() & 1u);
    const std::uint64_t clocks = std::min<std::uint64_t>(rx.quiet(level, baud), 20);
    if (clocks == 0) continue;
    UartRx stepped = rx, at_once = rx;
    for (std::uint64_t i = 0; i < clocks; ++i) stepped.step(level, baud, spec::kFormat8E1, true);
    at_once.skip(level, baud, clocks);
#define SAME(type, name, width, reset) \
  ASSERT_EQ(at_once.name, stepped.name) << #name << ", baud " << baud << ", acc " << rx.acc_q;
    TC_UART_RX_FLOPS(SAME)
#undef SAME
    ++skipped;
  }
  EXPECT_GT(skipped, 10'000);
}

}  // namespace
}  // namespace meltstage::chip
