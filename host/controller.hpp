// SPDX-License-Identifier: Apache-2.0
// A chip on a serial port, in the operator's units, over libmodbus. Several programs may use one port at a
// time: each transaction takes the port's lock (flock).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cmodel/spec.hpp"
#include "host/errors.hpp"
#include "host/register_map.hpp"

namespace meltstage::host {

/// Character format: 8 data bits, parity, stop bits: 8E1, 8O1, 8N2 or 8N1.
struct LineFormat {
  char parity;  ///< 'E', 'O' or 'N'
  int stop_bits;
};

/// "8E1", "8O1", "8N2" or "8N1"; throws UserError for anything else.
LineFormat parse_format(const std::string& text);

/// Where the chip is, and how patient the driver.
struct Connection {
  std::string device;
  int address = 1;  ///< 1..247
  int baud = 115200;
  LineFormat format{'E', 1};
  double timeout_s = 1.0;  ///< from the request to the answer, 0.01..60
  /// Of a transaction without a sound answer, 1 or more; each one writes the same values, so repeats are
  /// safe.
  int attempts = 3;
};

/// A register and the value to write to it, in its unit.
struct Setting {
  const Register* reg;
  double value;
};

/// The chip at one moment: one poll of the first input registers.
struct Status {
  std::uint16_t bits;                      ///< STATUS
  std::optional<double> temperature_degc;  ///< nothing before the first sample
  double setpoint_degc;                    ///< working set-point, after the ramp
  double duty_percent;
  double slope_degc;  ///< change between the last two samples
  double p_percent, i_percent, d_percent;
  std::uint16_t faults;  ///< FAULT, latched
  std::uint16_t causes;  ///< CAUSE, present now
  std::optional<chip::spec::Fault> first_fault;
  chip::spec::State state;
  std::uint16_t samples;
  double watchdog_left_s;

  bool running() const { return (bits >> chip::spec::kStatusRun & 1U) != 0; }
  bool at_temperature() const { return (bits >> chip::spec::kStatusAtTemperature & 1U) != 0; }
};

/// Who answers: text of function 17, and the registers that tell chip and map.
struct Identity {
  std::string text;
  std::uint16_t device_id;
  std::uint16_t version;
  std::uint16_t map_crc;
};

enum class TuningPhase : std::uint8_t {
  never_ran = chip::spec::kTuningNeverRan,
  runs = chip::spec::kTuningRuns,
  finished = chip::spec::kTuningFinished,
  stopped = chip::spec::kTuningStopped,
  timed_out = chip::spec::kTuningTimedOut
};

/// The chip's autotune.
struct Tuning {
  TuningPhase phase;
  int cycles;       ///< done, while it runs
  double ku_per_k;  ///< ultimate gain, duty (0..1) per degree
  double tu_s;      ///< ultimate period
  double hold_duty_percent;
};

/// Every call throws NoAnswer when no sound answer comes, BusError when the chip refuses, naming the
/// registers.
class Controller {
 public:
  /// Opens the port; nothing is sent. Throws UserError when it can't be opened or a setting is out of range.
  explicit Controller(const Connection& connection);
  ~Controller();
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  Identity identity();
  /// Throws UserError when another device, or a chip with another register map, answers.
  void check_identity();

  /// Words of these registers, in their order; neighbours share a poll. Throws UserError for one that can't
  /// be read.
  std::vector<std::uint16_t> read(std::span<const Register* const> wanted);
  /// The value in its unit. Throws BusError for PV before the first sample, which has none; PV_FINE is 0
  /// then.
  double read(const Register& reg);
  Status status();

  /// Writes all or none, active together at the chip's next control tick: one frame when the registers are
  /// neighbours, otherwise frames between the commands Hold and Commit. Every value is checked against its
  /// range before anything is sent; throws UserError then. Returns before that tick, but for LOCK, which
  /// decides what the chip takes next: then it is active. With LOCK = 0 among them a locked chip is opened
  /// first, and locked again as it was when it refuses the others.
  void write(std::span<const Setting> settings);

  /// Heating on; a refusal names the fault in the way.
  void run();
  /// Heater off, always accepted.
  void stop();
  /// Starts the autotune at the set-point; heating must be on in automatic mode.
  void start_tuning();
  Tuning tuning();
  /// Clears the latched faults; a refusal names the cause that is still there.
  void clear_faults();

 private:
  struct Modbus;
  class Locked;
  struct Frame {
    std::uint16_t address;
    std::vector<std::uint16_t> words;
    std::string names;
  };

  std::vector<std::uint16_t> poll(std::uint16_t address, std::uint16_t count, const std::string& what);
  void send(const Frame& frame);
  void send_together(const std::vector<Frame>& frames);
  void command(chip::spec::Cmd cmd, const std::string& what);
  void await_earlier_writes();
  void await_lock(bool locked);
  std::uint16_t open_lock();
  bool locked_again(std::uint16_t lock);
  bool discarded();
  // Why the chip refused, as its registers say now; told behind the refusal.
  std::string what_is_busy();
  std::string what_bars_heating();
  std::string what_bars_clearing();
  std::string what_bars_tuning();
  void command_or_why(chip::spec::Cmd cmd, const std::string& what, std::string (Controller::*why)());
  template <class Call>
  void transact(const std::string& what, Call&& call);
  template <class Reached>
  void await_tick(const std::string& what, Reached&& reached);

  Connection connection_;
  std::unique_ptr<Modbus> modbus_;
};

}  // namespace meltstage::host
