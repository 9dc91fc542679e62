// SPDX-License-Identifier: Apache-2.0
// UARTC: the stop frame, its settings, telemetry, and faults of the chip itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "uartc_port.hpp"

namespace meltstage::chip {
namespace {

using ::testing::IsEmpty;

// -- STOP
// -----------------------------------------------------------------------------------------------------------------------------

TEST(UartcStop, PulsesOnceWithTheAcceptedFrame) {
  for (const std::uint8_t address : {kOwn, std::uint8_t{0}}) {
    Port port;
    port.answers = false;
    Bytes frame = kStop;
    frame[0] = address;
    port.send(sealed(frame));
    port.run_bits(50);
    ASSERT_EQ(port.stops.size(), 1u);
    EXPECT_EQ(port.stops, port.goods);
  }
}

TEST(UartcStop, NotForAnythingElse) {
  const std::vector<Bytes> others{
      {kOwn + 1, 0x06, 0x01, 0x00, 0x00, 0x00},    // address
      {kOwn, 0x05, 0x01, 0x00, 0x00, 0x00},        // function
      {kOwn, 0x06, 0x00, 0x00, 0x00, 0x00},        // register
      {kOwn, 0x06, 0x01, 0x01, 0x00, 0x00},        //
      {kOwn, 0x06, 0x01, 0x00, 0xA5, 0x01},        // value
      {kOwn, 0x06, 0x01, 0x00, 0x00, 0x01},        //
      {kOwn, 0x06, 0x01, 0x00, 0x00, 0x00, 0x00},  // length
  };
  Port port;
  for (const Bytes& frame : others) {
    port.send(sealed(frame));
    port.settle();
  }
  Bytes spoilt = sealed(kStop);
  spoilt[7] ^= 0x80u;
  port.send(spoilt);
  port.settle();
  EXPECT_THAT(port.stops, IsEmpty());
}

TEST(UartcStop, HeardWhileACommandWaits) {
  Port port;
  port.answers = false;
  port.send(sealed(kReadTwo));
  port.run_bits(50);
  ASSERT_TRUE(port.chip.cmd_valid());
  port.send(sealed(kStop));
  port.run_bits(50);
  EXPECT_EQ(port.stops.size(), 1u);
  EXPECT_EQ(port.chip.messages(), 1);
  EXPECT_EQ(port.chip.cmd_fc(), 0x03) << "the waiting command is untouched";
}

TEST(UartcStop, HeardWhileAnAnswerIsSent) {
  Port port;
  port.kind = spec::kRspRead;
  port.send(sealed({kOwn, 0x03, 0x01, 0x01, 0x00, 0x20}));
  port.run_bits(100);
  ASSERT_TRUE(port.chip.de());
  port.send(sealed(kStop));
  port.run_bits(50);
  EXPECT_TRUE(port.chip.de());
  EXPECT_EQ(port.stops.size(), 1u);
}

// -- Configuration
// ----------------------------------------------------------------------------------------------------------------

TEST(UartcConfig, AddressFromStrapWhileTheRegisterIsZero) {
  for (std::uint8_t strap = 0; strap < 8; ++strap) {
    Port port(1152, spec::kFormat8E1, 0);
    port.in.strap = strap;
    port.run(1);
    EXPECT_EQ(port.chip.address_q, 1 + strap);
  }
  Port port(1152, spec::kFormat8E1, 247);
  port.in.strap = 5;
  port.run(1);
  EXPECT_EQ(port.chip.address_q, 247);
}

TEST(UartcConfig, TakenOverInTheNextClockWhenAtRest) {
  Port port;
  port.in.cfg_baud = 96;
  port.in.cfg_format = spec::kFormat8N2;
  port.run(1);
  EXPECT_EQ(port.chip.baud_q, 96);
  EXPECT_EQ(port.chip.format_q, spec::kFormat8N2);
}

TEST(UartcConfig, NeverTearsACharacterACommandOrAnAnswer) {
  Port port(1152, spec::kFormat8E1);
  port.answers = false;
  port.kind = spec::kRspEcho;
  const Bytes frame = sealed(kReadTwo);
  port.send({frame.begin(), frame.begin() + 2});
  port.in.cfg_baud = 96;
  port.in.cfg_format = spec::kFormat8N1;
  port.in.cfg_address = kOwn + 1;
  port.send({frame.begin() + 2, frame.end()});
  port.run_bits(300);
  ASSERT_TRUE(port.chip.cmd_valid());
  EXPECT_EQ(port.chip.baud_q, 1152);
  port.tx_line.clear();
  port.answers = true;
  while (!port.chip.rsp_busy()) port.run(1);
  while (port.chip.rsp_busy()) port.run(1);
  EXPECT_EQ(port.chip.baud_q, 1152);
  EXPECT_EQ(decode(port.tx_line, bit_clocks(1152), spec::kFormat8E1).bytes, frame);
  port.run(2);
  EXPECT_EQ(port.chip.baud_q, 96);
  EXPECT_EQ(port.chip.format_q, spec::kFormat8N1);
  EXPECT_EQ(port.chip.address_q, kOwn + 1);
}

TEST(UartcConfig, NeverTearsTelemetry) {
  Port port;
  port.in.tlm_start = true;
  port.run(1);
  port.in.cfg_baud = 96;
  port.in.cfg_format = spec::kFormat8N2;
  while (port.chip.tlm_busy()) {
    ASSERT_EQ(port.chip.baud_q, 1152);
    ASSERT_EQ(port.chip.format_q, spec::kFormat8E1);
    port.run(1);
  }
  EXPECT_EQ(decode(port.tlm_line, bit_clocks(1152), spec::kFormat8E1).bytes.size(), 37u);
  port.run(1);
  EXPECT_EQ(port.chip.baud_q, 96);
}

// -- Telemetry
// ----------------------------------------------------------------------------------------------------------------------

Bytes telemetry_frame(const Port& port) {
  Bytes bytes{port.chip.address_q, 0x04, 32};
  for (std::uint16_t i = 0; i < 16; ++i) {
    bytes.push_back(static_cast<std::uint8_t>(port.reg(i) >> 8));
    bytes.push_back(static_cast<std::uint8_t>(port.reg(i) & 0xFFu));
  }
  return sealed(bytes);
}

TEST(UartcTelemetry, SixteenInputRegistersAsAnAnswerOfFunction04) {
  for (const unsigned baud : {96u, 1152u, 5000u}) {
    Port port(baud);
    port.in.tlm_start = true;
    port.run(1);
    EXPECT_TRUE(port.chip.tlm_busy());
    port.settle();
    const Decoded heard = decode(port.tlm_line, port.bit(), spec::kFormat8E1);
    EXPECT_EQ(heard.errors, 0u);
    EXPECT_EQ(heard.bytes, telemetry_frame(port));
    EXPECT_EQ(std::count(port.tx_line.begin(), port.tx_line.end(), 0), 0) << "the host's line stays silent";
    EXPECT_EQ(std::count(port.de_line.begin(), port.de_line.end(), 1), 0);
  }
}

TEST(UartcTelemetry, StartIsIgnoredWhileOneIsSent) {
  Port port;
  port.in.tlm_start = true;
  port.run_bits(50);
  port.in.tlm_start = true;
  port.settle();
  EXPECT_EQ(decode(port.tlm_line, port.bit(), spec::kFormat8E1).bytes, telemetry_frame(port));
}

// The offsets, a clock apart over the two characters of a word, sweep the senders' reads of the port over
// each other.
TEST(UartcTelemetry, BesideAnAnswerBothAreWhole) {
  for (unsigned offset = 0; offset < 528; ++offset) {
    Port port(5000);
    port.kind = spec::kRspRead;
    port.send(sealed({kOwn, 0x03, 0x01, 0x01, 0x00, 0x10}));
    while (!port.chip.rsp_busy()) port.run(1);
    port.run(offset);
    port.in.tlm_start = true;
    port.settle();
    Bytes answer{kOwn, 0x03, 32};
    for (std::uint16_t i = 0; i < 16; ++i) {
      const std::uint16_t value = port.reg(static_cast<std::uint16_t>(0x0101 + i));
      answer.push_back(static_cast<std::uint8_t>(value >> 8));
      answer.push_back(static_cast<std::uint8_t>(value & 0xFFu));
    }
    ASSERT_EQ(decode(port.tx_line, port.bit(), spec::kFormat8E1).bytes, sealed(answer)) << offset;
    ASSERT_EQ(decode(port.tlm_line, port.bit(), spec::kFormat8E1).bytes, telemetry_frame(port)) << offset;
  }
}

TEST(UartcTelemetry, ReceiverHearsACommandMeanwhile) {
  Port port;
  port.in.tlm_start = true;
  port.run(1);
  EXPECT_EQ(port.ask(kReadTwo, spec::kRspEcho), sealed(kReadTwo));
}

// -- Faults of the chip itself
// ---------------------------------------------------------------------------------------------------

TEST(UartcFault, IllegalReceiverStateFallsBackToIdle) {
  for (unsigned code = 0; code < 16; ++code) {
    Port port;
    port.chip.rx.state_q = static_cast<std::uint8_t>(code);
    const bool legal = code == UartRx::kIdle || code == UartRx::kStart || code == UartRx::kData ||
                       code == UartRx::kParity || code == UartRx::kStop || code == UartRx::kBreak;
    port.run(1);
    if (!legal) {
      EXPECT_EQ(port.chip.rx.state_q, UartRx::kIdle) << code;
    }
    port.settle();
    port.send(sealed(kReadTwo));
    port.settle();
    EXPECT_EQ(port.goods.size(), 1u) << code;
  }
}

TEST(UartcState, CopyIsSaveAndRestore) {
  static_assert(std::is_trivially_copyable_v<Uartc>);
  Port port;
  const Bytes frame = sealed(kReadTwo);
  port.send({frame.begin(), frame.begin() + 5});
  const Uartc saved = port.chip;
  port.run(100000);
  port.chip = saved;
  port.send({frame.begin() + 5, frame.end()});
  port.settle();
  EXPECT_EQ(port.goods.size(), 1u);
}

}  // namespace
}  // namespace meltstage::chip
