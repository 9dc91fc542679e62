// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/uart.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "cmodel/spec.hpp"

namespace meltstage::tb {
namespace {

constexpr double kClock_hz = 10.0e6;

struct Loop {
  Loop(const UartLine& line, const UartTiming& timing)
      : transmitter(line, timing, stream(1, "jitter")), receiver(line) {}

  std::vector<UartByte> run(std::uint64_t cycles) {
    std::vector<UartByte> bytes;
    const std::uint64_t end = cycle + cycles;
    for (; cycle < end; ++cycle) {
      receiver.step(cycle, transmitter.step(cycle));
      while (const auto byte = receiver.take()) bytes.push_back(*byte);
    }
    return bytes;
  }
  UartTransmitter transmitter;
  UartReceiver receiver;
  std::uint64_t cycle = 0;
};

UartLine line_115200(UartFormat format) {
  return {.clock_hz = kClock_hz, .baud = 115200.0, .format = format};
}

// Levels at mid-bit of one character.
std::vector<int> levels(UartFormat format, const UartChar& character) {
  const UartLine line{.clock_hz = 100.0, .baud = 10.0, .format = format};
  UartTransmitter transmitter(line, {}, stream(1, "jitter"));
  transmitter.send(character);
  std::vector<int> found;
  for (std::uint64_t cycle = 0; cycle < 10U * static_cast<unsigned>(format.bits()); ++cycle) {
    const bool level = transmitter.step(cycle);
    if (cycle % 10 == 5) found.push_back(level ? 1 : 0);
  }
  return found;
}

TEST(UartTransmitter, FramesBitsAsTheFormatsSay) {
  EXPECT_EQ(levels(k8E1, {.data = 0x13}), (std::vector<int>{0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1}));
  EXPECT_EQ(levels(k8O1, {.data = 0x13}), (std::vector<int>{0, 1, 1, 0, 0, 1, 0, 0, 0, 0, 1}));
  EXPECT_EQ(levels(k8N1, {.data = 0x13}), (std::vector<int>{0, 1, 1, 0, 0, 1, 0, 0, 0, 1}));
  EXPECT_EQ(levels(k8N2, {.data = 0x13}), (std::vector<int>{0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1}));
}

TEST(UartFormat, IsTheOneOfRegisterFormat) {
  namespace spec = chip::spec;
  const auto expect = [](unsigned word, const UartFormat& wanted) {
    const UartFormat format = uart_format(static_cast<std::uint16_t>(word));
    EXPECT_EQ(format.parity, wanted.parity) << word;
    EXPECT_EQ(format.stop_bits, wanted.stop_bits) << word;
  };
  for (const unsigned pause : {0U, 1U << spec::kFormatPause}) {
    expect(spec::kFormat8E1 | pause, k8E1);
    expect(spec::kFormat8O1 | pause, k8O1);
    expect(spec::kFormat8N2 | pause, k8N2);
    expect(spec::kFormat8N1 | pause, k8N1);
  }
}

class Loopback : public ::testing::TestWithParam<std::tuple<int, double>> {};

TEST_P(Loopback, AllBytesArriveAtABaudError) {
  const std::array<UartFormat, 4> formats{k8E1, k8O1, k8N1, k8N2};
  const auto [format, error] = GetParam();
  Loop loop(line_115200(formats.at(static_cast<std::size_t>(format))), {.baud_error_ratio = error});
  for (int i = 0; i < 256; ++i) loop.transmitter.send({.data = static_cast<std::uint8_t>(i)});
  const std::vector<UartByte> bytes = loop.run(300000);
  ASSERT_EQ(bytes.size(), 256U);
  for (unsigned i = 0; i < 256; ++i) {
    EXPECT_EQ(bytes[i].data, i);
    EXPECT_FALSE(bytes[i].parity_error);
    EXPECT_FALSE(bytes[i].framing_error);
  }
}

INSTANTIATE_TEST_SUITE_P(Errors, Loopback,
                         ::testing::Combine(::testing::Range(0, 4),
                                            ::testing::Values(-0.03, -0.01, 0.0, 0.02, 0.03)));

TEST(Uart, ABaudErrorOfSevenPercentIsNotReadable) {
  Loop loop(line_115200(k8E1), {.baud_error_ratio = -0.07});
  for (int i = 0; i < 100; ++i)
    loop.transmitter.send({.data = static_cast<std::uint8_t>(37 * i), .gap_bits = 20});
  unsigned bad = 0;
  for (const UartByte& byte : loop.run(300000)) bad += byte.parity_error || byte.framing_error ? 1U : 0U;
  EXPECT_GT(bad, 10U);
}

TEST(Uart, JitterOfAQuarterBitIsReadable) {
  Loop loop(line_115200(k8E1), {.jitter_bits = 0.24});
  for (int i = 0; i < 256; ++i)
    loop.transmitter.send({.data = static_cast<std::uint8_t>(i), .gap_bits = 1.0});
  const std::vector<UartByte> bytes = loop.run(400000);
  ASSERT_EQ(bytes.size(), 256U);
  for (unsigned i = 0; i < 256; ++i) EXPECT_EQ(bytes[i].data, i);
}

TEST(Uart, JitterMovesEdges) {
  Loop exact(line_115200(k8E1), {});
  Loop shaky(line_115200(k8E1), {.jitter_bits = 0.2});
  unsigned differing = 0;
  exact.transmitter.send({.data = 0x55});
  shaky.transmitter.send({.data = 0x55});
  for (std::uint64_t cycle = 0; cycle < 1000; ++cycle) {
    differing += exact.transmitter.step(cycle) != shaky.transmitter.step(cycle) ? 1U : 0U;
  }
  EXPECT_GT(differing, 10U);
}

TEST(Uart, FractionalBitsDoNotAddUp) {
  Loop loop(line_115200(k8N1), {});
  for (int i = 0; i < 1000; ++i) loop.transmitter.send({.data = 0xA5});
  const std::vector<UartByte> bytes = loop.run(900000);
  ASSERT_EQ(bytes.size(), 1000U);
  const double expected = 999.0 * 10.0 * kClock_hz / 115200.0;
  EXPECT_NEAR(static_cast<double>(bytes.back().start_cycle - bytes.front().start_cycle), expected, 1.0);
}

TEST(Uart, IdleGapIsKept) {
  Loop loop(line_115200(k8E1), {});
  loop.transmitter.send({.data = 1});
  loop.transmitter.send({.data = 2, .gap_bits = 17.5});
  const std::vector<UartByte> bytes = loop.run(10000);
  ASSERT_EQ(bytes.size(), 2U);
  EXPECT_NEAR(static_cast<double>(bytes[1].start_cycle - bytes[0].start_cycle), 28.5 * kClock_hz / 115200.0,
              1.0);
}

TEST(Uart, WrongParityIsSeen) {
  Loop loop(line_115200(k8E1), {});
  loop.transmitter.send({.data = 0x42, .wrong_parity = true});
  const std::vector<UartByte> bytes = loop.run(5000);
  ASSERT_EQ(bytes.size(), 1U);
  EXPECT_TRUE(bytes[0].parity_error);
  EXPECT_FALSE(bytes[0].framing_error);
}

TEST(Uart, MissingStopBitIsSeen) {
  Loop loop(line_115200(k8E1), {});
  loop.transmitter.send({.data = 0x42, .missing_stop = true});
  const std::vector<UartByte> bytes = loop.run(5000);
  ASSERT_EQ(bytes.size(), 1U);
  EXPECT_TRUE(bytes[0].framing_error);
}

TEST(Uart, ShortGlitchOnTheIdleLineIsNoCharacter) {
  Loop loop(line_115200(k8E1), {});
  loop.transmitter.glitch(100, 30);
  EXPECT_TRUE(loop.run(3000).empty());
  EXPECT_EQ(loop.receiver.false_starts(), 1U);
}

TEST(Uart, GlitchInADataBitFlipsItAndItsParityTells) {
  Loop loop(line_115200(k8E1), {});
  loop.transmitter.send({.data = 0x00});
  loop.transmitter.glitch(static_cast<std::uint64_t>(3.2 * kClock_hz / 115200.0), 50);
  const std::vector<UartByte> bytes = loop.run(3000);
  ASSERT_EQ(bytes.size(), 1U);
  EXPECT_EQ(bytes[0].data, 0x04);
  EXPECT_TRUE(bytes[0].parity_error);
}

TEST(Uart, SkippingBetweenEventsGivesTheSameBytes) {
  const UartLine line = line_115200(k8E1);
  UartTransmitter transmitter(line, {}, stream(1, "jitter"));
  UartReceiver receiver(line);
  for (int i = 0; i < 50; ++i) transmitter.send({.data = static_cast<std::uint8_t>(i), .gap_bits = i * 0.7});
  std::vector<int> data;
  unsigned steps = 0;
  for (std::uint64_t cycle = 0; cycle < 200000;) {
    receiver.step(cycle, transmitter.step(cycle));
    while (const auto byte = receiver.take()) data.push_back(byte->data);
    cycle = std::max(cycle + 1, std::min(transmitter.next_event(), receiver.next_event()));
    ++steps;
  }
  ASSERT_EQ(data.size(), 50U);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(data[static_cast<std::size_t>(i)], i);
  EXPECT_LT(steps, 2500U);
}

TEST(Uart, TooFastALineIsRefused) {
  EXPECT_THROW(UartReceiver({.clock_hz = 1e6, .baud = 921600.0}), std::invalid_argument);
}

}  // namespace
}  // namespace meltstage::tb
