// SPDX-License-Identifier: Apache-2.0
// UARTC: what it answers, CRC and reset.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "uartc_port.hpp"

namespace meltstage::chip {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(UartcReset, LinesIdleAndConfigurationOfTheRegisters) {
  const Uartc chip;
  EXPECT_TRUE(chip.tx_o());
  EXPECT_TRUE(chip.tlm_tx());
  EXPECT_FALSE(chip.de());
  EXPECT_FALSE(chip.cmd_valid());
  EXPECT_EQ(chip.baud_q, 1152);
  EXPECT_EQ(chip.format_q, spec::kFormat8E1);
  EXPECT_EQ(chip.address_q, 1);
}

TEST(UartcReset, NothingMovesWhileTheLineIsIdle) {
  Port port;
  const Uartc before = port.chip;
  port.run(100000);
#define SAME(type, name, width, reset) EXPECT_EQ(port.chip.name, before.name) << #name;
#define SAME_RX(type, name, width, reset) EXPECT_EQ(port.chip.rx.name, before.rx.name) << #name;
#define SAME_FRAME(type, name, width, reset) EXPECT_EQ(port.chip.frame.name, before.frame.name) << #name;
#define SAME_TX(type, name, width, reset)                \
  EXPECT_EQ(port.chip.tx.name, before.tx.name) << #name; \
  EXPECT_EQ(port.chip.tlm.name, before.tlm.name) << #name;
  TC_UARTC_FLOPS(SAME)
  TC_UART_RX_FLOPS(SAME_RX)
  TC_UART_FRAME_FLOPS(SAME_FRAME)
  TC_UART_TX_FLOPS(SAME_TX)
}

TEST(UartcCrc, SpecificationExamples) {
  EXPECT_EQ(crc_of(text("123456789")), 0x4B37);
  EXPECT_THAT(sealed({0x01, 0x03, 0x00, 0x00, 0x00, 0x02}),
              ElementsAre(0x01, 0x03, 0x00, 0x00, 0x00, 0x02, 0xC4, 0x0B));
}

TEST(UartcAnswer, ReadDataFromTheReadPort) {
  Port port;
  port.reg = [](std::uint16_t address) { return static_cast<std::uint16_t>(0xA000u + address); };
  EXPECT_EQ(port.ask({kOwn, 0x03, 0x01, 0x01, 0x00, 0x02}, spec::kRspRead),
            sealed({kOwn, 0x03, 0x04, 0xA1, 0x01, 0xA1, 0x02}));
}

TEST(UartcAnswer, ReadDataBothEndsOfTheCount) {
  for (const std::uint8_t count : Bytes{1, 32}) {
    Port port;
    Bytes expected{kOwn, 0x04, static_cast<std::uint8_t>(2 * count)};
    for (unsigned i = 0; i < count; ++i) {
      const unsigned value = (0x00FE + i) * 259u + 7u;
      expected.push_back(static_cast<std::uint8_t>(value >> 8));
      expected.push_back(static_cast<std::uint8_t>(value));
    }
    EXPECT_EQ(port.ask({kOwn, 0x04, 0x00, 0xFE, 0x00, count}, spec::kRspRead), sealed(expected));
  }
}

TEST(UartcAnswer, Exceptions) {
  for (const std::uint8_t code : Bytes{1, 2, 3, 4, 6}) {
    Port port;
    port.exc = code;
    EXPECT_EQ(port.ask({kOwn, 0x2A, 0x00, 0x00}, spec::kRspException), sealed({kOwn, 0xAA, code}));
  }
}

TEST(UartcAnswer, EchoOfWriteSingleWriteMultipleAndDiagnostics) {
  Port port;
  EXPECT_EQ(port.ask({kOwn, 0x06, 0x01, 0x01, 0x07, 0xD0}, spec::kRspEcho),
            sealed({kOwn, 0x06, 0x01, 0x01, 0x07, 0xD0}));
  EXPECT_EQ(port.ask({kOwn, 0x10, 0x01, 0x01, 0x00, 0x01, 0x02, 0x07, 0xD0}, spec::kRspEcho),
            sealed({kOwn, 0x10, 0x01, 0x01, 0x00, 0x01}));
  EXPECT_EQ(port.ask({kOwn, 0x08, 0x00, 0x00, 0x5A, 0xA5}, spec::kRspEcho),
            sealed({kOwn, 0x08, 0x00, 0x00, 0x5A, 0xA5}));
}

// Byte count, id, run indicator, text: the order in which libmodbus reads it.
TEST(UartcAnswer, ServerId) {
  for (const std::uint8_t run : Bytes{0x00, 0xFF}) {
    Port port;
    port.exc = run;
    EXPECT_EQ(port.ask({kOwn, 0x11}, spec::kRspServerId),
              sealed(joined({kOwn, 0x11, 15, 0x7C, run}, text("Meltstage TC1"))));
  }
}

TEST(UartcAnswer, DeviceIdentificationStreamForCodes1To3) {
  for (const std::uint8_t code : Bytes{1, 2, 3}) {
    Port port;
    Bytes expected{kOwn, 0x2B, 0x0E, code, 0x81, 0x00, 0x00, 3};
    expected = joined(joined(expected, {0, 9}), text("Meltstage"));
    expected = joined(joined(expected, {1, 3}), text("TC1"));
    expected = joined(joined(expected, {2, 3}), text("0.1"));
    EXPECT_EQ(port.ask({kOwn, 0x2B, 0x0E, code, 0x00}, spec::kRspIdStream), sealed(expected));
  }
}

TEST(UartcAnswer, DeviceIdentificationSingleObjects) {
  const std::vector<std::string_view> objects{"Meltstage", "TC1", "0.1"};
  for (std::uint8_t object = 0; object < 3; ++object) {
    Port port;
    const auto length = static_cast<std::uint8_t>(objects[object].size());
    EXPECT_EQ(
        port.ask({kOwn, 0x2B, 0x0E, 4, object}, spec::kRspIdObject),
        sealed(joined({kOwn, 0x2B, 0x0E, 4, 0x81, 0x00, 0x00, 1, object, length}, text(objects[object]))));
  }
}

TEST(UartcAnswer, StartsAtOnceWhenTheCommandIsDone) {
  Port port;
  port.answers = false;
  port.send(sealed(kReadTwo));
  port.run_bits(400);
  EXPECT_TRUE(port.chip.cmd_valid()) << "waits until it is done";
  EXPECT_FALSE(port.chip.rsp_busy());
  port.kind = spec::kRspEcho;
  port.answers = true;
  port.run(1);
  EXPECT_FALSE(port.chip.cmd_valid());
  EXPECT_TRUE(port.chip.rsp_busy());
  EXPECT_FALSE(port.chip.de());
  port.run(1);
  EXPECT_TRUE(port.chip.de());
  EXPECT_TRUE(port.chip.tx_o());
}

TEST(UartcAnswer, CommandDoneWithoutACommandIsNothing) {
  Port port;
  port.in.cmd_done = false;
  UartcIn in = port.in;
  in.cmd_done = true;
  in.rsp_kind = spec::kRspEcho;
  port.chip.step(in);
  EXPECT_FALSE(port.chip.rsp_busy());
}

TEST(UartcAnswer, KindNoneAndUnknownKindStaySilent) {
  for (const std::uint8_t kind : Bytes{0, 7}) {
    Port port;
    EXPECT_THAT(port.ask(kReadTwo, kind), IsEmpty());
    EXPECT_EQ(std::count(port.de_line.begin(), port.de_line.end(), 1), 0);
    EXPECT_EQ(port.chip.messages(), 1);
  }
}

TEST(UartcAnswer, BroadcastIsCarriedOutButNeverAnswered) {
  Port port;
  EXPECT_THAT(port.ask({0x00, 0x06, 0x01, 0x01, 0x00, 0x64}, spec::kRspEcho), IsEmpty());
  EXPECT_TRUE(port.chip.cmd_broadcast());
  EXPECT_EQ(port.goods.size(), 1u);
  EXPECT_EQ(std::count(port.de_line.begin(), port.de_line.end(), 1), 0);
}

}  // namespace
}  // namespace meltstage::chip
