// SPDX-License-Identifier: Apache-2.0
// SENSC against a bit-level SPI slave with the data sheets' example words, and its frame descriptions to
// their ends.
#include "cmodel/sensc.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <type_traits>
#include <vector>

namespace meltstage::chip {
namespace {

using spec::Reg;

constexpr std::uint16_t kDividers[] = {0, 2, 5, 255};

enum Sensor : std::uint16_t { kCustom, kMax31855, kMax6675, kMax31865, kAdt7320, kAdt7310, kLm70 };

// An SPI slave that shifts one word out and records what it is sent, both at the edges of its mode (CPHA 0:
// data before the leading edge; CPHA 1: data at the leading edge). Checks the master's clock on the way.
class Slave {
 public:
  explicit Slave(unsigned mode) : cpol_((mode & 2u) != 0), cpha_((mode & 1u) != 0) {}

  void answer(std::uint32_t word, unsigned length) {
    word_ = word;
    length_ = length;
  }
  void look(bool cs_n, bool sclk, bool mosi) {
    ++clock_;
    if (cs_n != cs_n_) {
      EXPECT_EQ(sclk, cpol_) << "chip select moves while the clock idles";
      EXPECT_EQ(sclk_, cpol_) << "chip select moves while the clock idles";
    }
    if (cs_n_ && !cs_n) begin();
    if (!cs_n_ && cs_n) end();
    if (!cs_n && !cs_n_ && sclk != sclk_) clock_edge(sclk != cpol_, mosi);
    if (cs_n) {
      EXPECT_FALSE(mosi);
      miso_ = true;  // pulled up
    }
    cs_n_ = cs_n;
    sclk_ = sclk;
  }
  bool miso() const { return miso_; }

  struct Frame {
    std::uint64_t sent = 0;  // MOSI, last bit right
    unsigned bits = 0;
    std::uint64_t high_before = 0;  // clocks of chip select high before the frame
    std::uint64_t lead = 0, lag = 0, shortest = ~0ull, longest = 0;
  };
  std::vector<Frame> frames;

 private:
  void begin() {
    frames.emplace_back();
    frames.back().high_before = clock_ - change_;
    change_ = clock_;
    shifted_ = 0;
    if (!cpha_) drive();
  }
  void end() {
    frames.back().lag = clock_ - change_;
    change_ = clock_;
  }
  void clock_edge(bool leading, bool mosi) {
    Frame& f = frames.back();
    const std::uint64_t since = clock_ - change_;
    change_ = clock_;
    if (f.lead == 0) {
      f.lead = since;
    } else {
      f.shortest = std::min(f.shortest, since);
      f.longest = std::max(f.longest, since);
    }
    if (leading != cpha_) {
      f.sent = f.sent << 1 | (mosi ? 1u : 0u);
      ++f.bits;
    } else {
      drive();
    }
  }
  void drive() {
    ++shifted_;
    miso_ = shifted_ > length_ || (word_ >> (length_ - shifted_) & 1u) != 0;
  }

  bool cpol_, cpha_;
  std::uint32_t word_ = 0;
  unsigned length_ = 32;
  unsigned shifted_ = 0;
  bool cs_n_ = true, miso_ = true;
  bool sclk_ = cpol_;
  std::uint64_t clock_ = 0, change_ = 0;
};

struct Bench {
  Params params;
  Sensc sensc;
  bool stage = true, miso = true;  // the pin one and two clocks ago
  Slave slave;
  unsigned read_clocks = 0;

  explicit Bench(std::uint16_t type, const std::vector<std::pair<Reg, std::uint16_t>>& values = {})
      : slave(0) {
    for (unsigned i = 1; i < spec::kHoldingCount; ++i) {
      params.value[i] = static_cast<std::uint16_t>(spec::kHolding[i].reset);
    }
    params.value[spec::kRegSensType] = type;
    for (const auto& [reg, value] : values) params.value[reg] = value;
    slave = Slave(sensor_frame(params).mode);
    sensc.step({.params = params});  // the clock takes its idle level
  }
  void clock(bool start = false, bool reconfig = false) {
    const SenscIn in{.params = params, .start = start, .reconfig = reconfig, .miso = miso};
    miso = stage;
    stage = slave.miso();
    sensc.step(in);
    slave.look(sensc.cs_n(), sensc.sclk(), sensc.mosi());
  }
  // A whole read with this answer; the temperature in degC.
  double read(std::uint32_t word) {
    slave.answer(word, sensor_frame(params).length);
    clock(true);
    EXPECT_TRUE(sensc.busy());
    for (read_clocks = 1; !sensc.done(); ++read_clocks) {
      clock();
      if (read_clocks > 40000) {
        ADD_FAILURE() << "read does not end";
        break;
      }
    }
    EXPECT_FALSE(sensc.busy());
    return sensc.pv() / 64.0;
  }
};

struct Example {
  Sensor sensor;
  std::uint32_t word;
  double degc;
};

class DataSheet : public ::testing::TestWithParam<Example> {};

TEST_P(DataSheet, WordBecomesItsTemperature) {
  Bench bench(GetParam().sensor);
  EXPECT_DOUBLE_EQ(bench.read(GetParam().word), GetParam().degc);
  EXPECT_EQ(bench.sensc.raw(), GetParam().word);
  EXPECT_TRUE(bench.sensc.ok());
  EXPECT_FALSE(bench.sensc.dev_fault());
  EXPECT_FALSE(bench.sensc.frame_bad());
}

// Maxim 19-4793 table 4 (thermocouple field in D31..D18), with a cold junction of 25 degC in D15..D4. Its
// 1600 degC is beyond Q9.6 and is held at the end of the range.
INSTANTIATE_TEST_SUITE_P(Max31855, DataSheet,
                         ::testing::Values(Example{kMax31855, 0b01100100000000u << 18 | 0x1900, 32767 / 64.0},
                                           Example{kMax31855, 0b00111110100000u << 18 | 0x1900, 32767 / 64.0},
                                           Example{kMax31855, 0b00011111111111u << 18 | 0x1900, 511.75},
                                           Example{kMax31855, 0b00000110010011u << 18 | 0x1900, 100.75},
                                           Example{kMax31855, 0x01900000, 25.0},
                                           Example{kMax31855, 0b00000000000000u << 18 | 0x1900, 0.0},
                                           Example{kMax31855, 0b11111111111111u << 18 | 0x1900, -0.25},
                                           Example{kMax31855, 0b11111111111100u << 18 | 0x1900, -1.0},
                                           Example{kMax31855, 0b11110000011000u << 18 | 0x1900, -250.0}));
// Maxim 19-2235: D14..D3, 0.25 degC, unsigned, 1023.75 degC full scale.
INSTANTIATE_TEST_SUITE_P(Max6675, DataSheet,
                         ::testing::Values(Example{kMax6675, 100u << 3, 25.0},
                                           Example{kMax6675, 1u << 3, 0.25},
                                           Example{kMax6675, 1000u << 3, 250.0},
                                           Example{kMax6675, 4095u << 3, 32767 / 64.0}));
// Maxim 19-6478 table 9: RTD codes of 0 and 100 degC; T = code/32 - 256 gives 98.59 for the latter. Behind
// the address byte.
INSTANTIATE_TEST_SUITE_P(Max31865, DataSheet,
                         ::testing::Values(Example{kMax31865, 8192u << 1, 0.0},
                                           Example{kMax31865, 0x2C53u << 1, 98.59375},
                                           Example{kMax31865, 1u << 1, 1 / 32.0 - 256.0}));
// Analog Devices ADT7320, table 5 (16 bits): -40, -0.0078, 0.0078, 25, 105, 150 degC.
INSTANTIATE_TEST_SUITE_P(Adt7320, DataSheet,
                         ::testing::Values(Example{kAdt7320, 0xEC00, -40.0},
                                           Example{kAdt7320, 0xFFFF, -1 / 64.0},
                                           Example{kAdt7320, 0x0001, 0.0}, Example{kAdt7320, 0x0C80, 25.0},
                                           Example{kAdt7320, 0x3480, 105.0}, Example{kAdt7320, 0x4B00, 150.0},
                                           Example{kAdt7310, 0x4B00, 150.0},
                                           Example{kAdt7310, 0xE480, -55.0}));
// TI LM70, table 1: 11 bits in D15..D5, D4..D2 read one.
INSTANTIATE_TEST_SUITE_P(Lm70, DataSheet,
                         ::testing::Values(Example{kLm70, 0x4B1F, 150.0}, Example{kLm70, 0x3E9F, 125.0},
                                           Example{kLm70, 0x0C9F, 25.0}, Example{kLm70, 0x003C, 0.25},
                                           Example{kLm70, 0x001F, 0.0}, Example{kLm70, 0xFFFC, -0.25},
                                           Example{kLm70, 0xF39F, -25.0}, Example{kLm70, 0xE49F, -55.0}));

// The TC77 is no preset: Microchip DS20092, 13 bits of 1/16 degC in D15..D3, D2 is 1 once a conversion is
// complete, D1..D0 are undriven (here low). The registers are those of docs/chip/blocks/sensc.md, the words
// those of the data sheet's table.
TEST(Sensc, DescriptionOfASensorThatIsNoPreset) {
  Bench tc77(kCustom, {{spec::kRegSensFrame, 0x2310},
                       {spec::kRegSensData, 0x000D},
                       {spec::kRegSensScale, 0x0400},
                       {spec::kRegSensFaultMask, 0},
                       {spec::kRegSensCheckMaskH, 0},
                       {spec::kRegSensCheckMaskL, 0x0004},
                       {spec::kRegSensCheckValueL, 0x0004}});
  const std::pair<std::uint32_t, double> words[] = {{0x3E84, 125.0}, {0x0C84, 25.0},    {0x000C, 0.0625},
                                                    {0x0004, 0.0},   {0xFFFC, -0.0625}, {0xF384, -25.0},
                                                    {0xE484, -55.0}};
  for (const auto& [word, degc] : words) {
    EXPECT_DOUBLE_EQ(tc77.read(word), degc);
    EXPECT_TRUE(tc77.sensc.ok()) << degc;
  }
  EXPECT_EQ(tc77.read_clocks, (5 + 2 * 16) * 6 + 2u);
  EXPECT_EQ(tc77.slave.frames.back().bits, 16u);
  tc77.read(0x0C80);
  EXPECT_TRUE(tc77.sensc.frame_bad()) << "the first conversion is not complete";
  tc77.read(0);
  EXPECT_TRUE(tc77.sensc.frame_bad()) << "a line stuck low";
  tc77.read(0xFFFF);
  EXPECT_TRUE(tc77.sensc.frame_bad()) << "a line stuck high";
}

TEST(Sensc, Max31855OpenAndShortAreDeviceFaults) {
  for (const unsigned bit : {0u, 1u, 2u}) {
    Bench bench(kMax31855);
    bench.read(0x01900000u | 1u << bit);
    EXPECT_TRUE(bench.sensc.dev_fault());
    EXPECT_FALSE(bench.sensc.ok());
  }
}

TEST(Sensc, ReservedBitsMakeABadFrame) {
  for (const unsigned bit : {3u, 17u}) {
    Bench bench(kMax31855);
    bench.read(0x01900000u | 1u << bit);
    EXPECT_TRUE(bench.sensc.frame_bad());
    EXPECT_FALSE(bench.sensc.dev_fault());
  }
  for (const unsigned bit : {2u, 3u, 4u}) {
    Bench bench(kLm70);
    bench.read(0x0C9Fu & ~(1u << bit));
    EXPECT_TRUE(bench.sensc.frame_bad()) << bit;
  }
}

TEST(Sensc, FaultBitsOfTheOtherPresets) {
  Bench max6675(kMax6675);
  max6675.read(100u << 3 | 4);
  EXPECT_TRUE(max6675.sensc.dev_fault());
  Bench max31865(kMax31865);
  max31865.read(8192u << 1 | 1);
  EXPECT_TRUE(max31865.sensc.dev_fault());
}

TEST(Sensc, LineStuckHighIsABadFrameForEveryPreset) {
  for (std::uint16_t type = 1; type <= 6; ++type) {
    Bench bench(type);
    bench.read(0xFFFFFFFF);
    EXPECT_TRUE(bench.sensc.frame_bad()) << spec::kSensorPresets[type].name;
  }
}

TEST(Sensc, SecondAllZeroFrameInARowIsBad) {
  Bench bench(kMax31855);
  EXPECT_EQ(bench.read(0), 0.0);
  EXPECT_TRUE(bench.sensc.ok());
  bench.read(0);
  EXPECT_TRUE(bench.sensc.frame_bad());
  bench.read(0);
  EXPECT_TRUE(bench.sensc.frame_bad());
  bench.read(0x1900);
  EXPECT_TRUE(bench.sensc.ok());
  bench.read(0);
  EXPECT_TRUE(bench.sensc.ok());
}

TEST(Sensc, FirstBytesAreSentAsThePresetSays) {
  for (std::uint16_t type = 1; type <= 6; ++type) {
    Bench bench(type);
    bench.read(0x0C9F);
    const SensorFrame f = sensor_frame(bench.params);
    const auto& frames = bench.slave.frames;
    ASSERT_EQ(frames.size(), f.setup != 0 ? 2u : 1u);
    if (f.setup != 0) {
      EXPECT_EQ(frames.front().bits, 16u);
      EXPECT_EQ(frames.front().sent, f.setup);
    }
    EXPECT_EQ(frames.back().bits, f.length);
    EXPECT_EQ(frames.back().sent, std::uint64_t{f.tx} << (f.length - 8));
  }
}

TEST(Sensc, ClockTimingInEveryModeAndDivider) {
  for (std::uint16_t mode = 0; mode < 4; ++mode) {
    for (const std::uint16_t div : kDividers) {
      Bench bench(kCustom, {{spec::kRegSensFrame, static_cast<std::uint16_t>(0x2000 | mode << 6 | 16)},
                            {spec::kRegSensData, 0xA510},
                            {spec::kRegSensScale, 256},
                            {spec::kRegSensSetup, 0x9C41},
                            {spec::kRegSpiDiv, div}});
      const std::uint64_t half = std::max<unsigned>(div, 2) + 1u;
      EXPECT_DOUBLE_EQ(bench.read(0x8421), static_cast<std::int16_t>(0x8421) / 64.0) << "mode " << mode;
      ASSERT_EQ(bench.slave.frames.size(), 2u);
      EXPECT_EQ(bench.slave.frames[0].sent, 0x9C41u);
      EXPECT_EQ(bench.slave.frames[1].sent, 0xA500u);
      for (const Slave::Frame& f : bench.slave.frames) {
        EXPECT_EQ(f.bits, 16u);
        EXPECT_EQ(f.lead, half);
        EXPECT_EQ(f.lag, half);
        EXPECT_EQ(f.shortest, half);
        EXPECT_EQ(f.longest, half);
        EXPECT_GE(f.high_before, 4 * half);
      }
      EXPECT_EQ(bench.read_clocks, 2 * (4 + 33) * half + 2);
    }
  }
}

TEST(Sensc, SetUpGoesOutAfterResetReconfigurationAndBadFrames) {
  Bench bench(kMax31865);
  const auto frames_of_read = [&](std::uint32_t word) {
    const std::size_t before = bench.slave.frames.size();
    bench.read(word);
    return bench.slave.frames.size() - before;
  };
  EXPECT_EQ(frames_of_read(8192u << 1), 2u);
  EXPECT_EQ(frames_of_read(8192u << 1), 1u);
  bench.clock(false, true);
  EXPECT_EQ(frames_of_read(8192u << 1), 2u);
  EXPECT_EQ(frames_of_read(8192u << 1 | 1), 1u);  // device fault
  EXPECT_EQ(frames_of_read(0xFFFFFFFF), 2u);      // stuck line
  EXPECT_EQ(frames_of_read(8192u << 1), 2u);
  EXPECT_EQ(frames_of_read(8192u << 1), 1u);
}

TEST(Sensc, ReconfigurationDuringAReadCountsForTheNext) {
  Bench bench(kMax31865);
  bench.slave.answer(8192u << 1, 24);
  bench.clock(true, true);
  while (!bench.sensc.done()) bench.clock();
  bench.read(8192u << 1);
  EXPECT_EQ(bench.slave.frames.size(), 4u);
  bench.read(8192u << 1);
  EXPECT_EQ(bench.slave.frames.size(), 5u);
}

TEST(Sensc, EveryFieldPlaceAndWidth) {
  for (unsigned low = 0; low < 32; ++low) {
    for (unsigned width = 1; width <= 16 && low + width <= 32; ++width) {
      for (const bool is_signed : {false, true}) {
        const auto frame = static_cast<std::uint16_t>((is_signed ? 0x2000u : 0u) | low << 8 | 32u);
        Bench bench(kCustom, {{spec::kRegSensFrame, frame},
                              {spec::kRegSensData, static_cast<std::uint16_t>(width)},
                              {spec::kRegSensScale, 64},
                              {spec::kRegSensFaultMask, 0},
                              {spec::kRegSensCheckMaskH, 0},
                              {spec::kRegSensCheckMaskL, 0},
                              {spec::kRegSpiDiv, 2}});
        const std::uint32_t word = 0x96A5C3B2;
        std::int64_t field = word >> low & ((1u << width) - 1u);
        if (is_signed && (field >> (width - 1) & 1) != 0) field -= std::int64_t{1} << width;
        bench.read(word);
        ASSERT_EQ(bench.sensc.pv(), field >> 2) << low << ' ' << width;
      }
    }
  }
}

TEST(Sensc, LengthAndWidthOutsideTheirRangeCountAsTheLargest) {
  for (const unsigned length : {0u, 33u, 63u}) {
    Bench bench(kCustom, {{spec::kRegSensFrame, static_cast<std::uint16_t>(length)}});
    bench.read(0x12345678);
    EXPECT_EQ(bench.slave.frames.back().bits, 32u);
    EXPECT_EQ(bench.sensc.raw(), 0x12345678u);
  }
  for (const unsigned width : {0u, 17u, 31u}) {
    Bench bench(kCustom, {{spec::kRegSensFrame, 32},
                          {spec::kRegSensData, static_cast<std::uint16_t>(width)},
                          {spec::kRegSensScale, 128}});
    bench.read(0x00019000);
    EXPECT_EQ(bench.sensc.pv(), 0x4800);
  }
  Bench one(kCustom, {{spec::kRegSensFrame, 1},
                      {spec::kRegSensData, 1},
                      {spec::kRegSensScale, 2560},
                      {spec::kRegSensCheckMaskH, 0},
                      {spec::kRegSensCheckMaskL, 0},
                      {spec::kRegSensFaultMask, 0}});
  one.read(1);
  EXPECT_EQ(one.sensc.pv(), 10);
  EXPECT_EQ(one.slave.frames.back().bits, 1u);
}

TEST(Sensc, ScaleRoundsTowardMinusInfinity) {
  Bench bench(kCustom, {{spec::kRegSensFrame, 0x2010}, {spec::kRegSensData, 16}, {spec::kRegSensScale, 1}});
  bench.read(0xFFFF);  // all ones: a bad frame, but its value is shown
  EXPECT_EQ(bench.sensc.pv(), -1);
  bench.read(0xFF00);
  EXPECT_EQ(bench.sensc.pv(), -1);
  bench.read(0xFEFF);
  EXPECT_EQ(bench.sensc.pv(), -2);
  bench.read(0x00FF);
  EXPECT_EQ(bench.sensc.pv(), 0);
  bench.read(0x0100);
  EXPECT_EQ(bench.sensc.pv(), 1);
}

TEST(Sensc, ResultSaturatesAtBothEnds) {
  Bench bench(kCustom,
              {{spec::kRegSensFrame, 0x2010}, {spec::kRegSensData, 16}, {spec::kRegSensScale, 0xFFFF}});
  bench.read(0x7FFF);
  EXPECT_EQ(bench.sensc.pv(), 32767);
  bench.read(0x8000);
  EXPECT_EQ(bench.sensc.pv(), -32768);
}

TEST(Sensc, OffsetAndTrimAreAdded) {
  Bench bench(kCustom, {{spec::kRegSensFrame, 0x2010},
                        {spec::kRegSensData, 16},
                        {spec::kRegSensScale, 256},
                        {spec::kRegSensOffset, static_cast<std::uint16_t>(-1000)},
                        {spec::kRegSensTrim, 2047}});
  bench.read(100);
  EXPECT_EQ(bench.sensc.pv(), 100 - 1000 + 2047);
  bench.params.value[spec::kRegSensTrim] = static_cast<std::uint16_t>(-2048);
  bench.read(100);
  EXPECT_EQ(bench.sensc.pv(), 100 - 1000 - 2048);
  Bench preset(kMax31855);
  preset.params.value[spec::kRegSensTrim] = 64;
  EXPECT_DOUBLE_EQ(preset.read(0x01900000), 26.0) << "the trim holds for presets too";
}

TEST(Sensc, ResetRegistersDescribeTheMax31855) {
  const Bench custom(kCustom);
  const Bench preset(kMax31855);
  const SensorFrame a = sensor_frame(custom.params);
  const SensorFrame b = sensor_frame(preset.params);
  EXPECT_EQ(a.length, b.length);
  EXPECT_EQ(a.mode, b.mode);
  EXPECT_EQ(a.field_low, b.field_low);
  EXPECT_EQ(a.field_end, b.field_end);
  EXPECT_EQ(a.scale, b.scale);
  EXPECT_EQ(a.check_mask, b.check_mask);
  EXPECT_EQ(a.fault_mask, b.fault_mask);
}

TEST(Sensc, ResultsHoldUntilTheNextDone) {
  Bench bench(kMax31855);
  bench.read(0x01900000);
  bench.slave.answer(0x06400000, 32);
  bench.clock(true);
  while (!bench.sensc.done()) {
    ASSERT_EQ(bench.sensc.pv(), 25 * 64);
    ASSERT_EQ(bench.sensc.raw(), 0x01900000u);
    bench.clock();
  }
  EXPECT_EQ(bench.sensc.pv(), 100 * 64);
}

TEST(Sensc, StartWhileBusyIsIgnoredAndDoneIsOnePulse) {
  Bench bench(kMax31855);
  bench.slave.answer(0x01900000, 32);
  bench.clock(true);
  int pulses = 0;
  for (int i = 0; i < 2000; ++i) {
    bench.clock(bench.sensc.busy() && i < 400);
    pulses += bench.sensc.done() ? 1 : 0;
  }
  EXPECT_EQ(pulses, 1);
  EXPECT_EQ(bench.slave.frames.size(), 1u);
}

TEST(Sensc, IllegalStateFallsToIdleWithChipSelectHigh) {
  for (unsigned code = 0; code < 16; ++code) {
    if (code == 0b0000 || code == 0b0011 || code == 0b0101 || code == 0b0110 || code == 0b1001) continue;
    Bench bench(kMax31855);
    bench.clock(true);
    for (int i = 0; i < 60; ++i) bench.clock();
    ASSERT_FALSE(bench.sensc.cs_n());
    bench.sensc.state_q = static_cast<std::uint8_t>(code);
    bench.sensc.step({.params = bench.params});
    EXPECT_FALSE(bench.sensc.busy());
    EXPECT_TRUE(bench.sensc.cs_n());
    EXPECT_FALSE(bench.sensc.sclk());
    EXPECT_FALSE(bench.sensc.mosi());
  }
}

TEST(Sensc, StateIsTriviallyCopyable) { EXPECT_TRUE(std::is_trivially_copyable_v<Sensc>); }

}  // namespace
}  // namespace meltstage::chip
