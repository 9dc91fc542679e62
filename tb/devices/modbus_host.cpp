// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/modbus_host.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "cmodel/spec.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

using Bytes = std::vector<std::uint8_t>;

std::uint8_t high(std::uint16_t value) { return static_cast<std::uint8_t>(value >> 8); }
std::uint8_t low(std::uint16_t value) { return static_cast<std::uint8_t>(value & 0xFFU); }

ModbusRequest two_words(std::uint8_t unit, std::uint8_t function, std::uint16_t first, std::uint16_t second) {
  return with_crc(Bytes{unit, function, high(first), low(first), high(second), low(second)});
}

bool crc_good(std::span<const std::uint8_t> frame) {
  const std::uint16_t crc = crc16_modbus(frame.first(frame.size() - 2));
  return frame[frame.size() - 2] == low(crc) && frame[frame.size() - 1] == high(crc);
}

// Words of a byte-counted register block that fills `block` exactly; nothing when the count does not fit.
std::optional<std::vector<std::uint16_t>> register_block(std::span<const std::uint8_t> block) {
  if (block.empty() || block[0] % 2 != 0 || block.size() != 1U + block[0]) return std::nullopt;
  std::vector<std::uint16_t> registers;
  for (std::size_t i = 1; i < block.size(); i += 2) {
    registers.push_back(static_cast<std::uint16_t>(block[i] << 8 | block[i + 1]));
  }
  return registers;
}

std::optional<std::vector<DeviceObject>> device_objects(std::span<const std::uint8_t> body) {
  // MEI type, code, conformity, more follows, next object, number of objects, then (id, length, text)...
  if (body.size() < 6 || body[0] != spec::kMeiType) return std::nullopt;
  std::vector<DeviceObject> objects;
  std::size_t at = 6;
  for (int i = 0; i < body[5]; ++i) {
    if (at + 2 > body.size() || at + 2 + body[at + 1] > body.size()) return std::nullopt;
    const auto text = body.subspan(at + 2, body[at + 1]);
    objects.push_back({body[at], std::string(text.begin(), text.end())});
    at += 2U + text.size();
  }
  if (at != body.size()) return std::nullopt;
  return objects;
}

// Fills in the decoded part of a reply with the request's function code; says what is wrong, if anything.
std::string decode(std::span<const std::uint8_t> request, std::span<const std::uint8_t> body,
                   ModbusResult& result) {
  const auto repeats_request = [&](std::size_t bytes) {
    return body.size() == bytes && request.size() >= bytes + 4 &&
           std::equal(body.begin(), body.end(), request.begin() + 2);
  };
  switch (result.function) {
    case spec::kFcReadHolding:
    case spec::kFcReadInput: {
      auto registers = register_block(body);
      if (!registers) return fmt::format("byte count does not fit a reply of {} data bytes", body.size());
      const std::size_t wanted = request.size() >= 8 ? request[4] * 256U + request[5] : registers->size();
      if (registers->size() != wanted)
        return fmt::format("{} registers, expected {}", registers->size(), wanted);
      result.registers = std::move(*registers);
      return {};
    }
    case spec::kFcWriteSingle:
    case spec::kFcDiagnostics:
      return repeats_request(4) ? "" : "does not repeat the request";
    case spec::kFcWriteMultiple:
      return repeats_request(4) ? "" : "does not repeat the request's address and count";
    case spec::kFcReportServerId:
      if (body.empty() || body.size() != 1U + body[0]) return "byte count does not fit";
      result.data.erase(result.data.begin());
      return {};
    case spec::kFcEncapsulated: {
      auto objects = device_objects(body);
      if (!objects) return "device identification is cut or of another type";
      result.objects = std::move(*objects);
      return {};
    }
    default:
      return {};
  }
}

}  // namespace

std::uint16_t crc16_modbus(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int i = 0; i < 8; ++i) crc = (crc & 1U) != 0 ? crc >> 1 ^ 0xA001U : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

double frame_silence_s(const UartLine& line) {
  return line.baud > 19200.0 ? 1.75e-3 : 3.5 * line.format.bits() / line.baud;
}

ModbusRequest raw_frame(std::span<const std::uint8_t> bytes) {
  ModbusRequest request;
  for (const std::uint8_t byte : bytes) request.frame.push_back({.data = byte});
  return request;
}

ModbusRequest with_crc(std::span<const std::uint8_t> bytes) {
  const std::uint16_t crc = crc16_modbus(bytes);
  ModbusRequest request = raw_frame(bytes);
  request.frame.push_back({.data = low(crc)});
  request.frame.push_back({.data = high(crc)});
  return request;
}

ModbusRequest read_holding_registers(std::uint8_t unit, std::uint16_t address, std::uint16_t count) {
  return two_words(unit, spec::kFcReadHolding, address, count);
}

ModbusRequest read_input_registers(std::uint8_t unit, std::uint16_t address, std::uint16_t count) {
  return two_words(unit, spec::kFcReadInput, address, count);
}

ModbusRequest write_single_register(std::uint8_t unit, std::uint16_t address, std::uint16_t value) {
  return two_words(unit, spec::kFcWriteSingle, address, value);
}

ModbusRequest write_multiple_registers(std::uint8_t unit, std::uint16_t address,
                                       std::span<const std::uint16_t> values) {
  if (values.size() > 127) {
    throw std::invalid_argument(fmt::format(
        "Modbus function 16: {} values, expected at most 127 (the byte count has 8 bits)", values.size()));
  }
  const auto count = static_cast<std::uint16_t>(values.size());
  Bytes bytes{unit,
              spec::kFcWriteMultiple,
              high(address),
              low(address),
              high(count),
              low(count),
              static_cast<std::uint8_t>(2 * count)};
  for (const std::uint16_t value : values) {
    bytes.push_back(high(value));
    bytes.push_back(low(value));
  }
  return with_crc(bytes);
}

ModbusRequest diagnostic_echo(std::uint8_t unit, std::uint16_t data) {
  return two_words(unit, spec::kFcDiagnostics, 0, data);
}

ModbusRequest report_server_id(std::uint8_t unit) { return with_crc(Bytes{unit, spec::kFcReportServerId}); }

ModbusRequest read_device_identification(std::uint8_t unit, std::uint8_t code, std::uint8_t object) {
  return with_crc(Bytes{unit, spec::kFcEncapsulated, spec::kMeiType, code, object});
}

ModbusResult judge_reply(std::span<const std::uint8_t> request, const RtuFrame& reply) {
  ModbusResult result;
  result.frame = reply.bytes;
  result.reply_start_cycle = reply.start_cycle;
  result.reply_end_cycle = reply.end_cycle;
  result.outcome = ModbusOutcome::malformed;
  const std::span<const std::uint8_t> frame(reply.bytes);
  if (reply.line_error) {
    result.problem = "parity or framing error";
    return result;
  }
  if (frame.size() < 4) {
    result.problem = fmt::format("{} bytes, expected at least 4", frame.size());
    return result;
  }
  if (!crc_good(frame)) {
    result.problem =
        fmt::format("CRC does not fit, expected 0x{:04X}", crc16_modbus(frame.first(frame.size() - 2)));
    return result;
  }
  result.unit = frame[0];
  result.function = frame[1] & ~spec::kExceptionFlag;
  const auto body = frame.subspan(2, frame.size() - 4);
  result.data.assign(body.begin(), body.end());
  if (request.size() >= 2 &&
      (frame[0] != request[0] || result.function != (request[1] & ~spec::kExceptionFlag))) {
    result.problem = fmt::format("unit {} function {}, expected unit {} function {}", frame[0],
                                 result.function, request[0], request[1]);
  } else if ((frame[1] & spec::kExceptionFlag) != 0) {
    if (body.size() == 1) {
      result.outcome = ModbusOutcome::exception;
      result.exception_code = body[0];
    } else {
      result.problem = fmt::format("exception with {} data bytes, expected 1", body.size());
    }
  } else {
    result.problem = decode(request, body, result);
    if (result.problem.empty()) result.outcome = ModbusOutcome::data;
  }
  return result;
}

RtuFrameReceiver::RtuFrameReceiver(const UartLine& line)
    : receiver_(line),
      silence_cycles_(static_cast<std::uint64_t>(std::llround(frame_silence_s(line) * line.clock_hz))) {}

std::optional<RtuFrame> RtuFrameReceiver::take() {
  if (closed_.empty()) return std::nullopt;
  RtuFrame frame = std::move(closed_.front());
  closed_.pop_front();
  return frame;
}

void RtuFrameReceiver::advance(std::uint64_t cycle) {
  while (const auto byte = receiver_.take()) {
    if (!open_.bytes.empty() && byte->start_cycle >= open_.end_cycle + silence_cycles_) close();
    if (open_.bytes.empty()) open_.start_cycle = byte->start_cycle;
    open_.bytes.push_back(byte->data);
    open_.end_cycle = byte->end_cycle;
    open_.line_error = open_.line_error || byte->parity_error || byte->framing_error;
  }
  poll_cycle_ = receiver_.next_event();
  if (open_.bytes.empty() || receiver_.receiving()) return;
  if (cycle >= open_.end_cycle + silence_cycles_) {
    close();
  } else {
    poll_cycle_ = open_.end_cycle + silence_cycles_;
  }
}

ModbusHost::ModbusHost(const ModbusHostConfig& config, Rng jitter)
    : config_(config), transmitter_(config.line, config.timing, jitter), frames_(config.line) {}

std::uint64_t ModbusHost::cycles(double seconds) const {
  return static_cast<std::uint64_t>(std::llround(seconds * config_.line.clock_hz));
}

std::uint64_t ModbusHost::submit(ModbusRequest request) {
  queue_.push_back({++submitted_, std::move(request)});
  if (state_ == State::idle) wake_cycle_ = earliest_start_;
  return submitted_;
}

std::optional<ModbusResult> ModbusHost::take_result() {
  if (results_.empty()) return std::nullopt;
  ModbusResult result = std::move(results_.front());
  results_.pop_front();
  return result;
}

std::uint64_t ModbusHost::next_event() const {
  return std::min({wake_cycle_, transmitter_.next_event(), frames_.next_event()});
}

void ModbusHost::drop_stray_frames() {
  while (frames_.take()) ++stray_frames_;
}

void ModbusHost::advance(std::uint64_t cycle) {
  switch (state_) {
    case State::idle:
      drop_stray_frames();
      if (!queue_.empty() && cycle >= earliest_start_) start(cycle);
      break;
    case State::sending:
      drop_stray_frames();
      if (transmitter_.idle()) begin_waiting(cycle);
      break;
    case State::waiting:
      wait_for_reply(cycle);
      break;
  }
  switch (state_) {
    case State::idle:
      wake_cycle_ = queue_.empty() ? kNoEvent : earliest_start_;
      break;
    case State::sending:
      wake_cycle_ = std::max(cycle + 1, transmitter_.next_event());
      break;
    case State::waiting:
      wake_cycle_ = cycle < deadline_ ? deadline_ : std::max(cycle + 1, frames_.next_event());
      break;
  }
}

void ModbusHost::start(std::uint64_t cycle) {
  Pending pending = std::move(queue_.front());
  queue_.pop_front();
  current_ = {};
  current_.id = pending.id;
  current_.request_start_cycle = cycle + 1;  // the transmitter takes it up at the next step
  sent_.clear();
  for (const UartChar& character : pending.request.frame) {
    sent_.push_back(character.data);
    transmitter_.send(character);
  }
  if (sent_.size() >= 2) {
    current_.unit = sent_[0];
    current_.function = sent_[1];
  }
  state_ = State::sending;
}

void ModbusHost::begin_waiting(std::uint64_t cycle) {
  state_ = State::waiting;
  current_.request_end_cycle = sent_.empty() ? cycle : transmitter_.last_end_cycle();
  deadline_ =
      current_.request_end_cycle + cycles(broadcast() ? config_.broadcast_delay_s : config_.timeout_s);
}

void ModbusHost::wait_for_reply(std::uint64_t cycle) {
  if (const auto frame = frames_.take()) {
    ModbusResult result = judge_reply(sent_, *frame);
    if (broadcast()) {
      result.outcome = ModbusOutcome::malformed;
      result.problem = "reply to a broadcast, expected silence";
    }
    result.id = current_.id;
    result.request_start_cycle = current_.request_start_cycle;
    result.request_end_cycle = current_.request_end_cycle;
    finish(cycle, result);
  } else if (cycle >= deadline_ && !frames_.receiving()) {
    current_.outcome = broadcast() ? ModbusOutcome::broadcast : ModbusOutcome::timeout;
    finish(cycle, current_);
  }
}

void ModbusHost::finish(std::uint64_t cycle, const ModbusResult& result) {
  results_.push_back(result);
  state_ = State::idle;
  const std::uint64_t last_activity = std::max(result.request_end_cycle, result.reply_end_cycle);
  earliest_start_ = std::max(cycle + 1, last_activity + cycles(frame_silence_s(config_.line)));
}

std::optional<TelemetryFrame> TelemetryListener::take() {
  if (received_.empty()) return std::nullopt;
  TelemetryFrame frame = std::move(received_.front());
  received_.pop_front();
  return frame;
}

void TelemetryListener::advance() {
  while (const auto frame = frames_.take()) {
    const std::span<const std::uint8_t> bytes(frame->bytes);
    const bool shaped =
        !frame->line_error && bytes.size() >= 5 && crc_good(bytes) && bytes[1] == spec::kFcReadInput;
    auto registers = shaped ? register_block(bytes.subspan(2, bytes.size() - 4)) : std::nullopt;
    if (!registers) {
      ++bad_frames_;
      continue;
    }
    ++good_frames_;
    received_.push_back({bytes[0], std::move(*registers), frame->start_cycle, frame->end_cycle});
  }
}

}  // namespace meltstage::tb
