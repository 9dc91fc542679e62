// SPDX-License-Identifier: Apache-2.0
// libmodbus, as Debian ships it, against the virtual chip on the model and on the RTL.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <modbus.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <random>
#include <vector>

#include "cmodel/spec.hpp"
#include "tests/host/served_chip.hpp"

namespace meltstage {
namespace {

namespace spec = chip::spec;
using Words = std::vector<std::uint16_t>;

constexpr std::uint16_t holding(spec::Reg reg) {
  return static_cast<std::uint16_t>(spec::kHoldingBase + reg);
}

class Libmodbus : public ::testing::TestWithParam<const char*> {
 protected:
  Libmodbus() : chip_(GetParam()), master_(modbus_new_rtu(chip_.port().c_str(), 115200, 'E', 8, 1)) {
    modbus_set_slave(master_.get(), 1);
    modbus_set_response_timeout(master_.get(), 10, 0);  // the RTL is slow on a busy machine
    modbus_set_byte_timeout(master_.get(), 10, 0);
    if (modbus_connect(master_.get()) != 0) throw std::runtime_error("modbus_connect");
  }

  Words read_holding(std::uint16_t address, int count) {
    Words words(static_cast<std::size_t>(count));
    EXPECT_EQ(modbus_read_registers(master_.get(), address, count, words.data()), count)
        << modbus_strerror(errno);
    return words;
  }
  Words read_input(std::uint16_t address, int count) {
    Words words(static_cast<std::size_t>(count));
    EXPECT_EQ(modbus_read_input_registers(master_.get(), address, count, words.data()), count)
        << modbus_strerror(errno);
    return words;
  }
  int write(spec::Reg reg, std::uint16_t value) {
    return modbus_write_register(master_.get(), holding(reg), value);
  }

  struct Free {
    void operator()(modbus_t* m) const {
      modbus_close(m);
      modbus_free(m);
    }
  };
  ServedChip chip_;
  std::unique_ptr<modbus_t, Free> master_;
};

TEST_P(Libmodbus, ReadsTheResetValues) {
  for (int first = 0; first < static_cast<int>(spec::kHoldingCount); first += 32) {
    const int count = std::min(32, static_cast<int>(spec::kHoldingCount) - first);
    const Words words = read_holding(static_cast<std::uint16_t>(spec::kHoldingBase + first), count);
    for (int i = 0; i < count; ++i) {
      const spec::RegisterInfo& info = spec::kHolding[static_cast<std::size_t>(first + i)];
      EXPECT_EQ(words[static_cast<std::size_t>(i)], static_cast<std::uint16_t>(info.reset)) << info.name;
    }
  }
  EXPECT_EQ(read_input(spec::kInDeviceId, 3), (Words{spec::kDeviceId, spec::kVersion, spec::kMapCrc}));
  EXPECT_EQ(read_holding(spec::kInDeviceId, 1), Words{spec::kDeviceId});  // one space for both functions
}

TEST_P(Libmodbus, WritesWithFunctions6And16) {
  std::mt19937 random(7);
  const auto within = [&](spec::Reg reg) {
    const spec::RegisterInfo& info = spec::kHolding[reg];
    return static_cast<std::uint16_t>(std::uniform_int_distribution<int>(info.min, info.max)(random));
  };
  const std::uint16_t window = within(spec::kRegAtWindow);
  EXPECT_EQ(write(spec::kRegAtWindow, window), 1) << modbus_strerror(errno);
  EXPECT_EQ(read_holding(holding(spec::kRegAtWindow), 1), Words{window});

  Words gains;
  for (unsigned reg = spec::kRegKp; reg <= spec::kRegKff; ++reg)
    gains.push_back(within(static_cast<spec::Reg>(reg)));
  const int count = static_cast<int>(gains.size());
  EXPECT_EQ(modbus_write_registers(master_.get(), holding(spec::kRegKp), count, gains.data()), count)
      << modbus_strerror(errno);
  EXPECT_EQ(read_holding(holding(spec::kRegKp), count), gains);
}

TEST_P(Libmodbus, ReportsTheServerId) {
  std::array<std::uint8_t, 64> id{};
  const int length = modbus_report_slave_id(master_.get(), id.size(), id.data());
  ASSERT_EQ(length, 2 + spec::kIdentServer.length) << modbus_strerror(errno);
  EXPECT_EQ(id[0], spec::kDeviceId >> 8);
  EXPECT_EQ(id[1], 0);
  EXPECT_EQ(std::string(id.begin() + 2, id.begin() + length),
            spec::kIdentBytes.substr(spec::kIdentServer.start, spec::kIdentServer.length));
}

// Function 43/14, of which libmodbus knows nothing: it sends the bytes and leaves the answer to be read.
TEST_P(Libmodbus, ReadsTheDeviceIdentification) {
  using Bytes = std::vector<std::uint8_t>;
  const auto answer = [&](std::uint8_t mei_type, std::uint8_t code, std::uint8_t object, std::size_t size) {
    const std::array<std::uint8_t, 5> request{1, spec::kFcEncapsulated, mei_type, code, object};
    modbus_send_raw_request(master_.get(), request.data(), request.size());
    Bytes bytes(size);
    std::size_t have = 0;
    const int port = modbus_get_socket(master_.get());
    for (pollfd state{.fd = port, .events = POLLIN, .revents = 0};
         have < size && poll(&state, 1, 10'000) > 0;)
      have += static_cast<std::size_t>(std::max<ssize_t>(0, read(port, &bytes[have], size - have)));
    EXPECT_EQ(have, size);
    EXPECT_EQ(poll(nullptr, 0, 50), 0);
    modbus_flush(master_.get());
    bytes.resize(size - 2);  // without the check of the frame
    return bytes;
  };
  const auto object_of = [](std::uint8_t object) {
    const spec::IdentPart part = spec::kIdentObjects[object];
    const std::string_view text = spec::kIdentBytes.substr(part.start, part.length);
    Bytes bytes{object, static_cast<std::uint8_t>(part.length)};
    bytes.insert(bytes.end(), text.begin(), text.end());
    return bytes;
  };
  Bytes all{1, spec::kFcEncapsulated, spec::kMeiType, 1, 0x81, 0, 0, 3};
  for (std::uint8_t object = 0; object < 3; ++object) {
    const Bytes one = object_of(object);
    all.insert(all.end(), one.begin(), one.end());
    Bytes alone{1, spec::kFcEncapsulated, spec::kMeiType, 4, 0x81, 0, 0, 1};
    alone.insert(alone.end(), one.begin(), one.end());
    EXPECT_EQ(answer(spec::kMeiType, 4, object, alone.size() + 2), alone);
  }
  EXPECT_EQ(answer(spec::kMeiType, 1, 0, all.size() + 2), all);
  const auto refused = [](std::uint8_t code) {
    return Bytes{1, spec::kFcEncapsulated | spec::kExceptionFlag, code};
  };
  EXPECT_EQ(answer(13, 1, 0, 5), refused(spec::kExcFunction));
  EXPECT_EQ(answer(spec::kMeiType, 4, 3, 5), refused(spec::kExcAddress));
  EXPECT_EQ(answer(spec::kMeiType, 5, 0, 5), refused(spec::kExcValue));
}

TEST_P(Libmodbus, GetsTheExceptions) {
  std::uint8_t coil = 0;
  std::uint16_t word = 0;
  EXPECT_EQ(modbus_read_bits(master_.get(), 0, 1, &coil), -1);
  EXPECT_EQ(errno, EMBXILFUN);
  EXPECT_EQ(modbus_read_registers(master_.get(), 0x0FF, 1, &word), -1);
  EXPECT_EQ(errno, EMBXILADD);
  // One bad value refuses the whole frame.
  const Words ramp_and_mode{100, 100, 2};
  EXPECT_EQ(modbus_write_registers(master_.get(), holding(spec::kRegRampUp), 3, ramp_and_mode.data()), -1);
  EXPECT_EQ(errno, EMBXILVAL);
  EXPECT_EQ(read_holding(holding(spec::kRegRampUp), 3), (Words{0, 0, 0}));
  // Locked: only LOCK = 0 and Stop pass. A write becomes active at the next control tick.
  EXPECT_EQ(write(spec::kRegLock, 1), 1);
  while ((read_input(spec::kInStatus, 1)[0] >> spec::kStatusLocked & 1) == 0) {
  }
  EXPECT_EQ(write(spec::kRegSetpoint, 500), -1);
  EXPECT_EQ(errno, EMBXSFAIL);
  EXPECT_EQ(write(spec::kRegCmd, spec::kCmdStop), 1);
  EXPECT_EQ(write(spec::kRegLock, 0), 1);
}

TEST_P(Libmodbus, BroadcastIsCarriedOutAndNotAnswered) {
  modbus_set_slave(master_.get(), MODBUS_BROADCAST_ADDRESS);
  modbus_set_response_timeout(master_.get(), 0, 300000);
  EXPECT_EQ(write(spec::kRegSetpoint, 777), -1);
  EXPECT_EQ(errno, ETIMEDOUT);
  modbus_set_slave(master_.get(), 1);
  modbus_set_response_timeout(master_.get(), 10, 0);
  EXPECT_EQ(read_holding(holding(spec::kRegSetpoint), 1), Words{777});
}

// The same frame to a third party is neither answered nor carried out.
TEST_P(Libmodbus, FrameToAnotherAddressIsLeftAlone) {
  modbus_set_slave(master_.get(), 9);
  modbus_set_response_timeout(master_.get(), 0, 300000);
  EXPECT_EQ(write(spec::kRegSetpoint, 777), -1);
  EXPECT_EQ(errno, ETIMEDOUT);
  modbus_set_slave(master_.get(), 1);
  modbus_set_response_timeout(master_.get(), 10, 0);
  EXPECT_EQ(read_holding(holding(spec::kRegSetpoint), 1), Words{0});
}

// The chip's line follows its registers; a pseudo-terminal has no line of its own.
TEST_P(Libmodbus, NewBaudRateAndFormatAreSpokenAtOnce) {
  const Words slow_8n2{192, 2};
  EXPECT_EQ(modbus_write_registers(master_.get(), holding(spec::kRegBaud), 2, slow_8n2.data()), 2);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(read_holding(holding(spec::kRegBaud), 2), slow_8n2);
  EXPECT_EQ(read_input(spec::kInCharErrors, 1), Words{0});
}

INSTANTIATE_TEST_SUITE_P(Model, Libmodbus, ::testing::Values(""));
INSTANTIATE_TEST_SUITE_P(Rtl, Libmodbus, ::testing::Values("--rtl"));

// A head is heated from outside, as fast as the model goes; its time is counted in its samples.
using HeatedHead = Libmodbus;
TEST_P(HeatedHead, ReachesItsSetPoint) {
  EXPECT_EQ(write(spec::kRegHostWd, 0), 1);  // the chip's seconds pass faster than the master polls
  EXPECT_EQ(write(spec::kRegSetpoint, 600), 1);
  while (read_input(spec::kInSamples, 1)[0] == 0) {
  }
  ASSERT_EQ(write(spec::kRegCmd, spec::kCmdRun), 1) << modbus_strerror(errno);
  const auto at_temperature = [](std::uint16_t status) {
    return (status >> spec::kStatusAtTemperature & 1) != 0;
  };
  Words status = read_input(spec::kInStatus, 16);
  while (!at_temperature(status[spec::kInStatus]) && status[spec::kInFault] == 0)
    status = read_input(spec::kInStatus, 16);
  EXPECT_EQ(status[spec::kInFault], 0);
  EXPECT_NEAR(status[spec::kInPv], 600, 15);
  EXPECT_GT(status[spec::kInSamples], 100);
}
INSTANTIATE_TEST_SUITE_P(Model, HeatedHead, ::testing::Values("--speed max"));

}  // namespace
}  // namespace meltstage
