// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/lockstep.hpp"

#include <fmt/format.h>

#include <fstream>
#include <utility>

#include "cmodel/spec.hpp"
#include "recording/text.hpp"
#include "tb/lockstep/verilated_rtl.hpp"

namespace meltstage::tb {

namespace {

constexpr std::uint64_t kWaveClocks = 20'000;  // clocks before a mismatch that the wave file shows
constexpr std::size_t kShownDifferences = 12;

// Pin indices of the stimulus recording, in the order of input_header.
enum InputPin : std::uint32_t { kRstN, kUartRx, kAddrStrap, kSpiMiso, kHeaterFb, kInhibit, kDrop, kTestMode };

chip::Inputs inputs_at(const recording::Cursor& cursor) {
  return {.rst_n = cursor.value(kRstN) != 0,
          .uart_rx = cursor.value(kUartRx) != 0,
          .addr_strap = static_cast<std::uint8_t>(cursor.value(kAddrStrap)),
          .spi_miso = cursor.value(kSpiMiso) != 0,
          .heater_fb = cursor.value(kHeaterFb) != 0,
          .inhibit = cursor.value(kInhibit) != 0,
          .drop = cursor.value(kDrop) != 0,
          .test_mode = cursor.value(kTestMode) != 0};
}

struct PinDifference {
  const char* name;
  bool dut;
  bool model;
};

std::vector<PinDifference> pin_differences(const chip::Outputs& dut, const chip::Outputs& model) {
  std::vector<PinDifference> list;
  const auto compare = [&](const char* name, bool a, bool b) {
    if (a != b) list.push_back({name, a, b});
  };
  compare("uart_tx_o", dut.uart_tx, model.uart_tx);
  compare("uart_de_o", dut.uart_de, model.uart_de);
  compare("tlm_tx_o", dut.tlm_tx, model.tlm_tx);
  compare("spi_sclk_o", dut.spi_sclk, model.spi_sclk);
  compare("spi_cs_no", dut.spi_cs_n, model.spi_cs_n);
  compare("spi_mosi_o", dut.spi_mosi, model.spi_mosi);
  compare("heater_o", dut.heater, model.heater);
  compare("safe_en_o", dut.safe_en, model.safe_en);
  compare("fault_no", dut.fault_n, model.fault_n);
  compare("at_temp_o", dut.at_temp, model.at_temp);
  return list;
}

}  // namespace

recording::Header input_header(const RunIdentity& identity) {
  const auto pin = [](const char* name, unsigned width) {
    return recording::Pin{name, recording::Direction::in, width, "chip"};
  };
  return {.pins = {pin("rst_ni", 1), pin("uart_rx_i", 1), pin("addr_strap_i", 3), pin("spi_miso_i", 1),
                   pin("heater_fb_i", 1), pin("inhibit_i", 1), pin("drop_i", 1), pin("test_mode_i", 1)},
          .clock_hz = chip::spec::kClkHz,
          .origin = fmt::format("lockstep test={} seed={:#x}", identity.test, identity.seed),
          .meta = {{"command", identity.repeat_command}}};
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
  recorder_.set(kRstN, in.rst_n);
  recorder_.set(kUartRx, in.uart_rx);
  recorder_.set(kAddrStrap, in.addr_strap);
  recorder_.set(kSpiMiso, in.spi_miso);
  recorder_.set(kHeaterFb, in.heater_fb);
  recorder_.set(kInhibit, in.inhibit);
  recorder_.set(kDrop, in.drop);
  recorder_.set(kTestMode, in.test_mode);
  recorder_.commit(cycle_);
}

Compared Lockstep::compared() const {
  Compared c = compared_;
  c.pin_values = c.clocks * (chip::spec::kPins.size() - 6);  // the outputs among the pins
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

std::string Lockstep::report(const chip::Outputs& expected, const chip::Outputs& got) const {
  const std::uint64_t in_run = cycle_ - first_cycle_;
  std::string text = fmt::format("MISMATCH test={} seed={:#x} cycle={} t={:.6f} ms  (model against {})\n",
                                 identity_.test, identity_.seed, cycle_,
                                 static_cast<double>(cycle_) * 1e3 / chip::spec::kClkHz, dut_->name());
  for (const PinDifference& d : pin_differences(got, expected)) {
    text += fmt::format("  pin  {:<28} dut={} model={}\n", d.name, d.dut ? 1 : 0, d.model ? 1 : 0);
  }
  const std::vector<FlopDifference> flops = dut_->differences(model_);
  for (std::size_t i = 0; i < flops.size() && i < kShownDifferences; ++i) {
    text += fmt::format("  flop {:<28} dut={:#x} model={:#x} xor={:#x}\n", flops[i].name, flops[i].dut,
                        flops[i].model, flops[i].dut ^ flops[i].model);
  }
  if (flops.size() > kShownDifferences)
    text += fmt::format("  ... {} flops more\n", flops.size() - kShownDifferences);
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

void Lockstep::save(const std::filesystem::path& folder, const std::string& text) {
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "report.txt") << text;
  std::ofstream(folder / "repeat.sh") << "#!/bin/sh\n" << identity_.repeat_command << '\n';
  recorder_.finish(cycle_);
  recording::write_text(stimulus_, folder / "stimulus.mvec");

  // The waves: the same stimulus on a traced RTL, from kWaveClocks before the mismatch.
  const std::uint64_t from = cycle_ - first_cycle_ > kWaveClocks ? cycle_ - kWaveClocks : first_cycle_;
  chip::Chip model = start_;
  recording::Cursor cursor(stimulus_);
  chip::Inputs in;
  for (std::uint64_t at = first_cycle_; at < from; ++at) {
    cursor.advance_to(at);
    in = inputs_at(cursor);
    model.step(in);
  }
  const auto traced = make_traced_rtl(folder / "waves.fst");
  if (from > first_cycle_) traced->load(model, in);
  for (std::uint64_t at = from; at <= cycle_; ++at) {
    cursor.advance_to(at);
    traced->step(inputs_at(cursor));
  }
}

void Lockstep::fail(const chip::Outputs& expected, const chip::Outputs& got) {
  std::string text = report(expected, got);
  if (failures_.empty()) throw Mismatch(text);
  const auto folder = failures_ / fmt::format("{}.{:x}", identity_.test, identity_.seed);
  try {
    save(folder, text);
    text += fmt::format("  saved: {}/{{report.txt,stimulus.mvec,waves.fst,repeat.sh}}\n", folder.string());
  } catch (const std::exception& error) {
    text += fmt::format("  not saved: {}\n", error.what());
  }
  throw Mismatch(text);
}

}  // namespace meltstage::tb
