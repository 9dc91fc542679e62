// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "app/chip/chip_wire.hpp"
#include "cmodel/advance.hpp"
#include "tb/devices/modbus_host.hpp"

namespace meltstage::app {
namespace {

namespace spec = chip::spec;
using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const tb::ModbusRequest& request) {
  Bytes bytes;
  for (const tb::UartChar& c : request.frame) bytes.push_back(c.data);
  return bytes;
}

// A chip on its head, with the master's end of the line.
class Wire : public ::testing::Test {
 protected:
  Wire() {
    head_.set_reset(true);
    run_for(20);
    head_.set_reset(false);
    run_for(100);
  }
  void run_for(std::uint64_t clocks) {
    ServedHead around{head_, master_};
    chip::advance(run_, run_.cycle + clocks, around, [](auto&&...) {});
  }
  Bytes exchange(const Bytes& frame) {
    master_.send(run_.cycle, frame);
    run_for(spec::kClkHz / 2);
    master_.follow(line_settings(run_.chip));
    return master_.take();
  }

  tb::Head head_{tb::HeadConfig{}};
  chip::Run run_;
  MasterEnd master_{line_settings(run_.chip)};
};

TEST_F(Wire, AnswersArrive) {
  const Bytes poll = bytes_of(tb::read_input_registers(1, spec::kInDeviceId, 1));
  const Bytes answer = exchange(poll);
  const auto result = tb::judge_reply(poll, {.bytes = answer});
  EXPECT_EQ(result.outcome, tb::ModbusOutcome::data) << result.problem;
  EXPECT_EQ(result.registers, std::vector<std::uint16_t>{spec::kDeviceId});
}

// Frames that a slow server gets at once are kept apart by the silence that the chip needs, also behind a cut
// one.
TEST_F(Wire, FramesOnEachOthersHeelsAreKeptApart) {
  const Bytes write = bytes_of(tb::write_single_register(0, spec::kHoldingBase + spec::kRegSetpoint, 500));
  Bytes cut = bytes_of(tb::write_single_register(0, spec::kHoldingBase + spec::kRegSetpoint, 600));
  cut.resize(5);
  const Bytes other = bytes_of(tb::write_single_register(0, spec::kHoldingBase + spec::kRegRampUp, 70));
  for (const Bytes& frame : {write, cut, other}) {
    while (master_.sending()) run_for(1000);
    master_.send(run_.cycle, frame);
  }
  run_for(spec::kClkHz / 2);
  EXPECT_EQ(run_.chip.read_register(spec::kHoldingBase + spec::kRegSetpoint), 500);
  EXPECT_EQ(run_.chip.read_register(spec::kHoldingBase + spec::kRegRampUp), 70);
  EXPECT_EQ(run_.chip.uartc.crc_errors(), 1);
}

// The same without that silence: the two become one bad frame. So the test above can fail.
TEST_F(Wire, WithoutTheSilenceTheyRunTogether) {
  Bytes cut = bytes_of(tb::write_single_register(0, spec::kHoldingBase + spec::kRegSetpoint, 600));
  cut.resize(5);
  const Bytes other = bytes_of(tb::write_single_register(0, spec::kHoldingBase + spec::kRegRampUp, 70));
  cut.insert(cut.end(), other.begin(), other.end());
  master_.send(run_.cycle, cut);
  run_for(spec::kClkHz / 2);
  EXPECT_EQ(run_.chip.read_register(spec::kHoldingBase + spec::kRegRampUp), 0);
}

TEST_F(Wire, FollowsTheChipsBaudRateAndFormat) {
  for (const unsigned baud_100 : {12u, 96u, 192u, 1152u, 5000u}) {
    for (unsigned format = 0; format < 4; ++format) {
      const std::vector<std::uint16_t> line{static_cast<std::uint16_t>(baud_100),
                                            static_cast<std::uint16_t>(format)};
      const Bytes write =
          bytes_of(tb::write_multiple_registers(1, spec::kHoldingBase + spec::kRegBaud, line));
      EXPECT_EQ(tb::judge_reply(write, {.bytes = exchange(write)}).outcome, tb::ModbusOutcome::data)
          << line[0] << ' ' << format;
      run_for(spec::kClkHz);
      master_.follow(line_settings(run_.chip));
      EXPECT_EQ(line_settings(run_.chip), (LineSettings{line[0], static_cast<std::uint8_t>(format)}));
      const Bytes poll = bytes_of(tb::read_holding_registers(1, spec::kHoldingBase + spec::kRegBaud, 2));
      EXPECT_EQ(tb::judge_reply(poll, {.bytes = exchange(poll)}).registers, line)
          << baud_100 << " " << format;
    }
  }
  EXPECT_EQ(run_.chip.uartc.char_errors(), 0);
}

TEST_F(Wire, WrongSpeedIsNotUnderstood) {
  MasterEnd slow({96, 0});
  ServedHead around{head_, slow};
  const Bytes poll = bytes_of(tb::read_input_registers(1, spec::kInDeviceId, 1));
  slow.send(run_.cycle, poll);
  chip::advance(run_, run_.cycle + spec::kClkHz / 2, around, [](auto&&...) {});
  EXPECT_TRUE(slow.take().empty());
}

}  // namespace
}  // namespace meltstage::app
