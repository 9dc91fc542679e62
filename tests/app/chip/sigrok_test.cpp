// SPDX-License-Identifier: Apache-2.0
// sigrok-cli, as Debian ships it, decodes the recorded pins: the same bytes, frames and sensor words as the
// programs at the port and the chip's registers had.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <sstream>
#include <vector>

#include "host/controller.hpp"
#include "tests/host/served_chip.hpp"

namespace meltstage {
namespace {

namespace spec = chip::spec;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) all.push_back(line);
  return all;
}

// A recording of the chip's pins, and what was read over the wire meanwhile.
class Sigrok : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    // Slower than real time, so that a busy machine records no more than it must.
    chip_ = std::make_unique<ServedChip>(fmt::format("--vcd w.vcd --speed 0.5 {}", GetParam()));
    host::Connection connection;
    connection.device = chip_->port();
    connection.timeout_s = 10.0;
    host::Controller controller(connection);
    identity_ = controller.identity();
    controller.write(std::vector<host::Setting>{{&host::find_register("SETPOINT"), kSetpoint_degc}});
    const std::vector<const host::Register*> wanted{
        &host::find_register("RAW_H"), &host::find_register("RAW_L"), &host::find_register("SAMPLES")};
    do {
      raw_ = controller.read(wanted);
    } while (raw_[2] < kSamples);
    EXPECT_EQ(controller.read(host::find_register("SENSOR_ERRORS")), 0.0);
    messages_ = static_cast<unsigned>(controller.read(host::find_register("MESSAGES")));
    ASSERT_EQ(chip_->stop(SIGTERM), 0) << chip_->output();
  }

  std::vector<std::string> decode(const std::string& decoder, const std::string& annotations) const {
    // 12 MHz: the file's 1 ps would be 83333 samples a clock.
    const Ran ran = run_shell(fmt::format("sigrok-cli -I vcd:downsample=83333 -i {} -P {} -A {}",
                                          (chip_->folder() / "w.vcd").string(), decoder, annotations));
    EXPECT_EQ(ran.status, 0) << ran.output;
    return lines(ran.output);
  }
  static std::string uart(const std::string& parity = "even", int baud = 115200) {
    return fmt::format("uart:rx=uart_tx_o:tx=uart_rx_i:baudrate={}:parity={}", baud, parity);
  }

  // Each with a control: decoded the wrong way the same values are not there.
  void check_uart() const;
  void check_modbus() const;
  void check_spi() const;

  static constexpr double kSetpoint_degc = 123.4;
  static constexpr unsigned kSamples = 2;
  std::unique_ptr<ServedChip> chip_;
  host::Identity identity_;
  std::vector<std::uint16_t> raw_;  // RAW_H, RAW_L, SAMPLES of one control period
  unsigned messages_ = 0;
};

void Sigrok::check_uart() const {
  // FC 06 to address 1: SETPOINT 0x0101 = 1234, and its echo.
  const auto frame_in = [](const std::vector<std::string>& bytes) {
    const std::vector<std::string> start{"01", "06", "01", "01", "04", "D2"};
    std::vector<std::string> values;
    for (const std::string& line : bytes) values.push_back(line.substr(line.rfind(' ') + 1));
    return std::search(values.begin(), values.end(), start.begin(), start.end()) != values.end();
  };
  EXPECT_TRUE(frame_in(decode(uart(), "uart=tx-data")));
  EXPECT_TRUE(frame_in(decode(uart(), "uart=rx-data")));
  EXPECT_THAT(decode(uart(), "uart=rx-parity-err:tx-parity-err:rx-warnings:tx-warnings"), IsEmpty());
  // Decoded as another line they are not there.
  EXPECT_FALSE(frame_in(decode(uart("even", 57600), "uart=tx-data")));
  EXPECT_THAT(decode(uart("odd"), "uart=rx-parity-err:tx-parity-err:rx-warnings:tx-warnings"),
              Not(IsEmpty()));
}

void Sigrok::check_modbus() const {
  const auto rows = decode(uart() + ",modbus", "modbus");
  const auto count = [&](const std::string& text) {
    return std::count_if(rows.begin(), rows.end(),
                         [&](const std::string& r) { return r.find(text) != r.npos; });
  };
  EXPECT_EQ(count("CRC correct"), 2 * messages_);  // a request and an answer each
  EXPECT_EQ(count("CRC should be"), 0);
  EXPECT_EQ(count("rror"), 0);
  EXPECT_GE(count("Function 4: Read Input Registers"), 2);
  EXPECT_EQ(count("Function 6: Write Single Register"), 2);
  for (const std::uint16_t word : {spec::kDeviceId, spec::kVersion, spec::kMapCrc, raw_[0], raw_[1], raw_[2]})
    EXPECT_GE(count(fmt::format("0x{:04X} / {}", word, word)), 1) << word;
  const auto setpoint = static_cast<unsigned>(host::to_raw(host::find_register("SETPOINT"), kSetpoint_degc));
  EXPECT_EQ(count(fmt::format("Register Value 0x{:X} / {}", setpoint, setpoint)), 2);
  // At another speed there are no such frames.
  EXPECT_THAT(decode(uart("even", 57600) + ",modbus", "modbus"),
              Not(Contains(HasSubstr(fmt::format("0x{:04X} / ", spec::kDeviceId)))));
}

void Sigrok::check_spi() const {
  const auto words = [&](const std::string& mode) {
    return decode("spi:clk=spi_sclk_o:miso=spi_miso_i:mosi=spi_mosi_o:cs=spi_cs_no" + mode,
                  "spi=miso-transfer");
  };
  const std::string expected =
      fmt::format("{:02X} {:02X} {:02X} {:02X}", raw_[0] >> 8, raw_[0] & 0xFF, raw_[1] >> 8, raw_[1] & 0xFF);
  const auto sent = words("");
  ASSERT_GE(sent.size(), raw_[2]);
  EXPECT_THAT(sent[raw_[2] - 1U], HasSubstr(expected));
  // The other clock edge shows other words.
  const auto wrong = words(":cpha=1");
  EXPECT_TRUE(wrong.size() < raw_[2] || wrong[raw_[2] - 1U].find(expected) == std::string::npos);
}

TEST_P(Sigrok, DecodersSeeWhatTheProgramsSaw) {
  check_uart();
  check_modbus();
  check_spi();
}

INSTANTIATE_TEST_SUITE_P(Model, Sigrok, ::testing::Values(""));
INSTANTIATE_TEST_SUITE_P(Rtl, Sigrok, ::testing::Values("--rtl"));

}  // namespace
}  // namespace meltstage
