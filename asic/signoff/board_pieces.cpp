// SPDX-License-Identifier: Apache-2.0
// The functional set for the chip on a small FPGA (fpga/): the host writes only registers that stay writable
// there, reads only what does not come from the blocks that are left out, and every value stays at its reset
// value otherwise.
#include <algorithm>
#include <array>
#include <initializer_list>
#include <string>

#include "asic/signoff/functional_session.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

namespace {

constexpr std::int16_t kRoom = 25 * 64;  // 1/64 degC
constexpr std::int16_t kStep = 2 * 64;   // between two samples: DTDT_MAX takes it for a head's
constexpr std::int32_t kSetpoint = 420;  // 0.1 degC
constexpr std::int32_t kSetpointTop = 1450;
constexpr std::int32_t kControlPeriod_ms = 10;

std::uint16_t register_address(unsigned reg) { return static_cast<std::uint16_t>(spec::kHoldingBase + reg); }

class BoardPieces {
 public:
  FunctionalSet record() {
    identity();
    regulation();
    inhibit();
    over_temperature();
    bad_sensor();
    feedback();
    not_heating();
    watchdog();
    protocol();
    return s_.finish();
  }

 private:
  // SENS_TYPE at reset is the MAX31855: 14 bits of 0.25 degC on top of a word of 32.
  void sensor_at(std::int16_t sixty_fourths) {
    temperature_ = sixty_fourths;
    s_.sensor().set(static_cast<std::uint32_t>(sixty_fourths >> 4) << 18, 32, 0);
  }
  void go_to(std::int16_t sixty_fourths) {
    while (temperature_ != sixty_fourths) {
      const int way = sixty_fourths - temperature_;
      sensor_at(static_cast<std::int16_t>(temperature_ + std::clamp<int>(way, -kStep, kStep)));
      s_.ticks();
    }
    s_.ticks(2);
  }
  void start(std::uint8_t strap = 0) {
    sensor_at(kRoom);
    s_.reset(strap);
    s_.write(spec::kRegTs, kControlPeriod_ms);
    s_.write(spec::kRegHostWd, 0);
    s_.ticks(3);
  }
  void heat_to(std::int32_t setpoint_tenths) {
    s_.write(spec::kRegSetpoint, setpoint_tenths);
    s_.ticks();
    s_.command(spec::kCmdRun);
    s_.run(100);
    if (s_.chip().guard.run_q == 0)
      s_.fail("heating did not begin: causes " + std::to_string(s_.chip().guard.cause_q));
  }
  void tripped(unsigned fault) {
    s_.read_loop();
    if (s_.chip().guard.fault_q != 1U << fault)
      s_.fail("found faults " + std::to_string(s_.chip().guard.fault_q) + ", expected " +
              std::to_string(1U << fault));
    s_.refused(tb::write_single_register(s_.address(), register_address(spec::kRegCmd), spec::kCmdRun),
               spec::kExcDevice);
  }

  void identity() {
    s_.begin("reset, address straps, identification");
    for (const std::uint8_t strap : std::initializer_list<std::uint8_t>{5, 2, 0}) {
      s_.reset(strap, TimeBase::real);
      s_.ask(tb::report_server_id(s_.address()));
    }
    s_.read_holding();
    s_.ask(tb::read_device_identification(s_.address(), 1, 0));
  }

  // A head of one time constant on the duty that the chip computes.
  void regulation() {
    s_.begin("closed loop to its set-point, droplets, a new set-point");
    start(3);
    heat_to(kSetpoint);
    constexpr double kGain_degc = 60, kLag = 30;  // rise at full duty; control periods
    double rise_degc = 0;
    for (int tick = 0; tick < 150; ++tick) {
      if (tick == 120) s_.write(spec::kRegSetpoint, kSetpoint - 50);
      const double duty = s_.chip().algor.duty_q / 65536.0;
      rise_degc += (kGain_degc * duty - rise_degc) / kLag;
      sensor_at(static_cast<std::int16_t>(kRoom + 64 * rise_degc));
      if (tick % 10 == 9) s_.droplet(4);
      if (tick % 30 == 29) s_.read_loop();
      s_.ticks();
    }
    s_.command(spec::kCmdStop);
    s_.read_loop();
  }

  void inhibit() {
    s_.begin("emergency stop");
    start();
    heat_to(kSetpoint);
    s_.ticks(2);
    s_.set_inhibit(true);
    s_.run(500);
    tripped(spec::kFaultInhibit);
    s_.set_inhibit(false);
    s_.command(spec::kCmdClearFault);
    s_.command(spec::kCmdRun);
    s_.ticks(2);
    s_.command(spec::kCmdStop);
  }

  void over_temperature() {
    s_.begin("over temperature");
    start();
    heat_to(kSetpointTop);
    go_to(static_cast<std::int16_t>(spec::kHolding[spec::kRegTMax].reset * 64 / 10 + kStep));
    tripped(spec::kFaultOverTemp);
  }

  void bad_sensor() {
    s_.begin("sensor: open thermocouple, then a line stuck high");
    start();
    heat_to(kSetpoint);
    s_.sensor().set(1, 32, 0);
    s_.ticks(4);
    tripped(spec::kFaultSensorStale);  // in test time two control periods are SAMPLE_TIMEOUT
    sensor_at(kRoom);
    s_.ticks(2);
    s_.command(spec::kCmdClearFault);
    s_.sensor().set(0xFFFFFFFF, 32, 0);
    s_.ticks(4);
    s_.read_loop();
  }

  void feedback() {
    s_.begin("heater feedback");
    start();
    s_.hold_feedback(true);
    s_.run(2000);
    tripped(spec::kFaultHeaterFb);
    s_.free_feedback();
  }

  void not_heating() {
    s_.begin("not heating");
    start();
    heat_to(kSetpointTop);
    s_.run(2 * kTestTenth * static_cast<std::uint64_t>(spec::kHolding[spec::kRegLbaTime].reset));
    tripped(spec::kFaultNotHeating);
  }

  void watchdog() {
    s_.begin("host's silence");
    start();
    constexpr std::int32_t kTenths = 300;
    s_.write(spec::kRegHostWd, kTenths);
    heat_to(kSetpoint);
    s_.run(2 * kTenths * kTestTenth);
    tripped(spec::kFaultHostWatchdog);
  }

  void protocol() {
    s_.begin("Modbus: exceptions, a spoilt frame, another slave");
    start();
    const std::array<std::uint8_t, 6> unknown_function = {s_.address(), 5, 0, 0, 0, 0};
    const std::array<std::uint8_t, 8> wrong_crc = {s_.address(), 3, 1, 0, 0, 1, 0, 0};
    const auto neighbour = static_cast<std::uint8_t>(s_.address() + 1);
    s_.refused(
        tb::write_single_register(s_.address(), register_address(spec::kRegSetpoint), kSetpointTop + 1),
        spec::kExcValue);
    s_.refused(tb::read_holding_registers(s_.address(), register_address(spec::kHoldingCount), 1),
               spec::kExcAddress);
    s_.refused(tb::with_crc(unknown_function), spec::kExcFunction);
    s_.unanswered(tb::raw_frame(wrong_crc));
    s_.unanswered(tb::read_holding_registers(neighbour, register_address(0), 1));
    s_.ask(tb::diagnostic_echo(s_.address(), 0xA55A));
    s_.read_holding();
  }

  FunctionalSession s_;
  std::int16_t temperature_ = kRoom;
};

}  // namespace

FunctionalSet board_set() { return BoardPieces().record(); }

}  // namespace meltstage::app
