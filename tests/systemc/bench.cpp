// SPDX-License-Identifier: Apache-2.0
#include "bench.hpp"

#include <utility>

namespace meltstage::systemc {

namespace {

constexpr double kClockHz = chip::spec::kClkHz;
// The devices have had power for 0.3 s: the sensor's first conversion takes 0.2 s (MAX31855 data sheet,
// power-up time).
constexpr std::uint64_t kPoweredClocks = 3 * chip::spec::kClkHz / 10;
const sc_core::sc_time kPeriod(1e9 / kClockHz, sc_core::SC_NS);
// The bench stops at whole periods, away from the clock's edges, where a case may move pins.
const sc_core::sc_time kFirstEdge = 0.25 * kPeriod;

template <class Module>
void bind(Module& module, PinsOut& out) {
#define TC_BIND(port, member, bits) module.port(out.port);
  TC_OUTPUT_PINS(TC_BIND)
#undef TC_BIND
}

}  // namespace

std::array<bool, chip::spec::kOutputPins> PinsOut::levels() const {
  return {
#define TC_LEVEL(port, member, bits) port,
      TC_OUTPUT_PINS(TC_LEVEL)
#undef TC_LEVEL
  };
}

Devices::Devices()
    : plant(tb::plant_config("PH-1"), kClockHz),
      sensor(tb::make_spi_sensor(
          "MAX31855", {.clock_hz = kClockHz,
                       .source = [this](std::uint64_t cycle) { return plant.sensor_degc(cycle); }})),
      host({.line = {kClockHz, 115200.0, tb::k8E1}}, stream(1, "host")) {}

Bench::Bench(const sc_core::sc_module_name& name)
    : sc_core::sc_module(name), clk_("clk", kPeriod, 0.5, kFirstEdge) {
  only_ = this;
  uart_rx_.write(true);  // idle
  const auto connect = [this](auto& module, PinsOut& out) {
    module.clk_i(clk_);
#define TC_BIND(port, member, bits) module.port(member##_);
    TC_INPUT_PINS(TC_BIND)
#undef TC_BIND
    bind(module, out);
  };
  connect(model.pins, of_model_);
  connect(rtl_, of_rtl_);
  socket.bind(model.socket);
  SC_HAS_PROCESS(Bench);
  SC_METHOD(falling_edge);
  sensitive << clk_.negedge_event();
  dont_initialize();
}

void Bench::reset() {
  devices_.emplace();
  cycle_ = kPoweredClocks;
  inhibit_.write(false);
  drop_.write(false);
  rst_n_.write(true);  // so that a falling edge follows: reset acts without a clock
  settle();
  rst_n_.write(false);
  settle();
  clocks(5);
  rst_n_.write(true);
  compared_ = 0;
  heater_edges_ = 0;
  difference_.clear();
}

void Bench::clocks(std::uint64_t count) { sc_core::sc_start(static_cast<double>(count) * kPeriod); }

void Bench::settle() {
  sc_core::sc_start(sc_core::sc_time(1, sc_core::SC_PS));
  compare();
}

tb::ModbusResult Bench::ask(tb::ModbusRequest request) {
  devices_->host.submit(std::move(request));
  for (;;) {
    clocks(1000);
    if (auto result = devices_->host.take_result()) return *result;
  }
}

void Bench::falling_edge() {
  compare();
  heater_edges_ += of_model_.heater_o.read() != heater_past_;
  heater_past_ = of_model_.heater_o.read();
  ++cycle_;
  const PinsOut& out = of_model_;
  Devices& around = *devices_;
  around.plant.set_heater(cycle_, out.heater_o);
  uart_rx_.write(around.host.step(cycle_, out.uart_tx_o));
  spi_miso_.write(around.sensor->step(cycle_, out.spi_cs_no, out.spi_sclk_o, out.spi_mosi_o));
  heater_fb_.write(around.plant.switch_conducting());
}

void Bench::compare() {
  ++compared_;
  const auto model_levels = of_model_.levels();
  const auto rtl_levels = of_rtl_.levels();
  if (!difference_.empty() || model_levels == rtl_levels) return;
  for (std::size_t i = 0; i < model_levels.size(); ++i) {
    if (model_levels[i] == rtl_levels[i]) continue;
    difference_ += std::string(chip::spec::kPins[chip::spec::kInputPins + i].name) + " model " +
                   (model_levels[i] ? "1" : "0") + " RTL " + (rtl_levels[i] ? "1" : "0") + " clock " +
                   std::to_string(cycle_) + "; ";
  }
}

}  // namespace meltstage::systemc
