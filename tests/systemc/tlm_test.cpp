// SPDX-License-Identifier: Apache-2.0
// Register access through the TLM-2.0 socket.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "bench.hpp"

namespace meltstage::systemc {
namespace {

using namespace chip::spec;
using testing::ElementsAre;

constexpr std::uint16_t at(Reg reg) { return static_cast<std::uint16_t>(kHoldingBase + reg); }

// An access of `bytes` at register `address`.
struct Payload : tlm::tlm_generic_payload {
  Payload(tlm::tlm_command command, std::uint16_t address, std::vector<unsigned char>& bytes) {
    set_command(command);
    set_address(std::uint64_t{2} * address);
    set_data_ptr(bytes.data());
    set_data_length(static_cast<unsigned>(bytes.size()));
    set_streaming_width(static_cast<unsigned>(bytes.size()));
    set_dmi_allowed(true);
  }
};

class Tlm : public testing::Test {
 protected:
  Tlm() {
    bench.reset();
    bench.clocks(10);  // through the reset synchroniser
  }

  tlm::tlm_response_status send(tlm::tlm_generic_payload& p) {
    sc_core::sc_time delay(7, sc_core::SC_NS);
    const sc_core::sc_time now = sc_core::sc_time_stamp();
    bench.socket->b_transport(p, delay);
    EXPECT_EQ(delay, sc_core::sc_time(7, sc_core::SC_NS));
    EXPECT_EQ(sc_core::sc_time_stamp(), now);
    EXPECT_FALSE(p.is_dmi_allowed());
    return p.get_response_status();
  }
  tlm::tlm_response_status write(std::uint16_t address, std::initializer_list<int> values) {
    std::vector<unsigned char> bytes;
    for (const int value : values) {
      bytes.push_back(static_cast<unsigned char>(value & 0xFF));
      bytes.push_back(static_cast<unsigned char>(value >> 8 & 0xFF));
    }
    Payload p(tlm::TLM_WRITE_COMMAND, address, bytes);
    return send(p);
  }
  std::uint16_t read(std::uint16_t address) {
    std::vector<unsigned char> bytes(2);
    Payload p(tlm::TLM_READ_COMMAND, address, bytes);
    EXPECT_EQ(send(p), tlm::TLM_OK_RESPONSE) << "address " << address;
    return static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8);
  }
  std::uint16_t messages() const { return bench.model.pins.chip().read_register(kInMessages); }

  Bench& bench = Bench::instance();
};

TEST_F(Tlm, ReadsEveryRegister) {
  for (unsigned i = 0; i < kInputCount; ++i) {
    const auto address = static_cast<std::uint16_t>(i);
    const std::uint16_t value = read(address);
    EXPECT_EQ(value, bench.model.pins.chip().read_register(address)) << kInput[i].name;
  }
  for (unsigned i = 0; i < kHoldingCount; ++i)
    EXPECT_EQ(read(static_cast<std::uint16_t>(kHoldingBase + i)),
              static_cast<std::uint16_t>(kHolding[i].reset))
        << kHolding[i].name;
}

TEST_F(Tlm, WordsAreLowByteFirst) {
  std::vector<unsigned char> bytes(4);
  Payload p(tlm::TLM_READ_COMMAND, kInDeviceId, bytes);
  ASSERT_EQ(send(p), tlm::TLM_OK_RESPONSE);
  EXPECT_THAT(bytes, ElementsAre(kDeviceId & 0xFF, kDeviceId >> 8, kVersion & 0xFF, kVersion >> 8));
}

TEST_F(Tlm, WritesBothEndsOfEveryRange) {
  for (unsigned i = 1; i < kHoldingCount; ++i) {
    const RegisterInfo& info = kHolding[i];
    const auto address = static_cast<std::uint16_t>(kHoldingBase + i);
    // The set-point has to stay the margin below T_MAX as it stands after reset.
    const int max = i == kRegSetpoint ? kHolding[kRegTMax].reset - kSetpointMargin : info.max;
    for (const int value : {info.min, max}) {
      EXPECT_EQ(write(address, {value}), tlm::TLM_OK_RESPONSE) << info.name;
      EXPECT_EQ(read(address), static_cast<std::uint16_t>(value)) << info.name;
    }
    const int lowest = info.is_signed ? -32768 : 0;
    const int highest = info.is_signed ? 32767 : 65535;
    for (const int value : {info.min - 1, max + 1}) {
      if (value < lowest || value > highest) continue;
      EXPECT_EQ(write(address, {value}), tlm::TLM_GENERIC_ERROR_RESPONSE) << info.name << ' ' << value;
      EXPECT_EQ(bench.model.exception(), chip::spec::kExcValue) << info.name << ' ' << value;
      EXPECT_EQ(read(address), static_cast<std::uint16_t>(max)) << info.name << ' ' << value;
    }
    ASSERT_EQ(write(address, {info.reset}), tlm::TLM_OK_RESPONSE) << info.name;
  }
}

TEST_F(Tlm, OneBadValueRefusesTheWholeWrite) {
  EXPECT_EQ(write(at(kRegSetpoint), {500, 10, 10, 2}), tlm::TLM_GENERIC_ERROR_RESPONSE);
  EXPECT_EQ(bench.model.exception(), chip::spec::kExcValue);
  EXPECT_EQ(read(at(kRegSetpoint)), 0);
  EXPECT_EQ(read(at(kRegRampUp)), 0);
}

TEST_F(Tlm, AWriteOutsideTheHoldingRegistersIsAnAddressError) {
  EXPECT_EQ(write(kInStatus, {1}), tlm::TLM_ADDRESS_ERROR_RESPONSE);
  EXPECT_EQ(write(at(static_cast<Reg>(kHoldingCount - 1)), {0, 0}), tlm::TLM_ADDRESS_ERROR_RESPONSE);
  EXPECT_EQ(bench.model.exception(), chip::spec::kExcAddress);
}

TEST_F(Tlm, AnAddressOutsideTheMapOrOddIsAnAddressError) {
  std::vector<unsigned char> bytes(2);
  for (const std::uint64_t address : {std::uint64_t{2} * kInputCount, std::uint64_t{2} * (kHoldingBase - 1),
                                      std::uint64_t{2} * (kHoldingBase + kHoldingCount),
                                      std::uint64_t{0x10000} * 2, std::uint64_t{2} * kHoldingBase + 1}) {
    Payload p(tlm::TLM_READ_COMMAND, 0, bytes);
    p.set_address(address);
    EXPECT_EQ(send(p), tlm::TLM_ADDRESS_ERROR_RESPONSE) << address;
  }
}

TEST_F(Tlm, AReadPastTheEndIsAnAddressErrorAndLeavesTheData) {
  std::vector<unsigned char> bytes(4, 0xEE);
  Payload p(tlm::TLM_READ_COMMAND, kInputCount - 1, bytes);
  EXPECT_EQ(send(p), tlm::TLM_ADDRESS_ERROR_RESPONSE);
  EXPECT_THAT(bytes, testing::Each(0xEE));
}

TEST_F(Tlm, LengthsThatNoFrameHasAreBurstErrors) {
  for (const unsigned length : {0u, 1u, 3u, 66u}) {
    std::vector<unsigned char> bytes(length + 1);
    Payload p(tlm::TLM_READ_COMMAND, kHoldingBase, bytes);
    p.set_data_length(length);
    EXPECT_EQ(send(p), tlm::TLM_BURST_ERROR_RESPONSE) << length;
  }
  std::vector<unsigned char> bytes(34);
  Payload p(tlm::TLM_WRITE_COMMAND, at(kRegSensFrame), bytes);
  EXPECT_EQ(send(p), tlm::TLM_BURST_ERROR_RESPONSE);
}

TEST_F(Tlm, TheLongestAccessesAreTaken) {
  std::vector<unsigned char> bytes(64);
  Payload p(tlm::TLM_READ_COMMAND, kHoldingBase, bytes);
  EXPECT_EQ(send(p), tlm::TLM_OK_RESPONSE);
  EXPECT_EQ(write(at(kRegSetpoint), {1000, 0, 0, 0, 0, 0, 100, 0, 10, 50, 0, 51, 6208, 1669, 3339, 46163}),
            tlm::TLM_OK_RESPONSE);
  EXPECT_EQ(read(at(kRegSetpoint)), 1000);
  EXPECT_EQ(read(at(kRegKd)), 46163);
}

TEST_F(Tlm, AStreamingWidthBelowTheLengthIsABurstError) {
  std::vector<unsigned char> bytes(4);
  Payload p(tlm::TLM_READ_COMMAND, kHoldingBase, bytes);
  p.set_streaming_width(2);
  EXPECT_EQ(send(p), tlm::TLM_BURST_ERROR_RESPONSE);
}

TEST_F(Tlm, ByteEnablesAreRefused) {
  std::vector<unsigned char> bytes(2), enables(2, TLM_BYTE_ENABLED);
  Payload p(tlm::TLM_WRITE_COMMAND, at(kRegSetpoint), bytes);
  p.set_byte_enable_ptr(enables.data());
  p.set_byte_enable_length(2);
  EXPECT_EQ(send(p), tlm::TLM_BYTE_ENABLE_ERROR_RESPONSE);
}

TEST_F(Tlm, AnotherCommandIsACommandError) {
  std::vector<unsigned char> bytes(2);
  Payload p(tlm::TLM_IGNORE_COMMAND, 0, bytes);
  EXPECT_EQ(send(p), tlm::TLM_COMMAND_ERROR_RESPONSE);
}

TEST_F(Tlm, DirectMemoryIsNotGiven) {
  std::vector<unsigned char> bytes(2);
  Payload p(tlm::TLM_READ_COMMAND, 0, bytes);
  tlm::tlm_dmi dmi;
  EXPECT_FALSE(bench.socket->get_direct_mem_ptr(p, dmi));
}

TEST_F(Tlm, DebugReadsWithoutBeingAMessage) {
  std::vector<unsigned char> bytes(2 * kHoldingCount);
  Payload p(tlm::TLM_READ_COMMAND, kHoldingBase, bytes);
  const std::uint16_t before = messages();
  EXPECT_EQ(bench.socket->transport_dbg(p), 2 * kHoldingCount);
  EXPECT_EQ(messages(), before);
  for (unsigned i = 0; i < kHoldingCount; ++i)
    EXPECT_EQ(bytes[2 * i] | bytes[2 * i + 1] << 8, static_cast<std::uint16_t>(kHolding[i].reset))
        << kHolding[i].name;
  read(kInStatus);
  EXPECT_EQ(messages(), before + 1);
}

TEST_F(Tlm, DebugEndsWithTheMapAndWritesNothing) {
  std::vector<unsigned char> bytes(8);
  Payload end(tlm::TLM_READ_COMMAND, kInputCount - 2, bytes);
  EXPECT_EQ(bench.socket->transport_dbg(end), 4u);
  Payload write(tlm::TLM_WRITE_COMMAND, at(kRegSetpoint), bytes);
  EXPECT_EQ(bench.socket->transport_dbg(write), 0u);
}

TEST_F(Tlm, AChipInResetRefuses) {
  bench.set_reset(true);
  bench.settle();
  EXPECT_EQ(write(at(kRegSetpoint), {500}), tlm::TLM_GENERIC_ERROR_RESPONSE);
  EXPECT_EQ(bench.model.exception(), chip::spec::kExcDevice);
}

TEST_F(Tlm, HeatsAfterRunAndStopsAfterStop) {
  ASSERT_EQ(write(at(kRegSetpoint), {1100}), tlm::TLM_OK_RESPONSE);
  EXPECT_EQ(write(at(kRegCmd), {kCmdRun}), tlm::TLM_GENERIC_ERROR_RESPONSE);  // no temperature yet
  EXPECT_EQ(bench.model.exception(), chip::spec::kExcDevice);
  bench.clocks(kClkHz / 10 + 10'000);
  ASSERT_EQ(write(at(kRegCmd), {kCmdRun}), tlm::TLM_OK_RESPONSE);
  bench.clocks(2);
  EXPECT_EQ(read(kInStatus) >> kStatusRun & 1, 1);
  bench.clocks(kClkHz / 10 + 30'000);
  EXPECT_GT(bench.heater_edges(), 0u);
  ASSERT_EQ(write(at(kRegCmd), {kCmdStop}), tlm::TLM_OK_RESPONSE);
  EXPECT_EQ(write(at(kRegCmd), {kCmdRun}),
            tlm::TLM_GENERIC_ERROR_RESPONSE);  // the Stop has not met a clock yet
  EXPECT_EQ(bench.model.exception(), chip::spec::kExcBusy);
  bench.clocks(2);
  EXPECT_EQ(read(kInStatus) >> kStatusRun & 1, 0);
  EXPECT_FALSE(bench.heater());
}

}  // namespace
}  // namespace meltstage::systemc
