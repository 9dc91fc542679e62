// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/modbus_host.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string_view>

namespace meltstage::tb {
namespace {

using ::testing::ElementsAre;
using Bytes = std::vector<std::uint8_t>;

constexpr UartLine kLine{.clock_hz = 10.0e6, .baud = 115200.0, .format = k8E1};

Bytes bytes_of(const ModbusRequest& request) {
  Bytes bytes;
  for (const UartChar& character : request.frame) bytes.push_back(character.data);
  return bytes;
}

Bytes closed(Bytes bytes) { return bytes_of(with_crc(bytes)); }

// A slave that answers each frame it hears with the next prepared one, 2 ms later.
class Scripted {
 public:
  explicit Scripted(
      ModbusHostConfig config = {.line = kLine, .timing = {}, .timeout_s = 0.02, .broadcast_delay_s = 0.01})
      : host(config, stream(1, "host")),
        transmitter(config.line, {}, stream(1, "slave")),
        listener(config.line) {}

  void run(std::uint64_t cycles) {
    for (const std::uint64_t end = cycle + cycles; cycle < end; ++cycle) step();
  }

  ModbusResult transact(ModbusRequest request, const Bytes& reply) {
    replies.push_back(reply);
    const std::uint64_t id = host.submit(std::move(request));
    for (int i = 0; i < 10000000 && host.busy(); ++i, ++cycle) step();
    auto result = host.take_result();
    EXPECT_TRUE(result.has_value());
    EXPECT_EQ(result->id, id);
    return *result;
  }

  void step() {
    const bool tx = host.step(cycle, transmitter.step(cycle));
    listener.step(cycle, tx);
    if (const auto frame = listener.take()) {
      heard.push_back(*frame);
      if (!replies.empty()) {
        for (const std::uint8_t byte : replies.front()) transmitter.send({.data = byte});
        replies.pop_front();
      }
    }
  }

  ModbusHost host;
  UartTransmitter transmitter;
  RtuFrameReceiver listener;
  std::deque<Bytes> replies;
  std::vector<RtuFrame> heard;
  std::uint64_t cycle = 0;
};

TEST(Crc16, KnownValues) {
  const std::string_view digits = "123456789";
  EXPECT_EQ(crc16_modbus(Bytes(digits.begin(), digits.end())), 0x4B37);
  EXPECT_EQ(closed({0x01, 0x03, 0x00, 0x00, 0x00, 0x02}),
            (Bytes{0x01, 0x03, 0x00, 0x00, 0x00, 0x02, 0xC4, 0x0B}));
}

TEST(FrameSilence, ThreeAndAHalfCharactersUpTo19200Baud) {
  EXPECT_NEAR(frame_silence_s({1e7, 9600.0, k8E1}), 4.010e-3, 1e-6);
  EXPECT_NEAR(frame_silence_s({1e7, 19200.0, k8E1}), 2.005e-3, 1e-6);
  EXPECT_EQ(frame_silence_s({1e7, 38400.0, k8E1}), 1.75e-3);
}

// Requests of the Modbus Application Protocol V1.1b3 examples.
TEST(ModbusRequest, GoldenFrames) {
  EXPECT_EQ(bytes_of(read_holding_registers(0x11, 0x006B, 3)),
            (Bytes{0x11, 0x03, 0x00, 0x6B, 0x00, 0x03, 0x76, 0x87}));
  EXPECT_EQ(bytes_of(read_input_registers(0x11, 0x0008, 1)),
            (Bytes{0x11, 0x04, 0x00, 0x08, 0x00, 0x01, 0xB2, 0x98}));
  EXPECT_EQ(bytes_of(write_single_register(0x11, 0x0001, 0x0003)),
            (Bytes{0x11, 0x06, 0x00, 0x01, 0x00, 0x03, 0x9A, 0x9B}));
  EXPECT_EQ(bytes_of(write_multiple_registers(0x11, 0x0001, std::vector<std::uint16_t>{0x000A, 0x0102})),
            (Bytes{0x11, 0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02, 0xC6, 0xF0}));
  EXPECT_EQ(bytes_of(diagnostic_echo(0x11, 0xA537)), closed({0x11, 0x08, 0x00, 0x00, 0xA5, 0x37}));
  EXPECT_EQ(bytes_of(report_server_id(0x01)), (Bytes{0x01, 0x11, 0xC0, 0x2C}));
  EXPECT_EQ(bytes_of(read_device_identification(0x01, 1, 0)),
            (Bytes{0x01, 0x2B, 0x0E, 0x01, 0x00, 0x70, 0x77}));
  EXPECT_EQ(bytes_of(raw_frame(Bytes{1, 2, 3})), (Bytes{1, 2, 3}));
  EXPECT_THROW(write_multiple_registers(1, 0, std::vector<std::uint16_t>(128)), std::invalid_argument);
}

TEST(ModbusHost, SendsTheRequestAndDecodesRegisters) {
  Scripted bench;
  const ModbusResult result =
      bench.transact(read_holding_registers(1, 0, 2), closed({1, 3, 4, 0x12, 0x34, 0xFF, 0xFE}));
  EXPECT_EQ(result.outcome, ModbusOutcome::data) << result.problem;
  EXPECT_THAT(result.registers, ElementsAre(0x1234, 0xFFFE));
  ASSERT_EQ(bench.heard.size(), 1U);
  EXPECT_EQ(bench.heard[0].bytes, (Bytes{0x01, 0x03, 0x00, 0x00, 0x00, 0x02, 0xC4, 0x0B}));
}

TEST(ModbusHost, DecodesEachFunction) {
  Scripted bench;
  EXPECT_THAT(bench.transact(read_input_registers(1, 5, 1), closed({1, 4, 2, 0, 7})).registers,
              ElementsAre(7));
  EXPECT_EQ(bench.transact(write_single_register(1, 2, 3), closed({1, 6, 0, 2, 0, 3})).outcome,
            ModbusOutcome::data);
  EXPECT_EQ(bench
                .transact(write_multiple_registers(1, 2, std::vector<std::uint16_t>{4, 5}),
                          closed({1, 16, 0, 2, 0, 2}))
                .outcome,
            ModbusOutcome::data);
  EXPECT_EQ(bench.transact(diagnostic_echo(1, 0xA537), closed({1, 8, 0, 0, 0xA5, 0x37})).outcome,
            ModbusOutcome::data);
  EXPECT_THAT(bench.transact(report_server_id(1), closed({1, 17, 3, 'M', 'S', 0xFF})).data,
              ElementsAre('M', 'S', 0xFF));
  const ModbusResult identity = bench.transact(read_device_identification(1, 1, 0),
                                               closed({1, 43, 14, 1, 1, 0, 0, 2, 0, 2, 'A', 'B', 1, 1, 'C'}));
  EXPECT_EQ(identity.outcome, ModbusOutcome::data) << identity.problem;
  ASSERT_EQ(identity.objects.size(), 2U);
  EXPECT_EQ(identity.objects[0].value, "AB");
  EXPECT_EQ(identity.objects[1].id, 1);
  EXPECT_EQ(identity.objects[1].value, "C");
}

TEST(ModbusHost, ExceptionCarriesItsCode) {
  Scripted bench;
  const ModbusResult result = bench.transact(read_holding_registers(1, 0x900, 1), closed({1, 0x83, 2}));
  EXPECT_EQ(result.outcome, ModbusOutcome::exception);
  EXPECT_EQ(result.function, 3);
  EXPECT_EQ(result.exception_code, 2);
}

TEST(ModbusHost, SilenceIsATimeoutAfterTheSetTime) {
  Scripted bench;
  const ModbusResult result = bench.transact(read_holding_registers(1, 0, 1), {});
  EXPECT_EQ(result.outcome, ModbusOutcome::timeout);
  EXPECT_EQ(result.function, 3);
  EXPECT_NEAR(static_cast<double>(bench.cycle - result.request_end_cycle), 0.02 * kLine.clock_hz, 5.0);
}

TEST(ModbusHost, BroadcastExpectsSilence) {
  Scripted bench;
  EXPECT_EQ(bench.transact(write_single_register(0, 1, 2), {}).outcome, ModbusOutcome::broadcast);
  const ModbusResult answered = bench.transact(write_single_register(0, 1, 2), closed({0, 6, 0, 1, 0, 2}));
  EXPECT_EQ(answered.outcome, ModbusOutcome::malformed);
}

struct BadReply {
  Bytes frame;
  const char* problem;
};

class MalformedReply : public ::testing::TestWithParam<BadReply> {};

TEST_P(MalformedReply, IsNamed) {
  Scripted bench;
  const ModbusResult result = bench.transact(read_holding_registers(1, 0, 2), GetParam().frame);
  EXPECT_EQ(result.outcome, ModbusOutcome::malformed);
  EXPECT_THAT(result.problem, ::testing::HasSubstr(GetParam().problem));
}

INSTANTIATE_TEST_SUITE_P(Kinds, MalformedReply,
                         ::testing::Values(BadReply{{1, 3, 4, 0, 0, 0, 0, 0x12, 0x34}, "CRC"},
                                           BadReply{{1, 3, 4}, "3 bytes"},
                                           BadReply{closed({2, 3, 4, 0, 0, 0, 0}), "unit 2"},
                                           BadReply{closed({1, 4, 4, 0, 0, 0, 0}), "function 4"},
                                           BadReply{closed({1, 3, 2, 0, 0, 0, 0}), "byte count"},
                                           BadReply{closed({1, 3, 2, 0, 0}), "1 registers"},
                                           BadReply{closed({1, 0x83, 2, 0}), "exception"}));

TEST(ModbusHost, ChangedEchoIsMalformed) {
  Scripted bench;
  EXPECT_EQ(bench.transact(write_single_register(1, 2, 3), closed({1, 6, 0, 2, 0, 4})).outcome,
            ModbusOutcome::malformed);
  EXPECT_EQ(bench.transact(diagnostic_echo(1, 7), closed({1, 8, 0, 0, 0, 8})).outcome,
            ModbusOutcome::malformed);
}

TEST(ModbusHost, DeviceIdentificationOfTheWrongLengthIsMalformed) {
  Scripted bench;
  const ModbusRequest request = read_device_identification(1, 1, 0);
  EXPECT_EQ(bench.transact(request, closed({1, 43, 14, 1, 1, 0, 0, 1, 0, 9, 'A', 'B'})).outcome,
            ModbusOutcome::malformed);
  EXPECT_EQ(bench.transact(request, closed({1, 43, 14, 1, 1, 0, 0, 1, 0, 1, 'A', 'B'})).outcome,
            ModbusOutcome::malformed);
}

TEST(ModbusHost, ParityErrorInTheReplyIsMalformed) {
  Scripted bench;
  ModbusRequest reply = raw_frame(closed({1, 3, 2, 0, 9}));
  reply.frame[3].wrong_parity = true;
  bench.host.submit(read_holding_registers(1, 0, 1));
  bench.run(30000);
  for (const UartChar& character : reply.frame) bench.transmitter.send(character);
  bench.run(40000);
  const auto result = bench.host.take_result();
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->outcome, ModbusOutcome::malformed);
  EXPECT_THAT(result->problem, ::testing::HasSubstr("parity"));
}

TEST(ModbusHost, FramesAreApartByThreeAndAHalfCharacters) {
  Scripted bench;
  for (int i = 0; i < 3; ++i) {
    bench.replies.push_back(closed({1, 3, 2, 0, 1}));
    bench.host.submit(read_holding_registers(1, 0, 1));
  }
  bench.run(400000);
  std::vector<ModbusResult> results;
  while (const auto result = bench.host.take_result()) results.push_back(*result);
  ASSERT_EQ(results.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(results[i].outcome, ModbusOutcome::data);
    EXPECT_GT(results[i].reply_start_cycle, results[i].request_end_cycle);
    if (i > 0) {
      EXPECT_GE(results[i].request_start_cycle - results[i - 1].reply_end_cycle, 17500U);
    }
  }
}

TEST(ModbusHost, RequestsStayApartEvenWithAShortTimeout) {
  Scripted bench({.line = kLine, .timing = {}, .timeout_s = 1e-4, .broadcast_delay_s = 0.01});
  bench.host.submit(read_holding_registers(1, 0, 1));
  bench.host.submit(read_holding_registers(1, 0, 1));
  bench.run(100000);
  const auto first = bench.host.take_result();
  const auto second = bench.host.take_result();
  ASSERT_TRUE(first && second);
  EXPECT_GE(second->request_start_cycle - first->request_end_cycle, 17500U);
}

TEST(RtuFrameReceiver, ExactlyTheSilenceSeparatesFrames) {
  const UartLine line{.clock_hz = 10.0e6, .baud = 50000.0, .format = k8E1};  // 200 cycles a bit
  const auto frames_at = [&](double gap_bits) {
    UartTransmitter transmitter(line, {}, stream(1, "line"));
    RtuFrameReceiver receiver(line);
    transmitter.send({.data = 1});
    transmitter.send({.data = 2, .gap_bits = gap_bits});
    for (std::uint64_t cycle = 0; cycle < 60000; ++cycle) receiver.step(cycle, transmitter.step(cycle));
    int frames = 0;
    while (receiver.take()) ++frames;
    return frames;
  };
  EXPECT_EQ(frames_at(87.0), 1);
  EXPECT_EQ(frames_at(87.5), 2);
  EXPECT_EQ(frames_at(88.0), 2);
}

TEST(ModbusHost, CharactersOfARequestCanBeSpoiled) {
  Scripted bench;
  ModbusRequest request = read_holding_registers(1, 0, 1);
  request.frame[2].wrong_parity = true;
  request.frame[4].gap_bits = 250.0;  // more than 1.75 ms at 115200
  bench.transact(request, {});
  ASSERT_EQ(bench.heard.size(), 2U);
  EXPECT_EQ(bench.heard[0].bytes.size(), 4U);
  EXPECT_TRUE(bench.heard[0].line_error);
  EXPECT_EQ(bench.heard[1].bytes.size(), 4U);
  EXPECT_FALSE(bench.heard[1].line_error);
}

TEST(ModbusHost, UnaskedFramesAreCountedAndDropped) {
  Scripted bench;
  for (const std::uint8_t byte : closed({1, 4, 2, 0, 1})) bench.transmitter.send({.data = byte});
  bench.run(50000);
  EXPECT_EQ(bench.host.stray_frames(), 1U);
  EXPECT_THAT(bench.transact(read_input_registers(1, 0, 1), closed({1, 4, 2, 0, 2})).registers,
              ElementsAre(2));
}

TEST(ModbusHost, SkippingBetweenEventsGivesTheSameCycles) {
  Scripted stepped;
  const ModbusResult expected = stepped.transact(read_holding_registers(1, 0, 1), closed({1, 3, 2, 0, 9}));
  Scripted skipping;
  skipping.replies.push_back(closed({1, 3, 2, 0, 9}));
  skipping.host.submit(read_holding_registers(1, 0, 1));
  unsigned steps = 0;
  while (skipping.host.busy() && steps < 10000) {
    skipping.step();
    ++steps;
    const std::uint64_t next = std::min(
        {skipping.host.next_event(), skipping.transmitter.next_event(), skipping.listener.next_event()});
    skipping.cycle = std::max(skipping.cycle + 1, next);
  }
  const auto result = skipping.host.take_result();
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->outcome, ModbusOutcome::data);
  EXPECT_EQ(result->request_end_cycle, expected.request_end_cycle);
  EXPECT_EQ(result->reply_start_cycle, expected.reply_start_cycle);
  EXPECT_EQ(result->reply_end_cycle, expected.reply_end_cycle);
  EXPECT_LT(steps, 1000U);
}

TEST(TelemetryListener, DecodesGoodFramesAndCountsBadOnes) {
  UartTransmitter transmitter(kLine, {.baud_error_ratio = 0.02}, stream(1, "tlm"));
  TelemetryListener listener(kLine);
  const auto send = [&](const Bytes& frame) {
    for (std::size_t i = 0; i < frame.size(); ++i)
      transmitter.send({.data = frame[i], .gap_bits = i == 0 ? 300.0 : 0.0});
  };
  send(closed({7, 4, 4, 0x00, 0x81, 0x04, 0xE2}));
  send({7, 4, 2, 0, 1, 0, 0});
  send(closed({7, 3, 2, 0, 1}));
  send(closed({7, 4, 3, 0, 1, 2}));
  send(closed({7, 4, 2, 0x12, 0x34}));
  for (std::uint64_t cycle = 0; cycle < 400000; ++cycle) listener.step(cycle, transmitter.step(cycle));
  EXPECT_EQ(listener.good_frames(), 2U);
  EXPECT_EQ(listener.bad_frames(), 3U);
  const auto first = listener.take();
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->unit, 7);
  EXPECT_THAT(first->registers, ElementsAre(0x0081, 0x04E2));
  EXPECT_THAT(listener.take()->registers, ElementsAre(0x1234));
  EXPECT_FALSE(listener.take().has_value());
}

}  // namespace
}  // namespace meltstage::tb
