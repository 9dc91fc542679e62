// SPDX-License-Identifier: Apache-2.0
// Bench of the chip tests: Modbus host, sensor and heater feedback around a device, with coverage and safety
// checks each clock.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"
#include "cmodel/spec.hpp"
#include "tb/devices/modbus_host.hpp"
#include "tb/devices/spi_sensors.hpp"
#include "tb/lockstep/coverage.hpp"
#include "tb/lockstep/lockstep.hpp"
#include "tb/lockstep/verilated_rtl.hpp"

namespace meltstage::tb {

namespace spec = chip::spec;

// Value of a holding register.
struct Setting {
  spec::Reg reg;
  std::uint16_t value;
};
using Settings = std::vector<Setting>;

// Short times and a fast line, so that a test needs few clocks: control period 10 ms, 500 kBd, SPI at 2 MHz.
Settings quick(std::initializer_list<Setting> others = {});
// A chip out of reset in which a host has written these registers and they have become active.
chip::Chip chip_with(const Settings& settings);
// Flips the bits of `mask` (22 bits, check bits above the data) in one word of the active set, as a particle
// would.
void flip_active(chip::Chip& chip, spec::Reg reg, std::uint32_t mask);

// What steps: the model alone, or model and RTL in lockstep.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  virtual ~Device() = default;
  virtual chip::Outputs step(const chip::Inputs& in) = 0;
  virtual const chip::Chip& model() const = 0;
  // Goes on from another state with the pins at `in`.
  virtual void restart(const chip::Chip& state, const chip::Inputs& in) = 0;
  // The counters; throws when nothing was compared (a model alone compares nothing and returns zeros).
  virtual Compared finish() = 0;
};

// The model alone, from `start`.
std::unique_ptr<Device> model_alone(const chip::Chip& start);
// Model and Verilated RTL, every flop and pin compared on every clock, from `start`.
// What a mismatch leaves lies in `failures`.
std::unique_ptr<Device> in_lockstep(const chip::Chip& start, const RunIdentity& identity,
                                    const std::filesystem::path& failures = "failures");
// The same against another RTL, whose mismatches leave no files.
using MakeRtl = std::function<std::unique_ptr<VerilatedRtl>()>;
std::unique_ptr<Device> in_lockstep_with(const MakeRtl& make, const chip::Chip& start,
                                         const RunIdentity& identity);

// What stands at heater_fb_i.
enum class Feedback : std::uint8_t { follows, stuck_low, stuck_high };

// Everything outside the pins that a test can turn.
struct World {
  double temperature_degc = 25.0;
  SpiFaults sensor{};
  Feedback feedback = Feedback::follows;
  bool inhibit = false;
  bool drop = false;
  bool test_mode = false;
  bool reset = false;
  std::uint8_t addr_strap = 0;
};

// A safety promise was broken: heater high with a fault, with the emergency stop, or later than promised
// after a cause.
struct SafetyViolation : std::logic_error {
  using std::logic_error::logic_error;
};

class Bench {
 public:
  // `sensor`: part name; its conversions take 5 us of bench time whatever the data sheet says.
  explicit Bench(std::unique_ptr<Device> device, const std::string& sensor = "MAX31855",
                 std::uint64_t seed = 1);

  World world;
  // Temperature at the sensor; by default world.temperature_degc.
  TemperatureSource temperature;

  // One clock. Throws Mismatch or SafetyViolation.
  chip::Outputs clock();
  void run(std::uint64_t clocks);
  // Runs until `condition` of the model holds; false when it does not within `clocks`.
  bool run_until(const std::function<bool(const chip::Chip&)>& condition, std::uint64_t clocks);

  // Starts sending a frame with the chip's present baud rate and format; it goes out while clocks run.
  void send(const ModbusRequest& request);
  bool sending() const { return !transmitter_->idle(); }
  // Sends and waits for the answer (or `wait_clocks` without one: outcome Timeout).
  ModbusResult ask(const ModbusRequest& request, std::uint64_t wait_clocks = 60'000);
  // Function 06 to the chip's address.
  ModbusResult write(spec::Reg reg, std::uint16_t value);
  // Function 16.
  ModbusResult write_block(spec::Reg first, const std::vector<std::uint16_t>& values);
  ModbusResult command(spec::Cmd cmd) { return write(spec::kRegCmd, cmd); }
  // Functions 03 and 04; throw std::runtime_error when the chip does not answer with data.
  std::vector<std::uint16_t> read_holding(unsigned first, unsigned count);
  std::vector<std::uint16_t> read_input(unsigned first, unsigned count);
  std::uint16_t read_input(spec::In address) { return read_input(address, 1)[0]; }

  // Puts the time base of model and RTL just before the next control tick, when the main state machine is at
  // rest, and runs until the tick's work is done. Skips only waiting: every state so reached is one that mere
  // waiting reaches too.
  void next_tick();
  // The same for the next 0.1 s pulse and a control tick with it.
  void next_tenth();
  // Changes the state of model and RTL alike; not while reset is asserted, which would undo it in the RTL.
  void poke(const std::function<void(chip::Chip&)>& change);

  const chip::Chip& model() const { return device_->model(); }
  const chip::Outputs& out() const { return out_; }
  const chip::Inputs& in() const { return in_; }
  std::uint64_t cycle() const { return cycle_; }
  Coverage& coverage() { return coverage_; }
  SpiSensor& sensor() { return *sensor_; }
  UartTransmitter& transmitter() { return *transmitter_; }
  Compared finish() { return device_->finish(); }
  // FNV-1a over the bytes of every change of the input pins, levels and cycle: equal for equal stimulus.
  std::uint64_t stimulus_hash() const { return hash_; }
  std::uint8_t unit() const { return model().uartc.address_q; }

 private:
  void tune();
  void check_safety(std::uint16_t latching_before) const;
  void hash_pins();

  std::unique_ptr<Device> device_;
  std::unique_ptr<SpiSensor> sensor_;
  std::optional<UartTransmitter> transmitter_;
  std::optional<UartReceiver> receiver_;
  std::uint64_t seed_;
  std::uint16_t baud_ = 0;
  std::uint8_t format_ = 0;
  std::uint64_t cycle_ = 0;
  std::uint64_t hash_ = 0xcbf29ce484222325U;
  SpiFaults applied_;
  chip::Inputs in_;
  chip::Inputs hashed_{.rst_n = false};
  chip::Outputs out_;
  Coverage coverage_;
};

}  // namespace meltstage::tb
