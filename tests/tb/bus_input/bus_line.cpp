// SPDX-License-Identifier: Apache-2.0
#include "bus_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "cmodel/advance.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

constexpr double kGapChars = 3.5;
constexpr double kTurnaround_s = 0.02;  // after a broadcast
// An answer begins within the gap, a sensor reading that is under way, and a control tick's work.
constexpr double kAnswer_s = 0.005;

UartLine line_of(const LineSetting& setting) {
  return {spec::kClkHz, setting.baud * 100.0, uart_format(setting.format)};
}

class ModelStation final : public Station {
 public:
  explicit ModelStation(const chip::Chip& start) { restart(start); }
  void run_until(std::uint64_t cycle, HostEnd& host) override {
    chip::advance(run_, cycle, host, [](auto...) {});
  }
  std::uint64_t cycle() const override { return run_.cycle; }
  const chip::Chip& chip() const override { return run_.chip; }
  void restart(const chip::Chip& state) override {
    run_.chip = state;
    run_.out = state.outputs({});
  }

 private:
  chip::Run run_;
};

class FaultyStation final : public Station {
 public:
  FaultyStation(const chip::Chip& start, std::function<void(chip::Chip&)> fault) : fault_(std::move(fault)) {
    restart(start);
  }
  void run_until(std::uint64_t cycle, HostEnd& host) override {
    for (; run_.cycle < cycle; ++run_.cycle) {
      fault_(run_.chip);
      run_.out = run_.chip.step(host.step(run_.cycle, run_.out));
    }
  }
  std::uint64_t cycle() const override { return run_.cycle; }
  const chip::Chip& chip() const override { return run_.chip; }
  void restart(const chip::Chip& state) override {
    run_.chip = state;
    run_.out = state.outputs({});
  }

 private:
  std::function<void(chip::Chip&)> fault_;
  chip::Run run_;
};

Bytes probe_request() { return sealed({kBusUnit, 4, 0, spec::kInDeviceId, 0, 2}); }
Bytes probe_answer() {
  return sealed({kBusUnit, 4, 4, spec::kDeviceId >> 8, spec::kDeviceId & 0xFF, spec::kVersion >> 8,
                 spec::kVersion & 0xFF});
}

bool touches_the_line(const SoundFrame& frame) {
  for (unsigned i = spec::kRegAddress; i <= spec::kRegFormat; ++i) {
    if (frame.writes(static_cast<std::uint16_t>(spec::kHoldingBase + i))) return true;
  }
  return false;
}

}  // namespace

HostEnd::HostEnd(const UartLine& line, double clock_error_ratio)
    : transmitter_(line, {.baud_error_ratio = clock_error_ratio}, stream(1, "host")), receiver_(line) {}

chip::Inputs HostEnd::step(std::uint64_t cycle, const chip::Outputs& out) {
  receiver_.step(cycle, out.uart_tx);
  driven_ = out.uart_de;
  return {.uart_rx = transmitter_.step(cycle)};
}

std::unique_ptr<Station> model_station(const chip::Chip& start) {
  return std::make_unique<ModelStation>(start);
}
std::unique_ptr<Station> faulty_station(const chip::Chip& start, std::function<void(chip::Chip&)> fault) {
  return std::make_unique<FaultyStation>(start, std::move(fault));
}

int char_bits_of(std::uint8_t format) { return uart_format(format).bits(); }

chip::Chip chip_on_line(const LineSetting& line) {
  chip::Chip chip;
  for (int i = 0; i < 4; ++i) chip.step({});  // the reset synchroniser lets go
  const auto set = [&](spec::Reg reg, std::uint16_t value) { chip.mem.preset(reg, value); };
  set(spec::kRegAddress, kBusUnit);
  set(spec::kRegBaud, line.baud);
  set(spec::kRegFormat, line.format);
  for (int i = 0; i < 4; ++i) chip.step({});  // the idle port takes them over
  return chip;
}

BusLine::BusLine(std::unique_ptr<Station> station, const LineSetting& line)
    : station_(std::move(station)),
      setting_(line),
      format_(line_of(line).format),
      host_(line_of(line), line.host_clock_error_ratio) {}

double BusLine::bit() const {
  return line_of(setting_).bit_cycles() / (1.0 + setting_.host_clock_error_ratio);
}

BusLine::Registers BusLine::registers() const {
  Registers now{};
  const chip::Chip& chip = station_->chip();
  // The low 16 bits of a word are the data (cmodel/mem.hpp); register 0 has no word.
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) {
    now.staged[i] = static_cast<std::uint16_t>(chip.mem.staged_q[i]);
    now.active[i] = static_cast<std::uint16_t>(chip.mem.active_q[i]);
  }
  now.heating = chip.guard.run_q != 0;
  return now;
}

void BusLine::fail(const Segment& segment, const std::string& what) const {
  throw Violation(fmt::format("cycle {}, baud {}, format {}, host's clock {:+}: {}\n  after {}",
                              station_->cycle(), setting_.baud * 100, setting_.format,
                              setting_.host_clock_error_ratio, what, describe(segment)));
}

void BusLine::run_bits(double bits) {
  station_->run_until(station_->cycle() + static_cast<std::uint64_t>(std::ceil(bits * bit())), host_);
}

void BusLine::send(const Segment& segment) {
  if (segment.chars.empty()) return;
  UartTransmitter& line = host_.transmitter();
  const auto now = static_cast<double>(station_->cycle());
  const double free = static_cast<double>(line_free_cycle_) + kGapChars * char_bits() * bit();
  double start = std::max(now, free);
  double at = start;
  for (std::size_t i = 0; i < segment.chars.size(); ++i) {
    UartChar character = segment.chars[i];
    at += (i == 0 ? 0 : character.gap_bits) * bit();
    for (const BitFlip& flip : segment.flips) {
      if (flip.character != i) continue;
      const auto begin = static_cast<std::uint64_t>(std::llround(at + flip.bit * bit()));
      const auto end = static_cast<std::uint64_t>(std::llround(at + (flip.bit + 1) * bit()));
      line.glitch(begin, end - begin);
    }
    if (i == 0) character.gap_bits = (start - now) / bit();
    line.send(character);
    at += char_bits() * bit();
  }
  do {
    station_->run_until(std::max(station_->cycle() + 1, line.next_event() + 1), host_);
  } while (!line.idle());
  line_free_cycle_ = line.last_end_cycle();
}

// Bytes that the chip sends, if it begins within so many bits.
Bytes BusLine::reply_within(double bits) {
  Bytes bytes;
  const auto deadline = station_->cycle() + static_cast<std::uint64_t>(bits * bit());
  while (!host_.driven() && station_->cycle() < deadline) run_bits(2);
  while (host_.driven()) run_bits(2);
  while (const auto byte = host_.receiver().take()) {
    bytes.push_back(byte->data);
    line_free_cycle_ = std::max(line_free_cycle_, byte->end_cycle);
  }
  return bytes;
}

void BusLine::probe(const Segment& after) {
  send(segment_of(probe_request()));
  const Bytes reply = reply_within(kGapChars * char_bits() + kAnswer_s * setting_.baud * 100);
  if (reply == probe_answer()) return;
  fail(after, reply.empty() ? "the valid request 3.5 characters later is not answered"
                            : "the answer to the valid request 3.5 characters later is wrong: " +
                                  describe(segment_of(reply)));
}

void BusLine::check_registers(const Registers& before, const Registers& now,
                              const std::vector<SoundFrame>& writers, const Segment& segment) const {
  const auto any = [&](auto&& condition) { return std::any_of(writers.begin(), writers.end(), condition); };
  const bool commands = any([](const SoundFrame& f) { return f.writes(spec::kHoldingBase); });
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) {
    const auto address = static_cast<std::uint16_t>(spec::kHoldingBase + i);
    const bool asked = any([&](const SoundFrame& f) {
      return f.writes(address) && f.values()[address - f.first_register()] == now.staged[i];
    });
    const bool discarded = commands && now.staged[i] == before.active[i];  // command Discard
    if (now.staged[i] != before.staged[i] && !asked && !discarded)
      fail(segment,
           fmt::format("register {:#x} changed from {} to {}", address, before.staged[i], now.staged[i]));
    // A control tick may have made active what had been staged before or now.
    if (now.active[i] != before.active[i] && now.active[i] != before.staged[i] &&
        now.active[i] != now.staged[i])
      fail(segment, fmt::format("active register {:#x} is {}", address, now.active[i]));
  }
  if (now.heating && !before.heating && !commands) fail(segment, "the heater was switched on");
}

// A write that the chip has confirmed.
void BusLine::check_written(const Registers& now, const SoundFrame& request, const Segment& segment) const {
  if (request.writes(spec::kHoldingBase)) return;  // a command among the values may undo them
  const std::vector<std::uint16_t> values = request.values();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t index = request.first_register() - spec::kHoldingBase + i;
    if (now.staged.at(index) != values[i])
      fail(segment, fmt::format("register {:#x} is {} though the write of {} was confirmed",
                                spec::kHoldingBase + index, now.staged[index], values[i]));
  }
}

void BusLine::put(const Segment& segment) {
  ++count_.segments;
  const Registers before = registers();
  send(segment);
  const Meaning meaning = meaning_of(segment, kBusUnit, format_.bits());
  const std::vector<SoundFrame>& frames = meaning.certain.empty() ? meaning.possible : meaning.certain;
  std::vector<SoundFrame> writers = frames;
  if (!meaning.certain.empty()) {
    ++count_.accepted;
    const SoundFrame& request = meaning.certain.front();
    if (request.broadcast()) {
      if (!reply_within(kTurnaround_s * setting_.baud * 100).empty())
        fail(segment, "a broadcast is answered");
    } else {
      const Bytes reply = reply_within(kGapChars * char_bits() + kAnswer_s * setting_.baud * 100);
      const std::string fault = fault_of_reply(request, reply);
      if (!fault.empty()) fail(segment, "answer: " + fault + ": " + describe(segment_of(reply)));
      if (is_exception(reply)) {
        ++count_.exceptions;
        writers.clear();
      }
    }
  } else if (!frames.empty()) {
    ++count_.possible;
    reply_within(kTurnaround_s * setting_.baud * 100);
  }
  if (std::any_of(writers.begin(), writers.end(), touches_the_line)) {
    station_->restart(chip_on_line(setting_));
    line_free_cycle_ = station_->cycle();
    return;
  }
  probe(segment);
  const Registers now = registers();
  check_registers(before, now, writers, segment);
  if (!meaning.certain.empty() && !writers.empty() && !writers.front().broadcast())
    check_written(now, writers.front(), segment);
  for (unsigned i = 1; i < spec::kHoldingCount; ++i)
    count_.written += now.staged[i] != before.staged[i] ? 1 : 0;
}

}  // namespace meltstage::tb
