// SPDX-License-Identifier: Apache-2.0
#include "recording.hpp"

#include <stdlib.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tb/pins/chip_pins.hpp"
#include "tb/pins/head.hpp"
#include "tb/windows/window_state.hpp"

namespace meltstage::tb {

namespace {

namespace spec = chip::spec;

constexpr std::uint64_t kMs = spec::kClkHz / 1000;
constexpr std::uint64_t kEnd = 240 * kMs;
constexpr std::uint64_t kReset = 232 * kMs + 300;  // inside the answer to a poll
constexpr std::uint64_t kInhibit = 215 * kMs + 17;

Recording record() {
  Recording recording;
  Head head({});
  chip::Chip chip;
  chip::Outputs out = chip.outputs({.rst_n = false});
  recording::Recorder recorder(recording.pins, chip_pin_header("windows test"));
  const auto found = [&](const char* name, std::uint64_t cycle, bool here) {
    if (here) recording.landmarks.try_emplace(name, cycle);
  };
  const auto submit = [&](ModbusRequest request) { head.host().submit(std::move(request)); };
  const auto write = [&](unsigned reg, std::uint16_t value) {
    submit(write_single_register(1, static_cast<std::uint16_t>(spec::kHoldingBase + reg), value));
  };
  chip::Outputs before = out;
  for (std::uint64_t cycle = 0; cycle < kEnd; ++cycle) {
    if (cycle == 1000) {
      submit(write_single_register(1, spec::kHoldingBase, spec::kCmdHold));
      write(spec::kRegTlmPeriod, 1);
      write(spec::kRegSetpoint, 1100);
      write(spec::kRegMode, spec::word_of({spec::kModeManual}));
      write(spec::kRegManualDuty, 3000);
      write(spec::kRegDtdtMax, 0);  // the sensor's first reading is 0 degC
      submit(write_single_register(1, spec::kHoldingBase, spec::kCmdCommit));
    }
    if (cycle == 103 * kMs) submit(write_single_register(1, spec::kHoldingBase, spec::kCmdRun));
    if (cycle > 180 * kMs && cycle % (5 * kMs) == 0) submit(read_input_registers(1, 0, 16));
    while (head.host().take_result()) {
    }
    head.set_inhibit(cycle >= kInhibit && cycle < kInhibit + 3 * kMs);
    head.set_reset(cycle < 20 || (cycle >= kReset && cycle < kReset + 50));
    const chip::Inputs in = head.step(cycle, out);
    out.heater = out.heater && !in.inhibit;

    found("start bit of a frame", cycle, !in.uart_rx);
    found("inside an SPI word", cycle,
          cycle > 190 * kMs && !out.spi_cs_n && out.spi_sclk && !before.spi_sclk);
    found("PWM rises", cycle, out.heater && !before.heater);
    found("PWM falls", cycle, !out.heater && before.heater);
    found("commit", cycle, cycle > 1000 && chip.sysctrl.commit_q != 0);
    found("control step", cycle, cycle > 190 * kMs && chip.sysctrl.algor_start_q != 0);
    found("answer begins", cycle, out.uart_de && !before.uart_de);
    found("telemetry", cycle, !out.tlm_tx);
    before = out;

    const auto levels = pin_levels(in, out);
    for (std::uint32_t pin = 0; pin < kChipPinCount; ++pin) recorder.set(pin, levels[pin]);
    recorder.commit(cycle);
    out = chip.step(in);
  }
  recorder.finish(kEnd - 1);
  recording.landmarks["reset falls"] = kReset;
  recording.landmarks["reset rises"] = kReset + 50;
  recording.landmarks["out of reset"] = 20;
  recording.landmarks["inhibit"] = kInhibit;
  // About 4 characters on: inside a data bit.
  recording.landmarks["inside a frame"] = recording.landmarks.at("start bit of a frame") + 4500;
  recording.landmarks["inside an answer"] = recording.landmarks.at("answer begins") + 3000;
  recording.end = chip;
  return recording;
}

}  // namespace

const Recording& lively_recording() {
  static const Recording recording = record();
  return recording;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "meltstage_windows.XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": cannot be made");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string text_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

void set_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string sealed_state(std::string text) {
  text.resize(text.rfind("sha256 "));
  return text + "sha256 " + sha256(text) + "\n";
}

}  // namespace meltstage::tb
