// SPDX-License-Identifier: Apache-2.0
// Model and device under test on the same pins, compared on every clock.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cmodel/chip.hpp"
#include "recording/stream.hpp"
#include "tb/pins/dut.hpp"

namespace meltstage::tb {

// Who runs, so that a mismatch can be repeated.
struct RunIdentity {
  std::string test;
  std::uint64_t seed = 0;
  std::string repeat_command;
};

// What was compared; a run that ends with a zero in clocks, pins or flops has proved nothing and fails.
struct Compared {
  std::uint64_t clocks = 0;
  std::uint64_t pin_values = 0;
  std::uint64_t flop_values = 0;  // bits
  std::uint64_t resets = 0;
  std::uint64_t frames = 0;   // Modbus frames that the chip accepted
  std::uint64_t samples = 0;  // sensor samples that it accepted
};

// Clocks from a state of the model; after the last of them device and model differ.
struct FailedStretch {
  chip::Chip start;
  std::vector<chip::Inputs> inputs;  // before each clock
};

// Device and model differ; what() is the one-screen report. `stretch`: what led there, where it is known.
struct Mismatch : std::runtime_error {
  explicit Mismatch(const std::string& report, std::shared_ptr<const FailedStretch> failed = nullptr)
      : std::runtime_error(report), stretch(std::move(failed)) {}
  std::shared_ptr<const FailedStretch> stretch;
};

class Lockstep {
 public:
  // Starts both in reset. `failures`: folder that takes stimulus, report and waves of a mismatch; empty:
  // none.
  Lockstep(std::unique_ptr<Dut> dut, RunIdentity identity, std::filesystem::path failures = "failures");
  // Goes on from `model`, whose state the device must already have, at clock `cycle` of the run.
  Lockstep(std::unique_ptr<Dut> dut, const chip::Chip& model, std::uint64_t cycle, RunIdentity identity,
           std::filesystem::path failures = "failures");

  // One rising clock edge on both. Throws Mismatch at the first clock whose pins or flops differ, or in which
  // an assertion of the device fails.
  chip::Outputs step(const chip::Inputs& in) {
    record(in);
    if (!in.rst_n && last_.rst_n) ++compared_.resets;
    last_ = in;
    const std::uint16_t messages = model_.uartc.messages();
    const std::uint16_t samples = model_.guard.samples_q;
    const chip::Outputs expected = model_.step(in);
    const chip::Outputs got = step_device(in);
    if (got != expected || !dut_->flops_equal(model_)) fail(expected, got);
    ++compared_.clocks;
    compared_.frames += model_.uartc.messages() != messages && in.rst_n;
    compared_.samples += model_.guard.samples_q != samples && in.rst_n;
    ++cycle_;
    return expected;
  }

  const chip::Chip& model() const { return model_; }
  std::uint64_t cycle() const { return cycle_; }
  // Counters so far.
  Compared compared() const;
  // The counters at the end of a run; throws std::logic_error when nothing was compared.
  Compared finish() const;

 private:
  void record(const chip::Inputs& in);
  chip::Outputs step_device(const chip::Inputs& in) {
    try {
      return dut_->step(in);
    } catch (const AssertionFailed& failed) {
      recorder_.finish(cycle_);
      leave("ASSERTION", std::string("  ") + failed.what() + "\n", nullptr);
    }
  }
  [[noreturn]] void fail(const chip::Outputs& expected, const chip::Outputs& got);
  // Saves the run, and throws Mismatch with the report.
  [[noreturn]] void leave(std::string_view what, const std::string& found,
                          std::shared_ptr<const FailedStretch> stretch);
  std::string differences(const chip::Outputs& expected, const chip::Outputs& got) const;
  std::string report(std::string_view what, const std::string& found) const;
  void save(const std::filesystem::path& folder, const std::string& report) const;
  FailedStretch failed_stretch() const;

  chip::Chip model_;
  chip::Chip start_;  // state in which the run began, for the waves of a mismatch
  std::unique_ptr<Dut> dut_;
  RunIdentity identity_;
  std::filesystem::path failures_;
  std::uint64_t first_cycle_ = 0;
  std::uint64_t cycle_ = 0;
  chip::Inputs last_;
  Compared compared_;
  recording::Stream stimulus_;
  recording::Recorder recorder_;
};

// Input pins as a vector header, owner "chip".
recording::Header input_header(const RunIdentity& identity);

}  // namespace meltstage::tb
