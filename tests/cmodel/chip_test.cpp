// SPDX-License-Identifier: Apache-2.0
// The whole chip: registers after reset, save and restore, no allocation, pins with logic behind the flops.
#include "cmodel/chip.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <random>
#include <vector>

#include "cmodel/math.hpp"
#include "support.hpp"

namespace {
std::atomic<long> allocations{0};
}

// Not inlined: GCC takes the pair for a mismatch where it sees through one of them.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc{};
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace meltstage::chip {
namespace {

using namespace spec;

// Every flop of the chip as a number.
std::vector<std::uint64_t> flops(const Chip& chip) {
  std::vector<std::uint64_t> all;
#define TC_FLOP(type, name, width, reset) all.push_back(static_cast<std::uint64_t>(chip.TC_MEMBER.name));
#define TC_ARRAY(type, name, count, width) \
  for (const auto& word : chip.TC_MEMBER.name) all.push_back(static_cast<std::uint64_t>(word));
#include "cmodel/for_each_flop.inc"
  return all;
}

// The serial line with frames to slave 1 at 115200 Bd 8E1, and random levels on the other pins.
struct Stimulus {
  std::mt19937 random{11};
  std::vector<bool> line;  // a level a bit
  std::size_t bit = 0;
  unsigned clock = 0;

  void send(std::vector<std::uint8_t> frame) {
    std::uint16_t crc = 0xFFFF;
    for (std::uint8_t byte : frame) crc = crc16_byte(crc, byte);
    frame.push_back(static_cast<std::uint8_t>(crc & 0xFF));
    frame.push_back(static_cast<std::uint8_t>(crc >> 8));
    for (std::uint8_t byte : frame) {
      const unsigned bits = byte * 2u | static_cast<unsigned>(ninth_bit(kFormat8E1, byte)) << 9 | 1u << 10;
      for (int i = 0; i < 11; ++i) line.push_back((bits >> i & 1) != 0);
    }
    line.insert(line.end(), 250, true);  // silence that ends the frame
  }
  Inputs next() {
    Inputs in;
    in.uart_rx = bit >= line.size() || line[bit];
    if (++clock == 104) {
      clock = 0;
      if (bit < line.size()) ++bit;
    }
    const auto r = static_cast<unsigned>(random());
    in.spi_miso = (r & 1) != 0;
    in.heater_fb = (r >> 1 & 1) != 0;
    return in;
  }
};

Chip started() {
  Chip chip;
  for (int i = 0; i < 5; ++i) chip.step({});
  return chip;
}

TEST(Chip, EveryHoldingRegisterHasItsResetValue) {
  const Chip chip = started();
  for (unsigned i = 0; i < kHoldingCount; ++i) {
    const auto address = static_cast<std::uint16_t>(kHoldingBase + i);
    EXPECT_EQ(chip.read_register(address), static_cast<std::uint16_t>(kHolding[i].reset)) << kHolding[i].name;
    EXPECT_EQ(chip.params().value[i], static_cast<std::uint16_t>(i == 0 ? 0 : kHolding[i].reset))
        << kHolding[i].name;
  }
}

TEST(Chip, EveryInputRegisterHasItsResetValue) {
  const Chip chip = started();
  for (std::uint16_t address = 0; address < kInputCount; ++address) {
    std::uint16_t wanted = 0;
    if (address == kInPv) wanted = 0x8000;
    if (address == kInDeviceId) wanted = kDeviceId;
    if (address == kInVersion) wanted = kVersion;
    if (address == kInBandTime) wanted = 0xFFFF;
    if (address == kInMapCrc) wanted = kMapCrc;
    if (address == kInWdLeft) wanted = static_cast<std::uint16_t>(kHolding[kRegHostWd].reset);
    EXPECT_EQ(chip.read_register(address), wanted) << kInput[address].name;
  }
}

TEST(Chip, OutputsRestAfterReset) {
  const Chip chip = started();
  const Outputs rest{.uart_tx = true,
                     .uart_de = false,
                     .tlm_tx = true,
                     .spi_sclk = false,
                     .spi_cs_n = true,
                     .spi_mosi = false,
                     .heater = false,
                     .safe_en = false,
                     .fault_n = true,
                     .at_temp = false};
  EXPECT_EQ(chip.outputs({}), rest);
  EXPECT_EQ(Chip{}.outputs({}), rest);
}

TEST(Chip, WrittenRegisterReadsBackAndActsAtTheTick) {
  Chip chip = started();
  Stimulus stimulus;
  stimulus.send({1, 6, 1, static_cast<std::uint8_t>(kRegKp), 0x12, 0x34});
  for (int i = 0; i < 60'000; ++i) chip.step(stimulus.next());
  EXPECT_EQ(chip.read_register(kHoldingBase + kRegKp), 0x1234);
  EXPECT_EQ(chip.params()[kRegKp], kHolding[kRegKp].reset) << "staged only";
  for (int i = 0; i < 1'300'000; ++i) chip.step(stimulus.next());
  EXPECT_EQ(chip.params()[kRegKp], 0x1234);
}

TEST(Chip, SavedAndRestoredMidRunHasTheSameFuture) {
  Stimulus stimulus;
  stimulus.send({1, 16, 1, 1, 0, 2, 4, 0x04, 0x4C, 0, 100});
  Chip chip = started();
  for (int save_at : {3'000, 17'000, 45'000, 1'250'000}) {
    for (int i = 0; i < save_at; ++i) chip.step(stimulus.next());
    const Chip saved = chip;
    Chip copy;
    copy = saved;
    Stimulus again = stimulus;
    for (int i = 0; i < 200'000; ++i)
      ASSERT_EQ(chip.step(stimulus.next()), copy.step(again.next())) << save_at << " + " << i;
    ASSERT_EQ(flops(chip), flops(copy)) << save_at;
  }
  EXPECT_GT(chip.guard.sensor_errors_q + chip.guard.samples_q, 0) << "the run went through control ticks";
}

TEST(Chip, ResetAtAnyClockGivesAFreshChip) {
  Stimulus stimulus;
  stimulus.send({1, 6, 1, 1, 0, 100});
  Chip chip = started();
  for (int run : {100, 20'000, 80'000}) {
    for (int i = 0; i < run; ++i) chip.step(stimulus.next());
    Inputs reset;
    reset.rst_n = false;
    chip.step(reset);
    ASSERT_EQ(flops(chip), flops(Chip{}));
  }
}

TEST(Chip, StepAllocatesNothing) {
  Stimulus stimulus;
  stimulus.send({1, 4, 0, 0, 0, 24});
  stimulus.send({1, 6, 1, 1, 0, 100});
  Chip chip = started();
  const long before = allocations;
  for (int i = 0; i < 1'500'000; ++i) chip.step(stimulus.next());
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(chip.uartc.messages(), 0);
}

TEST(Chip, InhibitForcesTheHeaterPinLowWithoutAClock) {
  Chip chip = started();
  chip.guard.heater_q = 1;
  Inputs in;
  EXPECT_TRUE(chip.outputs(in).heater);
  in.inhibit = true;
  EXPECT_FALSE(chip.outputs(in).heater);
}

TEST(Chip, AnyFlipOfTheStateTurnsTheHeaterOff) {
  for (const StateInfo& state : kStates) {
    for (unsigned bit = 0; bit < 5; ++bit) {
      Chip chip = started();
      chip.guard.pv_valid_q = 1;
      chip.guard.run_q = 1;
      chip.guard.heater_q = 1;
      chip.sysctrl.state_q = static_cast<std::uint8_t>(state.code ^ 1u << bit);
      chip.step({});
      chip.step({});
      EXPECT_FALSE(chip.outputs({}).heater) << state.name << " bit " << bit;
      EXPECT_EQ(chip.guard.fault_q, 1u << kFaultState) << state.name << " bit " << bit;
      EXPECT_EQ(chip.sysctrl.state_q, kStIdle);
    }
  }
}

}  // namespace
}  // namespace meltstage::chip
