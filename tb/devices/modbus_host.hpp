// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cmodel/spec.hpp"
#include "tb/devices/uart.hpp"

namespace meltstage::tb {

/// CRC of Modbus RTU: polynomial 0xA001 (reflected), initial value 0xFFFF; sent low byte first
/// (Modbus over Serial Line V1.02, 6.2.2).
std::uint16_t crc16_modbus(std::span<const std::uint8_t> bytes);

/// Silence that ends a frame: 3.5 characters up to 19200 baud, 1.75 ms above (Modbus over Serial Line
/// V1.02, 2.5.1.1).
double frame_silence_s(const UartLine& line);

/// A frame ready to send, CRC included. Tests corrupt it by editing characters (data, gap, parity, stop bit),
/// erasing or appending some.
struct ModbusRequest {
  std::vector<UartChar> frame;
};

ModbusRequest read_holding_registers(std::uint8_t unit, std::uint16_t address, std::uint16_t count);
ModbusRequest read_input_registers(std::uint8_t unit, std::uint16_t address, std::uint16_t count);
ModbusRequest write_single_register(std::uint8_t unit, std::uint16_t address, std::uint16_t value);
/// Any number of values up to 127, also more than the standard's 123, to see them refused; throws
/// std::invalid_argument above.
ModbusRequest write_multiple_registers(std::uint8_t unit, std::uint16_t address,
                                       std::span<const std::uint16_t> values);
/// Function 08 sub-function 00, return query data.
ModbusRequest diagnostic_echo(std::uint8_t unit, std::uint16_t data);
/// Function 17.
ModbusRequest report_server_id(std::uint8_t unit);
/// Function 43, MEI type 14; code 1 basic, 2 regular, 3 extended, 4 one object.
ModbusRequest read_device_identification(std::uint8_t unit, std::uint8_t code, std::uint8_t object);
/// Unit, function and data of any kind, with a good CRC.
ModbusRequest with_crc(std::span<const std::uint8_t> bytes);
/// These bytes as they are.
ModbusRequest raw_frame(std::span<const std::uint8_t> bytes);

enum class ModbusOutcome : std::uint8_t { data, exception, timeout, malformed, broadcast };

/// One object of function 43/14.
struct DeviceObject {
  std::uint8_t id;
  std::string value;
};

/// What became of a request.
struct ModbusResult {
  std::uint64_t id = 0;  ///< as returned by submit()
  ModbusOutcome outcome = ModbusOutcome::timeout;
  std::uint8_t unit = 0;
  std::uint8_t function = 0;
  std::uint8_t exception_code = 0;       ///< outcome Exception
  std::vector<std::uint16_t> registers;  ///< functions 03, 04
  std::vector<std::uint8_t> data;        ///< reply after the function code; function 17 without its count
  std::vector<DeviceObject> objects;     ///< function 43/14
  std::string problem;                   ///< outcome Malformed: what is wrong
  std::vector<std::uint8_t> frame;       ///< reply as received
  std::uint64_t request_start_cycle = 0;
  std::uint64_t request_end_cycle = 0;  ///< end of the last stop bit
  std::uint64_t reply_start_cycle = 0;
  std::uint64_t reply_end_cycle = 0;
};

/// Bytes between silences.
struct RtuFrame {
  std::vector<std::uint8_t> bytes;
  std::uint64_t start_cycle = 0;
  std::uint64_t end_cycle = 0;
  bool line_error = false;  ///< a parity or framing error in it
};

/// Cuts the line into frames at t3.5 silence.
class RtuFrameReceiver {
 public:
  explicit RtuFrameReceiver(const UartLine& line);

  void step(std::uint64_t cycle, bool level) {
    receiver_.step(cycle, level);
    if (cycle >= poll_cycle_) advance(cycle);
    if (receiver_.next_event() < poll_cycle_) poll_cycle_ = receiver_.next_event();
  }
  bool has_frame() const { return !closed_.empty(); }
  /// A frame that has ended.
  std::optional<RtuFrame> take();
  /// A frame or character is under way.
  bool receiving() const { return !open_.bytes.empty() || receiver_.receiving(); }
  std::uint64_t next_event() const { return poll_cycle_; }

 private:
  void advance(std::uint64_t cycle);
  void close() { closed_.push_back(std::exchange(open_, {})); }

  UartReceiver receiver_;
  std::uint64_t silence_cycles_;
  RtuFrame open_;
  std::deque<RtuFrame> closed_;
  std::uint64_t poll_cycle_ = kNoEvent;
};

struct ModbusHostConfig {
  UartLine line;
  UartTiming timing{};             ///< of the host's transmitter
  double timeout_s = 0.5;          ///< from the request's end to the reply's first character
  double broadcast_delay_s = 0.1;  ///< pause after a broadcast
};

/// Modbus RTU master: one transaction at a time from a queue, at the pins of a full-duplex point-to-point
/// line.
class ModbusHost {
 public:
  ModbusHost(const ModbusHostConfig& config, Rng jitter);

  /// Queues a request, returns its id (1, 2, ...).
  std::uint64_t submit(ModbusRequest request);
  /// The oldest result not yet taken.
  std::optional<ModbusResult> take_result();
  /// Requests not yet finished.
  bool busy() const { return state_ != State::idle || !queue_.empty(); }

  /// `rx` is the chip's transmit pin; returns the level of the chip's receive pin.
  bool step(std::uint64_t cycle, bool rx) {
    const bool tx = transmitter_.step(cycle);
    frames_.step(cycle, rx);
    if (cycle >= wake_cycle_ || frames_.has_frame()) advance(cycle);
    return tx;
  }
  /// Nothing happens before this cycle as long as `rx` keeps its level.
  std::uint64_t next_event() const;

  /// Frames that came without a request or after a time-out.
  std::uint64_t stray_frames() const { return stray_frames_; }
  /// For glitches on the line.
  UartTransmitter& transmitter() { return transmitter_; }

 private:
  enum class State : std::uint8_t { idle, sending, waiting };
  struct Pending {
    std::uint64_t id;
    ModbusRequest request;
  };
  void advance(std::uint64_t cycle);
  void start(std::uint64_t cycle);
  void begin_waiting(std::uint64_t cycle);
  void wait_for_reply(std::uint64_t cycle);
  bool broadcast() const { return !sent_.empty() && sent_[0] == chip::spec::kBroadcastAddress; }
  void drop_stray_frames();
  void finish(std::uint64_t cycle, const ModbusResult& result);
  std::uint64_t cycles(double seconds) const;

  ModbusHostConfig config_;
  UartTransmitter transmitter_;
  RtuFrameReceiver frames_;
  State state_ = State::idle;
  std::deque<Pending> queue_;
  std::deque<ModbusResult> results_;
  ModbusResult current_;
  std::vector<std::uint8_t> sent_;
  std::uint64_t submitted_ = 0;
  std::uint64_t stray_frames_ = 0;
  std::uint64_t earliest_start_ = 0;
  std::uint64_t deadline_ = 0;
  std::uint64_t wake_cycle_ = 0;
};

/// Reply to `request` (both with CRC), judged as a master does.
ModbusResult judge_reply(std::span<const std::uint8_t> request, const RtuFrame& reply);

/// One frame of the telemetry pin: shaped as a reply to function 04.
struct TelemetryFrame {
  std::uint8_t unit;
  std::vector<std::uint16_t> registers;
  std::uint64_t start_cycle;
  std::uint64_t end_cycle;
};

/// Listens to the chip's transmit-only telemetry pin.
class TelemetryListener {
 public:
  explicit TelemetryListener(const UartLine& line) : frames_(line) {}

  void step(std::uint64_t cycle, bool level) {
    frames_.step(cycle, level);
    if (frames_.has_frame()) advance();
  }
  std::optional<TelemetryFrame> take();
  std::uint64_t good_frames() const { return good_frames_; }
  std::uint64_t bad_frames() const { return bad_frames_; }
  std::uint64_t next_event() const { return frames_.next_event(); }

 private:
  void advance();
  RtuFrameReceiver frames_;
  std::deque<TelemetryFrame> received_;
  std::uint64_t good_frames_ = 0;
  std::uint64_t bad_frames_ = 0;
};

}  // namespace meltstage::tb
