// SPDX-License-Identifier: Apache-2.0
// The C++ model (pins and TLM-2.0 socket) and the Verilated RTL side by side: the same signals go into both,
// every output pin is compared.
#pragma once

#include <tlm_utils/simple_initiator_socket.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <systemc>

#include "systemc/chip_tlm.hpp"
#include "systemc/rtl_module.hpp"
#include "tb/devices/heater.hpp"
#include "tb/devices/modbus_host.hpp"
#include "tb/devices/spi_sensors.hpp"

namespace meltstage::systemc {

// The output pins of one of both.
struct PinsOut {
#define TC_SIGNAL(port, member, bits) sc_core::sc_signal<bool> port;
  TC_OUTPUT_PINS(TC_SIGNAL)
#undef TC_SIGNAL
  // Level of each, in the order of the pins.
  std::array<bool, chip::spec::kOutputPins> levels() const;
};

// What stands around the chip: Modbus host, MAX31855, heated head. Renewed at each reset.
struct Devices {
  Devices();
  tb::HeaterPlant plant;
  std::unique_ptr<tb::SpiSensor> sensor;
  tb::ModbusHost host;
};

class Bench : public sc_core::sc_module {
 public:
  // The process's only one: SystemC elaborates once, so cases share it and begin with reset().
  explicit Bench(const sc_core::sc_module_name& name);
  static Bench& instance() { return *only_; }

  // Asserts reset between clock edges, renews the devices, clocks, releases reset; clears what was counted.
  void reset();
  // Clock edges, with the devices at the pins.
  void clocks(std::uint64_t count);
  // Submits to the Modbus host and clocks until the answer has come.
  tb::ModbusResult ask(tb::ModbusRequest request);
  // Lets changes of the input pins act without a clock, and compares.
  void settle();
  void set_inhibit(bool pressed) { inhibit_.write(pressed); }
  void set_drop(bool high) { drop_.write(high); }
  void set_reset(bool asserted) { rst_n_.write(!asserted); }

  // Since reset(): how often all output pins were compared, and edges of heater_o.
  std::uint64_t compared() const { return compared_; }
  std::uint64_t heater_edges() const { return heater_edges_; }
  // The pins that were not equal when any first was: names, levels, clock; empty when all were.
  const std::string& difference() const { return difference_; }

  bool heater() const { return of_model_.heater_o.read(); }
  bool fault_n() const { return of_model_.fault_no.read(); }

  tlm_utils::simple_initiator_socket<Bench> socket{"socket"};
  TcChipTlm model{"model"};

 private:
  void falling_edge();
  void compare();

  static inline Bench* only_ = nullptr;
  TcRtl rtl_{"rtl"};
  sc_core::sc_clock clk_;
#define TC_SIGNAL(port, member, bits) sc_core::sc_signal<Level<bits>> member##_{#member};
  TC_INPUT_PINS(TC_SIGNAL)
#undef TC_SIGNAL
  PinsOut of_model_, of_rtl_;
  std::optional<Devices> devices_;
  std::uint64_t cycle_ = 0;
  std::uint64_t compared_ = 0;
  std::uint64_t heater_edges_ = 0;
  bool heater_past_ = false;
  std::string difference_;
};

}  // namespace meltstage::systemc
