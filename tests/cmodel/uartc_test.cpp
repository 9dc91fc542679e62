// SPDX-License-Identifier: Apache-2.0
// UARTC against waveforms made and read here, independently of the model's own receiver and transmitter.
#include "cmodel/uartc.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace meltstage::chip {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kClkHz = spec::kClkHz;
constexpr std::uint8_t kOwn = 17;

double bit_clocks(unsigned baud) { return kClkHz / (100.0 * baud); }

// CRC by the bit, as the Modbus specification words it; the model uses a table.
std::uint16_t crc_of(const Bytes& bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? (crc >> 1) ^ 0xA001u : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

Bytes sealed(Bytes bytes) {
  const std::uint16_t crc = crc_of(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFFu));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
  return bytes;
}

// Levels of one character, start bit first.
std::vector<int> char_levels(std::uint8_t byte, std::uint8_t format) {
  std::vector<int> levels{0};
  int ones = 0;
  for (int bit = 0; bit < 8; ++bit) {
    levels.push_back((byte >> bit) & 1);
    ones += (byte >> bit) & 1;
  }
  if (format == spec::kFormat8E1) levels.push_back(ones % 2);
  if (format == spec::kFormat8O1) levels.push_back(1 - ones % 2);
  levels.push_back(1);
  if (format == spec::kFormat8N2) levels.push_back(1);
  return levels;
}

struct Decoded {
  Bytes bytes;
  unsigned errors = 0;  // parity or stop bits
};

// An ideal receiver: samples the middle of each bit counted from the falling edge.
Decoded decode(const std::vector<std::uint8_t>& line, double bit, std::uint8_t format) {
  Decoded out;
  const auto at = [&](double clock) {
    const auto index = static_cast<std::size_t>(clock);
    return index < line.size() ? line[index] : std::uint8_t{1};
  };
  std::size_t clock = 0;
  while (clock < line.size()) {
    if (line[clock] != 0) {
      ++clock;
      continue;
    }
    const double start = static_cast<double>(clock);
    unsigned byte = 0;
    for (unsigned i = 0; i < 8; ++i) byte |= static_cast<unsigned>(at(start + (1.5 + i) * bit)) << i;
    const std::vector<int> levels = char_levels(static_cast<std::uint8_t>(byte), format);
    bool good = true;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      good = good && at(start + (0.5 + static_cast<double>(i)) * bit) == levels[i];
    }
    out.errors += good ? 0 : 1;
    out.bytes.push_back(static_cast<std::uint8_t>(byte));
    clock = static_cast<std::size_t>(start + (static_cast<double>(levels.size()) - 0.5) * bit);
  }
  return out;
}

// The port with a host on its line and a PARAMC behind it.
class Port {
 public:
  Uartc chip;
  UartcIn in;
  std::vector<std::uint8_t> tx_line, tlm_line, de_line;
  std::vector<std::uint64_t> stops, goods;  // clocks of the pulses
  std::uint64_t clock = 0;
  bool echo = false;    // the transceiver's receiver hears its own driver
  bool answers = true;  // commands are done at once with `kind`
  std::uint8_t kind = spec::kRspNone;
  std::uint8_t exc = 0;
  std::function<std::uint16_t(std::uint16_t)> reg = [](std::uint16_t address) {
    return static_cast<std::uint16_t>(address * 259u + 7u);
  };

  explicit Port(unsigned baud = 1152, std::uint8_t format = spec::kFormat8E1, std::uint8_t address = kOwn) {
    in.cfg_baud = static_cast<std::uint16_t>(baud);
    in.cfg_format = format;
    in.cfg_address = address;
    run(1);
  }

  double bit() const { return bit_clocks(chip.baud_q); }

  void run(std::uint64_t clocks) {
    for (std::uint64_t i = 0; i < clocks; ++i) clock_once();
  }
  void run_bits(double bits) { run(static_cast<std::uint64_t>(std::ceil(bits * bit()))); }

  // Holds the line at a level; fractions of a clock carry over, so that the host's bit time is exact in the
  // long run.
  void hold(int level, double clocks) {
    line_ = level;
    owed_ += clocks;
    const double whole = std::floor(owed_);
    owed_ -= whole;
    run(static_cast<std::uint64_t>(whole));
    line_ = 1;
  }

  void send_char(std::uint8_t byte, std::uint8_t format, double bit_time) {
    for (const int level : char_levels(byte, format)) hold(level, bit_time);
  }
  void send(const Bytes& bytes) { send(bytes, chip.format_q, bit()); }
  void send(const Bytes& bytes, std::uint8_t format, double bit_time) {
    for (const std::uint8_t byte : bytes) send_char(byte, format, bit_time);
  }

  // Silence until the port is at rest.
  void settle() {
    std::uint64_t guard = 0;
    do {
      run(16);
      ASSERT_LT(++guard, 1000000u) << "the port never comes to rest";
    } while (!chip.rx.idle() || chip.frame.open() || (answers && chip.cmd_valid()) || chip.rsp_busy() ||
             chip.tlm_busy());
  }

  // Sends a request and returns the answer's bytes.
  Bytes ask(const Bytes& request, std::uint8_t answer_kind) {
    kind = answer_kind;
    tx_line.clear();
    send(sealed(request));
    settle();
    const Decoded heard = decode(tx_line, bit(), chip.format_q);
    EXPECT_EQ(heard.errors, 0u);
    return heard.bytes;
  }

 private:
  int line_ = 1;
  double owed_ = 0;

  void clock_once() {
    in.rx = static_cast<std::uint8_t>(line_ & (echo ? static_cast<int>(chip.tx_o()) : 1));
    in.cmd_done = answers && chip.cmd_valid() && !in.cmd_done;
    in.rsp_kind = kind;
    in.rsp_exc = exc;
    in.rd_data = reg(chip.rd_addr());
    chip.step(in);
    in.tlm_start = false;
    ++clock;
    tx_line.push_back(chip.tx_o());
    tlm_line.push_back(chip.tlm_tx());
    de_line.push_back(chip.de());
    if (chip.stop()) stops.push_back(clock);
    if (chip.good()) goods.push_back(clock);
  }
};

const Bytes kReadTwo{kOwn, 0x03, 0x00, 0x00, 0x00, 0x02};
const Bytes kStop{kOwn, 0x06, 0x01, 0x00, 0x00, 0x00};

// Bytes of a text as they stand on the line.
Bytes text(std::string_view letters) { return {letters.begin(), letters.end()}; }

Bytes joined(Bytes left, const Bytes& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

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

// -- Every baud rate and format
// ---------------------------------------------------------------------------------------------

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

// -- Answers
// ----------------------------------------------------------------------------------------------------------------------

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

// -- Framing
// ------------------------------------------------------------------------------------------------------------------------

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
