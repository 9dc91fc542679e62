// SPDX-License-Identifier: Apache-2.0
// Everything around the chip's pins: Modbus host, temperature sensor, heated head, emergency stop.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "base/rng.hpp"
#include "cmodel/chip.hpp"
#include "tb/devices/heater.hpp"
#include "tb/devices/modbus_host.hpp"
#include "tb/devices/spi_sensors.hpp"

namespace meltstage::tb {

struct HeadConfig {
  PlantConfig plant = plant_config("PH-1");
  std::string sensor = "MAX31855";  // part, as in the spec's presets
  double sensor_noise_degc = 0.05;  // sigma, before quantisation
  double conversion_s = 0.0;        // 0: the part's typical time
  double baud = 115200.0;
  UartFormat format = k8E1;
  std::uint8_t addr_strap = 0;
  std::uint64_t seed = 1;
  double clock_hz = chip::spec::kClkHz;
  bool second_switch = true;  // in the supply, held by safe_en_o; without it the supply is always there
};

// The chip's surroundings as one device: takes the chip's output pins of a clock, gives its input pins.
class Head {
 public:
  explicit Head(const HeadConfig& config);

  // Input pins for the clock edge that ends `cycle`, from the output pins standing in it.
  chip::Inputs step(std::uint64_t cycle, const chip::Outputs& out) {
    if (second_switch_ && (out.safe_en != safe_en_ || cycle > relay_opens_)) move_relay(cycle, out.safe_en);
    plant_.set_heater(cycle, out.heater);
    pins_.uart_rx = host_.step(cycle, out.uart_tx);
    pins_.spi_miso = sensor_->step(cycle, out.spi_cs_n, out.spi_sclk, out.spi_mosi);
    pins_.heater_fb = plant_.switch_conducting();
    telemetry_.step(cycle, out.tlm_tx);
    return pins_;
  }
  // First cycle in which an input pin may change, or the head must look at its surroundings, although the
  // output pins stand.
  std::uint64_t next_event() const {
    return std::min(
        {host_.next_event(), sensor_->next_event(), relay_opens_ == kNoEvent ? kNoEvent : relay_opens_ + 1});
  }
  // Supply voltage over nominal, while the second switch is closed.
  void set_supply_ratio(std::uint64_t cycle, double ratio);
  // What the sensor's element has instead of the head's temperature there.
  void set_element_degc(std::optional<double> degc) { element_degc_ = degc; }
  // Emergency stop button.
  void set_inhibit(bool pressed) { pins_.inhibit = pressed; }
  // Droplet trigger line.
  void set_drop(bool high) { pins_.drop = high; }
  void set_reset(bool asserted) { pins_.rst_n = !asserted; }

  ModbusHost& host() { return host_; }
  HeaterPlant& plant() { return plant_; }
  const HeaterPlant& plant() const { return plant_; }
  SpiSensor& sensor() { return *sensor_; }
  TelemetryListener& telemetry() { return telemetry_; }

 private:
  // The second switch: a charge pump on safe_en_o holds the heater's supply while the pin toggles.
  void move_relay(std::uint64_t cycle, bool safe_en);

  double element_degc(std::uint64_t cycle) {
    return element_degc_ ? *element_degc_ : plant_.sensor_degc(cycle);
  }

  std::uint64_t pump_hold_clocks_;
  HeaterPlant plant_;
  std::optional<double> element_degc_;
  bool second_switch_;
  double supply_ratio_ = 1.0;
  bool safe_en_ = false;
  std::uint64_t relay_opens_ = 0;  // the supply falls behind this cycle unless the pin toggles again
  std::unique_ptr<SpiSensor> sensor_;
  ModbusHost host_;
  TelemetryListener telemetry_;
  chip::Inputs pins_;
};

}  // namespace meltstage::tb
