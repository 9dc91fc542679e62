// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/lockstep.hpp"

#include <fmt/format.h>

#include <utility>

#include "base/output_file.hpp"
#include "cmodel/spec.hpp"
#include "recording/text.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/chip_pins.hpp"

namespace meltstage::tb {

namespace {

constexpr std::uint64_t kWaveClocks = 20'000;   // clocks before a mismatch that the wave file shows
constexpr std::uint64_t kKeptClocks = 100'000;  // before a mismatch that are handed on with it
constexpr std::size_t kShownDifferences = 12;

// "  pin  heater_o dut=1 model=0" for each output that differs.
std::string pin_differences(const chip::Outputs& dut, const chip::Outputs& model) {
  const auto of_dut = pin_levels({}, dut);
  const auto of_model = pin_levels({}, model);
  std::string text;
  for (std::size_t pin = chip::spec::kInputPins; pin < kChipPinCount; ++pin) {
    if (of_dut[pin] == of_model[pin]) continue;
    text += fmt::format("  pin  {:<28} dut={} model={}\n", chip::spec::kPins[pin].name, of_dut[pin],
                        of_model[pin]);
  }
  return text;
}

}  // namespace

recording::Header input_header(const RunIdentity& identity) {
  recording::Header header =
      chip_pin_header(fmt::format("lockstep test={} seed={:#x}", identity.test, identity.seed));
  header.pins.resize(chip::spec::kInputPins);
  header.meta["command"] = identity.repeat_command;
  return header;
}

Lockstep::Lockstep(std::unique_ptr<Dut> dut, RunIdentity identity, std::filesystem::path failures)
    : Lockstep(std::move(dut), chip::Chip{}, 0, std::move(identity), std::move(failures)) {}

Lockstep::Lockstep(std::unique_ptr<Dut> dut, const chip::Chip& model, std::uint64_t cycle,
                   RunIdentity identity, std::filesystem::path failures)
    : model_(model),
      start_(model),
      dut_(std::move(dut)),
      identity_(std::move(identity)),
      failures_(std::move(failures)),
      first_cycle_(cycle),
      cycle_(cycle),
      recorder_(stimulus_, input_header(identity_)) {}

void Lockstep::record(const chip::Inputs& in) {
  record_inputs(recorder_, in);
  recorder_.commit(cycle_);
}

Compared Lockstep::compared() const {
  Compared c = compared_;
  c.pin_values = c.clocks * chip::spec::kOutputPins;
  c.flop_values = c.clocks * dut_->flop_bits();
  return c;
}

Compared Lockstep::finish() const {
  const Compared c = compared();
  if (c.clocks == 0 || c.pin_values == 0 || c.flop_values == 0) {
    throw std::logic_error(
        fmt::format("lockstep test={}: nothing was compared: {} clocks, {} pin values, {} flop bits",
                    identity_.test, c.clocks, c.pin_values, c.flop_values));
  }
  return c;
}

std::string Lockstep::differences(const chip::Outputs& expected, const chip::Outputs& got) const {
  std::string text = pin_differences(got, expected);
  const std::vector<FlopDifference> flops = dut_->differences(model_);
  for (std::size_t i = 0; i < flops.size() && i < kShownDifferences; ++i) {
    text += fmt::format("  flop {:<28} dut={:#x} model={:#x} xor={:#x}\n", flops[i].name, flops[i].dut,
                        flops[i].model, flops[i].dut ^ flops[i].model);
  }
  if (flops.size() > kShownDifferences)
    text += fmt::format("  ... {} flops more\n", flops.size() - kShownDifferences);
  return text;
}

std::string Lockstep::report(std::string_view what, const std::string& found) const {
  const std::uint64_t in_run = cycle_ - first_cycle_;
  std::string text = fmt::format("{} test={} seed={:#x} cycle={} t={:.6f} ms  (model against {})\n{}", what,
                                 identity_.test, identity_.seed, cycle_,
                                 static_cast<double>(cycle_) * 1e3 / chip::spec::kClkHz, dut_->name(), found);
  text += in_run == 0 ? std::string("  no clock of this run was equal\n")
                      : fmt::format("  last equal cycle {}\n", cycle_ - 1);
  text += fmt::format("  model: state={} fault={:#06x} T={:.3f} degC duty={:.2f} %\n",
                      chip::spec::state_name(model_.sysctrl.state_q), model_.guard.fault_q,
                      model_.guard.pv_q / 64.0, model_.algor.duty_q * 100.0 / 65536.0);
  text += fmt::format("  last frame: fc={} a={:#06x} b={:#06x}, {} accepted so far\n", model_.uartc.cmd_fc(),
                      model_.uartc.cmd_a(), model_.uartc.cmd_b(), model_.uartc.messages());
  text += fmt::format("  compared: {} clocks x ({} flop bits + pins)\n", compared_.clocks, dut_->flop_bits());
  text += fmt::format("  repeat: {}\n", identity_.repeat_command);
  return text;
}

void Lockstep::save(const std::filesystem::path& folder, const std::string& text) const {
  std::filesystem::create_directories(folder);
  write_whole(folder / "report.txt", text);
  write_whole(folder / "repeat.sh", fmt::format("#!/bin/sh\n{}\n", identity_.repeat_command));
  recording::write_text(stimulus_, folder / "stimulus.mvec");

  // The waves: the same stimulus on a traced RTL, from kWaveClocks before the mismatch.
  const std::uint64_t from = cycle_ - first_cycle_ > kWaveClocks ? cycle_ - kWaveClocks : first_cycle_;
  chip::Chip model = start_;
  recording::Cursor cursor(stimulus_);
  chip::Inputs in;
  for (std::uint64_t at = first_cycle_; at < from; ++at) {
    cursor.advance_to(at);
    in = inputs_of(cursor.values());
    model.step(in);
  }
  const auto traced = make_traced_rtl(folder / "waves.fst");
  traced->set_assertions(false);  // the last clock may be the one that breaks one
  if (from > first_cycle_) traced->load(model, in);
  for (std::uint64_t at = from; at <= cycle_; ++at) {
    cursor.advance_to(at);
    traced->step(inputs_of(cursor.values()));
  }
}

FailedStretch Lockstep::failed_stretch() const {
  const std::uint64_t from = cycle_ - first_cycle_ > kKeptClocks ? cycle_ - kKeptClocks : first_cycle_;
  FailedStretch stretch{start_, {}};
  recording::Cursor cursor(stimulus_);
  for (std::uint64_t at = first_cycle_; at <= cycle_; ++at) {
    cursor.advance_to(at);
    const chip::Inputs in = inputs_of(cursor.values());
    if (at < from)
      stretch.start.step(in);
    else
      stretch.inputs.push_back(in);
  }
  return stretch;
}

void Lockstep::fail(const chip::Outputs& expected, const chip::Outputs& got) {
  recorder_.finish(cycle_);
  leave("MISMATCH", differences(expected, got), std::make_shared<const FailedStretch>(failed_stretch()));
}

void Lockstep::leave(std::string_view what, const std::string& found,
                     std::shared_ptr<const FailedStretch> stretch) {
  std::string text = report(what, found);
  if (failures_.empty()) throw Mismatch(text, std::move(stretch));
  const auto folder = failures_ / fmt::format("{}.{:x}", identity_.test, identity_.seed);
  try {
    save(folder, text);
    text += fmt::format("  saved: {}/{{report.txt,stimulus.mvec,waves.fst,repeat.sh}}\n", folder.string());
  } catch (const std::exception& error) {
    text += fmt::format("  not saved: {}\n", error.what());
  }
  throw Mismatch(text, std::move(stretch));
}

}  // namespace meltstage::tb
