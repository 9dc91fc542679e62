// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/spi_sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

namespace meltstage::tb {
namespace {

constexpr double kClock_hz = 1.0e6;
constexpr std::uint64_t kSecond = 1000000;

// A master on the pins: one clock half-period is 4 cycles, MISO is taken just before the sampling edge.
class Master {
 public:
  Master(SpiSensor& sensor, int mode)
      : sensor_(sensor), idle_((mode & 2) != 0), second_edge_((mode & 1) != 0) {
    sclk_ = idle_;
    idle(1);
  }

  void idle(std::uint64_t cycles) {
    const std::uint64_t end = cycle_ + cycles;
    while (cycle_ < end) {
      sensor_.step(cycle_, true, sclk_, false);
      cycle_ = std::min(end, std::max(cycle_ + 1, sensor_.next_event()));
    }
  }

  void select() { hold(false); }
  void release() { hold(true); }

  // Exchanges `bits` bits, most significant first, inside a selected frame.
  std::uint64_t exchange(unsigned bits, std::uint64_t out = 0) {
    std::uint64_t in = 0;
    for (unsigned i = bits; i-- > 0;) {
      const bool bit = (out >> i & 1U) != 0;
      if (!second_edge_) {
        mosi_ = bit;
        hold(false);
        in = in << 1 | (sensor_.miso() ? 1U : 0U);
        sclk_ = !idle_;
        hold(false);
        sclk_ = idle_;
        hold(false);
      } else {
        sclk_ = !idle_;
        sensor_.step(cycle_++, false, sclk_, mosi_);
        mosi_ = bit;
        hold(false);
        in = in << 1 | (sensor_.miso() ? 1U : 0U);
        sclk_ = idle_;
        hold(false);
      }
    }
    return in;
  }

  std::uint64_t frame(unsigned bits, std::uint64_t out = 0) {
    select();
    const std::uint64_t in = exchange(bits, out);
    release();
    return in;
  }
  std::uint64_t cycle() const { return cycle_; }

 private:
  void hold(bool cs_n) {
    for (int i = 0; i < 4; ++i) sensor_.step(cycle_++, cs_n, sclk_, mosi_);
  }
  SpiSensor& sensor_;
  bool idle_;
  bool second_edge_;
  bool sclk_ = false;
  bool mosi_ = false;
  std::uint64_t cycle_ = 0;
};

SpiSensorConfig fixed(double degc) {
  return {.clock_hz = kClock_hz, .source = [degc](std::uint64_t) { return degc; }};
}

// A source that rises by one degree a second.
SpiSensorConfig ramp() {
  return {.clock_hz = kClock_hz, .source = [](std::uint64_t cycle) {
            return static_cast<double>(cycle) / static_cast<double>(kSecond);
          }};
}

// ------------------------------------------------------------------------------------------------------
// MAX31855

TEST(Max31855, WordsOfTheDataSheet) {
  const std::vector<std::pair<double, std::uint32_t>> thermocouple{
      {1600.0, 0x1900}, {1000.0, 0x0FA0}, {100.75, 0x0193}, {25.0, 0x0064},
      {0.0, 0x0000},    {-0.25, 0x3FFF},  {-1.0, 0x3FFC},   {-250.0, 0x3C18}};
  for (const auto& [degc, code] : thermocouple) {
    EXPECT_EQ(max31855_word(degc, 0.0, ProbeFault::none), code << 18) << degc;
  }
  const std::vector<std::pair<double, std::uint32_t>> cold{{127.0, 0x7F0}, {100.5625, 0x649}, {25.0, 0x190},
                                                           {0.0, 0},       {-0.0625, 0xFFF},  {-1.0, 0xFF0},
                                                           {-20.0, 0xEC0}, {-55.0, 0xC90}};
  for (const auto& [degc, code] : cold)
    EXPECT_EQ(max31855_word(0.0, degc, ProbeFault::none), code << 4) << degc;
}

TEST(Max31855, FaultBitsOfTheDataSheet) {
  EXPECT_EQ(max31855_word(0.0, 0.0, ProbeFault::open), 0x00010001U);
  EXPECT_EQ(max31855_word(0.0, 0.0, ProbeFault::short_to_ground), 0x00010002U);
  EXPECT_EQ(max31855_word(0.0, 0.0, ProbeFault::short_to_supply), 0x00010004U);
}

TEST(Max31855, ReadsBackThroughThePins) {
  Max31855 sensor(fixed(100.75));
  Master master(sensor, 0);
  master.idle(kSecond);
  EXPECT_EQ(master.frame(32), 0x0193U << 18 | 0x190U << 4);
  EXPECT_EQ(sensor.frames(), 1U);
}

TEST(Max31855, WrongModeDoesNotReadTheWord) {
  Max31855 sensor(fixed(100.75));
  Master master(sensor, 1);
  master.idle(kSecond);
  EXPECT_EQ(master.frame(32), (std::uint64_t{0x0193U << 18 | 0x190U << 4}));
  Max31855 other(fixed(100.75));
  Master mode3(other, 3);
  mode3.idle(kSecond);
  EXPECT_NE(mode3.frame(32), (std::uint64_t{0x0193U << 18 | 0x190U << 4}));
}

TEST(Max31855, ChipSelectRestartsTheConversion) {
  SpiSensorConfig config = fixed(0.0);
  config.source = [](std::uint64_t cycle) { return 1e-4 * static_cast<double>(cycle); };  // 100 degC/s
  Max31855 sensor(config);
  Master master(sensor, 0);
  master.idle(kSecond);
  const std::uint64_t first = master.frame(32);
  master.idle(kSecond * 65 / 1000);
  EXPECT_EQ(master.frame(32), first);
  const std::uint64_t restart = master.cycle() - 4;  // the rising edge of chip select
  master.idle(kSecond * 71 / 1000);
  const double sampled_degc = 1e-4 * static_cast<double>(restart) + 7.0;
  EXPECT_EQ(master.frame(32) >> 18, static_cast<std::uint64_t>(std::lround(sampled_degc * 4.0)));
}

TEST(Max31855, AFrameCutShortStartsAnewAtTheNextSelect) {
  Max31855 sensor(fixed(100.75));
  Master master(sensor, 0);
  master.idle(kSecond);
  EXPECT_EQ(master.frame(14), 0x0193U);
  EXPECT_EQ(master.frame(14), 0x0193U);
}

class ThermocoupleFault : public ::testing::TestWithParam<std::pair<ProbeFault, std::uint32_t>> {};

TEST_P(ThermocoupleFault, ShowsAfterTheNextConversion) {
  Max31855 sensor(fixed(100.0));
  Master master(sensor, 0);
  master.idle(kSecond);
  sensor.set_faults({.probe = GetParam().first});
  EXPECT_EQ(master.frame(32) & 0x0003000FU, 0U);
  master.idle(kSecond);
  EXPECT_EQ(master.frame(32) & 0x0003000FU, GetParam().second);
  sensor.set_faults({});
  master.idle(kSecond);
  EXPECT_EQ(master.frame(32) >> 18, 400U);
}

INSTANTIATE_TEST_SUITE_P(Faults, ThermocoupleFault,
                         ::testing::Values(std::pair{ProbeFault::open, 0x10001U},
                                           std::pair{ProbeFault::short_to_ground, 0x10002U},
                                           std::pair{ProbeFault::short_to_supply, 0x10004U}));

// ------------------------------------------------------------------------------------ faults that every part
// has

TEST(SpiFault, DataLineFaultsActAtOnce) {
  Max31855 sensor(fixed(100.0));
  Master master(sensor, 0);
  master.idle(kSecond);
  sensor.set_faults({.miso = MisoFault::stuck_low});
  EXPECT_EQ(master.frame(32), 0U);
  sensor.set_faults({.miso = MisoFault::stuck_high});
  EXPECT_EQ(master.frame(32), 0xFFFFFFFFU);
  sensor.set_faults({.miso = MisoFault::absent});
  EXPECT_EQ(master.frame(32), 0xFFFFFFFFU);
}

TEST(SpiFault, AnAbsentPartLeavesTheLineToItsPull) {
  SpiSensorConfig config = fixed(100.0);
  config.miso_pull = false;
  Max31855 sensor(config);
  sensor.set_faults({.miso = MisoFault::absent});
  Master master(sensor, 0);
  master.idle(kSecond);
  EXPECT_EQ(master.frame(32), 0U);
}

TEST(SpiFault, FrozenValueStays) {
  for (const char* part : {"MAX31855", "MAX6675", "LM70"}) {
    const auto sensor = make_spi_sensor(part, ramp());
    Master master(*sensor, 0);
    master.idle(50 * kSecond);
    const std::uint64_t before = master.frame(16);
    sensor->set_faults({.frozen = true});
    master.idle(20 * kSecond);
    EXPECT_EQ(master.frame(16), before) << part;
    sensor->set_faults({});
    master.idle(kSecond);
    EXPECT_GT(master.frame(16), before) << part;
  }
}

TEST(SpiFault, OneCorruptedFrameIsOne) {
  Max31855 sensor(fixed(100.0));
  Master master(sensor, 0);
  master.idle(kSecond);
  const std::uint64_t good = master.frame(32);
  sensor.corrupt_next_frame(0b101);  // the first and third bit on the wire
  EXPECT_EQ(master.frame(32), good ^ 0xA0000000U);
  EXPECT_EQ(master.frame(32), good);
}

TEST(SpiFault, ReservedBitsReadInverted) {
  const auto frame_with = [](const char* part, unsigned bits, bool wrong) {
    const auto sensor = make_spi_sensor(part, fixed(100.0));
    sensor->set_faults({.reserved_bits_wrong = wrong});
    Master master(*sensor, 0);
    master.idle(kSecond);
    return master.frame(bits);
  };
  EXPECT_EQ(frame_with("MAX31855", 32, true) ^ frame_with("MAX31855", 32, false), 0x00020008U);
  EXPECT_EQ(frame_with("MAX6675", 16, true) ^ frame_with("MAX6675", 16, false), 0x8002U);
  EXPECT_EQ(frame_with("LM70", 16, true) ^ frame_with("LM70", 16, false), 0x001CU);
}

TEST(SpiSensor, NoiseHasItsSigmaAndRepeatsWithItsSeed) {
  SpiSensorConfig config = fixed(100.0);
  config.noise_sigma_degc = 0.5;
  config.conversion_s = 1e-3;
  const auto codes = [&](std::uint64_t seed) {
    config.noise = stream(seed, "sensor");
    Adt73x0 sensor(config);
    Master master(sensor, 3);
    std::vector<double> degc;
    for (int i = 0; i < 3000; ++i) {
      master.idle(1000);
      degc.push_back(sensor.register_value(2) / 128.0);
    }
    return degc;
  };
  const std::vector<double> first = codes(1);
  EXPECT_EQ(first, codes(1));
  EXPECT_NE(first, codes(2));
  double squares = 0.0;
  for (const double degc : first) squares += (degc - 100.0) * (degc - 100.0);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(first.size())), 0.5, 0.035);
}

TEST(SpiSensor, SkippingToEventsGivesTheSameAsSteppingEachCycle) {
  Max6675 stepped(ramp());
  Max6675 skipped(ramp());
  for (std::uint64_t cycle = 0; cycle < kSecond; ++cycle) stepped.step(cycle, true, false, false);
  for (std::uint64_t cycle = 0; cycle < kSecond; cycle = std::min(kSecond, skipped.next_event())) {
    skipped.step(cycle, true, false, false);
  }
  const auto read = [](SpiSensor& sensor) {
    unsigned word = 0;
    std::uint64_t cycle = kSecond;
    for (int i = 0; i < 16; ++i) {
      word = word << 1 | (sensor.step(cycle++, false, false, false) ? 1U : 0U);
      sensor.step(cycle++, false, true, false);
    }
    return word;
  };
  EXPECT_EQ(read(stepped), read(skipped));
}

TEST(SpiSensor, UnknownPartAndBadValuesAreRefused) {
  EXPECT_THROW(make_spi_sensor("max1", fixed(0.0)), std::invalid_argument);
  EXPECT_THROW(Lm70({.clock_hz = 0.0, .source = [](std::uint64_t) { return 0.0; }}), std::invalid_argument);
  EXPECT_THROW(Lm70({.clock_hz = 1.0, .source = {}}), std::invalid_argument);
}

// ---------------------------------------------------------------------------------------------------
// MAX6675, LM70

TEST(Max6675, WordHasTemperatureOpenFlagAndIdentity) {
  EXPECT_EQ(max6675_word(0.0, false), 0x0000);
  EXPECT_EQ(max6675_word(100.0, false), 0x0C80);
  EXPECT_EQ(max6675_word(1023.75, false), 0x7FF8);
  EXPECT_EQ(max6675_word(2000.0, false), 0x7FF8);
  EXPECT_EQ(max6675_word(-20.0, false), 0x0000);
  EXPECT_EQ(max6675_word(0.0, true), 0x0004);
}

TEST(Max6675, ReadsBackWithAnUndrivenLastBit) {
  for (const bool pull : {false, true}) {
    SpiSensorConfig config = fixed(100.0);
    config.miso_pull = pull;
    Max6675 sensor(config);
    Master master(sensor, 0);
    master.idle(kSecond);
    EXPECT_EQ(master.frame(16), pull ? 0x0C81U : 0x0C80U);
  }
}

TEST(Max6675, WiringFaults) {
  Max6675 sensor(fixed(300.0));
  Master master(sensor, 0);
  const auto word_with = [&](ProbeFault fault) {
    sensor.set_faults({.probe = fault});
    master.idle(kSecond);
    return master.frame(16) >> 1;
  };
  EXPECT_EQ(word_with(ProbeFault::none), 1200U << 2);
  EXPECT_EQ(word_with(ProbeFault::open) & 2U, 2U);
  EXPECT_EQ(word_with(ProbeFault::short_to_ground), 100U << 2);
  EXPECT_EQ(word_with(ProbeFault::short_to_supply), 4095U << 2);
}

TEST(Lm70, WordsOfTheDataSheet) {
  // The data sheet prints the two undriven bits as ones.
  const std::vector<std::pair<double, unsigned>> words{{150.0, 0x4B1F}, {125.0, 0x3E9F}, {25.0, 0x0C9F},
                                                       {0.25, 0x003F},  {0.0, 0x001F},   {-0.25, 0xFFFF},
                                                       {-25.0, 0xF39F}, {-55.0, 0xE49F}};
  for (const auto& [degc, word] : words) EXPECT_EQ(lm70_word(degc) | 3U, word) << degc;
}

TEST(Lm70, ReadsBackThroughThePins) {
  Lm70 sensor(fixed(25.0));
  Master master(sensor, 0);
  EXPECT_EQ(master.frame(16), 0x001FU);
  master.idle(kSecond);
  EXPECT_EQ(master.frame(16), 0x0C9FU);
}

TEST(Lm70, ShutdownShowsTheIdentityAndResumes) {
  Lm70 sensor(fixed(25.0));
  Master master(sensor, 0);
  master.idle(kSecond);
  master.frame(32, 0x000000FF);
  EXPECT_EQ(sensor.next_event(), kNoEvent);
  EXPECT_EQ(master.frame(16), 0x8103U);
  master.frame(32, 0x00000000);
  master.idle(kSecond);
  EXPECT_EQ(master.frame(16), 0x0C9FU);
}

// -------------------------------------------------------------------------------------------------------
// MAX31865

TEST(Max31865, RatioCodesOfTheDataSheet) {
  EXPECT_NEAR(pt100_ohm(-200.0), 18.52, 0.005);
  EXPECT_NEAR(pt100_ohm(100.0), 138.51, 0.005);
  EXPECT_NEAR(pt100_ohm(200.0), 175.86, 0.005);
  EXPECT_EQ(max31865_code(-200.0, RtdCurve::callendar_van_dusen), 1517);
  EXPECT_EQ(max31865_code(0.0, RtdCurve::callendar_van_dusen), 8192);
  EXPECT_EQ(max31865_code(100.0, RtdCurve::callendar_van_dusen), 11346);
  EXPECT_EQ(max31865_code(200.0, RtdCurve::callendar_van_dusen), 14406);
  EXPECT_EQ(max31865_code(100.0, RtdCurve::linear), 32 * 356);
}

class Rtd : public ::testing::TestWithParam<int> {
 protected:
  std::uint64_t read(unsigned address, unsigned bytes) {
    master.select();
    master.exchange(8, address);
    const std::uint64_t in = master.exchange(8 * bytes);
    master.release();
    return in;
  }
  void write(unsigned address, unsigned value) { master.frame(16, (0x80U | address) << 8 | value); }

  Max31865 sensor{fixed(100.0), RtdCurve::callendar_van_dusen};
  Master master{sensor, GetParam()};
};

TEST_P(Rtd, PowerUpRegisters) { EXPECT_EQ(read(0, 8), 0x000000FFFF000000U); }

TEST_P(Rtd, WritesReadBackAndAddressesAdvance) {
  master.frame(40, 0x83'12'34'56'78);
  EXPECT_EQ(read(3, 4), 0x12345678U);
  write(0, 0xD1);
  EXPECT_EQ(read(0, 1), 0xD1U);
  write(1, 0x55);
  EXPECT_EQ(read(1, 1), 0x00U);
}

TEST_P(Rtd, AutomaticConversionNeedsTheBias) {
  write(0, 0x41);
  master.idle(kSecond);
  EXPECT_EQ(read(1, 2), 0U);
  write(0, 0xC1);
  master.idle(kSecond * 62 / 1000);
  EXPECT_EQ(read(1, 2), 0U);
  master.idle(kSecond / 1000);
  EXPECT_EQ(read(1, 2), 11346U << 1);
}

TEST_P(Rtd, OneShotConvertsOnceAndClearsItsBit) {
  write(0, 0xA0);
  master.idle(kSecond * 51 / 1000);
  EXPECT_EQ(read(0, 1), 0xA0U);
  master.idle(kSecond * 2 / 1000);
  EXPECT_EQ(read(0, 3), 0x80'00'00U | 11346U << 1);
  EXPECT_EQ(sensor.next_event(), kNoEvent);
}

TEST_P(Rtd, OpenElementRaisesTheHighThreshold) {
  write(0, 0xC0);
  sensor.set_faults({.probe = ProbeFault::open});
  master.idle(kSecond);
  EXPECT_EQ(read(1, 2), 0xFFFFU);
  EXPECT_EQ(read(7, 1), 0x80U);
}

TEST_P(Rtd, ThresholdsRaiseFaultsThatStayUntilCleared) {
  write(5, 0x60);
  write(0, 0xC0);
  master.idle(kSecond);
  EXPECT_EQ(read(7, 1), 0x40U);
  EXPECT_EQ(read(2, 1) & 1U, 1U);
  write(5, 0x00);
  master.idle(kSecond);
  EXPECT_EQ(read(7, 1), 0x40U);
  write(0, 0xC2);
  EXPECT_EQ(read(7, 1), 0x00U);
  EXPECT_EQ(read(0, 1), 0xC0U);
  master.idle(kSecond);
  EXPECT_EQ(read(1, 2), 11346U << 1);
}

TEST_P(Rtd, CodeAtTheLowThresholdIsAFault) {
  master.frame(24, 0x85'58'A4);  // 11346 << 1
  write(0, 0xC0);
  master.idle(kSecond);
  EXPECT_EQ(read(7, 1), 0x40U);
  master.frame(24, 0x85'58'A2);
  write(0, 0xC2);
  master.idle(kSecond);
  EXPECT_EQ(read(7, 1), 0x00U);
}

TEST_P(Rtd, RewritingTheConfigurationDoesNotRestartAutomaticConversion) {
  write(0, 0xC1);
  const std::uint64_t end_cycle = sensor.next_event();
  write(0, 0xD1);
  EXPECT_EQ(sensor.next_event(), end_cycle);
}

TEST_P(Rtd, ManualDetectionCycleEndsAtItsSecondStep) {
  sensor.set_faults({.probe = ProbeFault::open});
  write(0, 0x88);
  EXPECT_EQ(read(7, 1), 0x00U);
  write(0, 0x8C);
  EXPECT_EQ(read(7, 1), 0x20U);
  EXPECT_EQ(read(0, 1), 0x80U);
}

TEST_P(Rtd, ShortStopsConversionsAndRaisesTheVoltageFault) {
  write(0, 0xC0);
  master.idle(kSecond);
  sensor.set_faults({.probe = ProbeFault::short_to_supply});
  master.idle(kSecond);
  EXPECT_EQ(read(7, 1), 0x04U);
  EXPECT_EQ(read(1, 2), 11346U << 1 | 1U);
}

TEST_P(Rtd, OpenForceLeadLooksValidUntilTheDetectionCycle) {
  sensor.set_faults({.probe = ProbeFault::force_lead_open});
  write(0, 0xA0);
  master.idle(kSecond);
  EXPECT_EQ(read(1, 2), 11346U << 1);
  write(0, 0x84);
  master.idle(kSecond / 1000);
  EXPECT_EQ(read(0, 1), 0x80U);
  EXPECT_EQ(read(7, 1), 0x18U);
  EXPECT_EQ(read(1, 2), 11346U << 1 | 1U);
}

TEST_P(Rtd, BrownOutLosesTheConfiguration) {
  write(0, 0xC1);
  sensor.power_cycle(master.cycle());
  EXPECT_EQ(read(0, 1), 0x00U);
  EXPECT_EQ(sensor.next_event(), kNoEvent);
}

TEST_P(Rtd, CorruptedAndReservedBits) {
  sensor.corrupt_next_frame(0x80);
  EXPECT_EQ(read(0, 1), 0x01U);
  EXPECT_EQ(read(0, 1), 0x00U);
  sensor.set_faults({.reserved_bits_wrong = true});
  EXPECT_EQ(read(7, 1), 0x03U);
}

INSTANTIATE_TEST_SUITE_P(Modes, Rtd, ::testing::Values(1, 3));

TEST(Max31865, IsNotReadableInModeZero) {
  Max31865 sensor(fixed(100.0), RtdCurve::callendar_van_dusen);
  Master master(sensor, 0);
  master.frame(16, 0x80C0);
  master.idle(kSecond);
  EXPECT_NE(master.frame(24, 0x010000) & 0xFFFFU, 11346U << 1);
}

// ------------------------------------------------------------------------------------------------ ADT7310,
// ADT7320

class Adt : public ::testing::Test {
 protected:
  void start(double degc) {
    sensor = std::make_unique<Adt73x0>(fixed(degc));
    master = std::make_unique<Master>(*sensor, 3);
  }
  std::uint64_t read(unsigned address, unsigned bits) {
    return master->frame(8 + bits, std::uint64_t{0x40U | address << 3} << bits) & ((1ULL << bits) - 1);
  }
  void write(unsigned address, unsigned value, unsigned bits) {
    master->frame(8 + bits, std::uint64_t{address << 3} << bits | value);
  }
  std::unique_ptr<Adt73x0> sensor;
  std::unique_ptr<Master> master;
};

TEST_F(Adt, PowerUpRegistersOfTheDataSheet) {
  start(25.0);
  EXPECT_EQ(read(0, 8), 0x80U);
  EXPECT_EQ(read(1, 8), 0x00U);
  EXPECT_EQ(read(2, 16), 0x0000U);
  EXPECT_EQ(read(3, 8), 0xC3U);
  EXPECT_EQ(read(4, 16), 0x4980U);
  EXPECT_EQ(read(5, 8), 0x05U);
  EXPECT_EQ(read(6, 16), 0x2000U);
  EXPECT_EQ(read(7, 16), 0x0500U);
}

TEST_F(Adt, TemperatureWordsOfTheDataSheet) {
  const std::vector<std::pair<double, unsigned>> thirteen_bits{
      {-55.0, 0x1C90}, {-50.0, 0x1CE0}, {-25.0, 0x1E70}, {-0.0625, 0x1FFF}, {0.0, 0x000},
      {0.0625, 0x001}, {25.0, 0x190},   {50.0, 0x320},   {125.0, 0x7D0},    {150.0, 0x960}};
  for (const auto& [degc, code] : thirteen_bits) {
    start(degc);
    master->idle(kSecond);
    EXPECT_EQ(read(2, 16) >> 3, code) << degc;
  }
  EXPECT_EQ(adt73x0_word(25.0078125), 0x0C81);
  EXPECT_EQ(adt73x0_word(-0.0078125), 0xFFFF);
}

TEST_F(Adt, SixteenBitModeCarriesTheLowBits) {
  start(25.0390625);
  master->idle(kSecond);
  EXPECT_EQ(read(2, 16), 0x0C80U);
  write(1, 0x80, 8);
  EXPECT_EQ(read(1, 8), 0x80U);
  EXPECT_EQ(read(2, 16), 0x0C85U);
}

TEST_F(Adt, LimitFlagsInWordAndStatus) {
  start(70.0);
  master->idle(kSecond);
  EXPECT_EQ(read(0, 8), 0x20U);
  EXPECT_EQ(read(2, 16), (70U * 128U) | 2U);
  start(150.0);
  master->idle(kSecond);
  EXPECT_EQ(read(2, 16) & 7U, 6U);
  start(5.0);
  master->idle(kSecond);
  EXPECT_EQ(read(2, 16) & 7U, 1U);
}

TEST_F(Adt, LimitFlagsHaveHysteresis) {
  double degc = 70.0;
  SpiSensorConfig config = fixed(0.0);
  config.source = [&degc](std::uint64_t) { return degc; };
  sensor = std::make_unique<Adt73x0>(config);
  master = std::make_unique<Master>(*sensor, 3);
  const auto flags_at = [&](double temperature_degc) {
    degc = temperature_degc;
    master->idle(kSecond / 2);
    return read(2, 16) & 7U;
  };
  EXPECT_EQ(flags_at(65.0), 2U);
  EXPECT_EQ(flags_at(60.0), 2U);
  EXPECT_EQ(flags_at(58.0), 0U);
  EXPECT_EQ(flags_at(9.0), 1U);
  EXPECT_EQ(flags_at(14.0), 1U);
  EXPECT_EQ(flags_at(16.0), 0U);
}

TEST_F(Adt, OneSampleASecondMode) {
  start(25.0);
  master->idle(kSecond);
  write(1, 0x40, 8);
  const std::uint64_t written = master->cycle();
  EXPECT_NEAR(static_cast<double>(sensor->next_event() - written), 0.060e6, 10.0);
  master->idle(kSecond / 10);
  EXPECT_NEAR(static_cast<double>(sensor->next_event() - written), 1.060e6, 10.0);
}

TEST_F(Adt, ReadyFlagFallsWithAResultAndRisesWithItsReading) {
  start(25.0);
  EXPECT_EQ(read(0, 8), 0x80U);
  master->idle(kSecond / 100);
  EXPECT_EQ(read(0, 8), 0x00U);
  read(2, 16);
  EXPECT_EQ(read(0, 8), 0x80U);
  master->idle(kSecond * 230 / 1000);
  EXPECT_EQ(read(0, 8), 0x80U);
  master->idle(kSecond * 10 / 1000);
  EXPECT_EQ(read(0, 8), 0x00U);
}

TEST_F(Adt, OneShotConvertsOnce) {
  start(25.0);
  write(1, 0x60, 8);
  EXPECT_EQ(sensor->next_event(), kNoEvent);
  write(1, 0x20, 8);
  EXPECT_EQ(sensor->next_event() < master->cycle() + kSecond / 4, true);
  master->idle(kSecond / 4);
  EXPECT_EQ(sensor->next_event(), kNoEvent);
  EXPECT_EQ(read(2, 16), 25U * 128U);
}

TEST_F(Adt, ContinuousReadNeedsNoFurtherCommand) {
  start(25.0);
  master->idle(kSecond);
  EXPECT_EQ(master->frame(24, 0x540000) & 0xFFFFU, 25U * 128U);
  EXPECT_EQ(master->frame(16), 25U * 128U);
  master->frame(16, 0x5000);
  EXPECT_EQ(read(3, 8), 0xC3U);
}

TEST_F(Adt, ThirtyTwoOnesReset) {
  start(25.0);
  write(1, 0x80, 8);
  master->frame(32, 0xFFFFFFFF);
  EXPECT_EQ(read(1, 8), 0x00U);
}

TEST_F(Adt, ReadOnlyRegistersIgnoreWrites) {
  start(25.0);
  write(3, 0x11, 8);
  EXPECT_EQ(read(3, 8), 0xC3U);
}

TEST_F(Adt, AlsoReadsInModeZero) {
  start(25.0);
  Master mode0(*sensor, 0);
  mode0.idle(kSecond);
  EXPECT_EQ(mode0.frame(16, 0x5800) & 0xFFU, 0xC3U);
}

TEST_F(Adt, CorruptedFrozenAndWrongIdentity) {
  start(25.0);
  master->idle(kSecond);
  sensor->corrupt_next_frame(1);
  EXPECT_EQ(read(2, 16), (25U * 128U) ^ 0x8000U);
  sensor->set_faults({.reserved_bits_wrong = true});
  EXPECT_EQ(read(3, 8), 0x3CU);
  sensor->set_faults({.frozen = true});
  read(2, 16);
  master->idle(kSecond);
  EXPECT_EQ(read(0, 8), 0x80U);
}

}  // namespace
}  // namespace meltstage::tb
