// SPDX-License-Identifier: Apache-2.0
#include "app/chip/chip_serve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "app/chip/chip_wire.hpp"
#include "app/chip/pseudo_terminal.hpp"
#include "base/error.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"
#include "cmodel/advance.hpp"
#include "recording/vcd.hpp"
#include "tb/lockstep/lockstep.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/pins/fault_sentence.hpp"
#include "tb/pins/head.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kClockHz = spec::kClkHz;
constexpr std::uint64_t kResetClocks = 20;
// A frame has arrived when its program has written nothing for this time: programs write a frame at once or
// byte by byte, and real pauses inside a frame can't be told from those of a busy machine.
constexpr Seconds kFrameQuiet{2e-3};
constexpr std::size_t kFewFrames = 16384;  // bytes; no more is read while so much waits for the line
// Work between two looks at the port.
constexpr Seconds kSlice{1e-3};
// What a busy machine may fall behind before that time is given up: the chip then lives later, not faster.
constexpr Seconds kLargestDebt{0.25};
constexpr Seconds kShowEvery{0.25};
constexpr Seconds kMeasureOver{1.0};

double seconds(std::uint64_t clocks) { return static_cast<double>(clocks) / kClockHz; }

// Cuts what programs write into the frames that they meant.
class Frames {
 public:
  void add(std::vector<std::uint8_t> bytes, Clock::time_point now) {
    close_if_quiet(now);
    open_.insert(open_.end(), bytes.begin(), bytes.end());
    size_ += bytes.size();
    last_ = now;
  }
  bool waiting(Clock::time_point now) {
    close_if_quiet(now);
    return !closed_.empty();
  }
  std::vector<std::uint8_t> take() {
    std::vector<std::uint8_t> frame = std::move(closed_.front());
    closed_.pop_front();
    size_ -= frame.size();
    return frame;
  }
  std::size_t size() const { return size_; }

 private:
  void close_if_quiet(Clock::time_point now) {
    if (open_.empty() || now - last_ < kFrameQuiet) return;
    closed_.push_back(std::exchange(open_, {}));
  }

  std::deque<std::vector<std::uint8_t>> closed_;
  std::vector<std::uint8_t> open_;
  std::size_t size_ = 0;
  Clock::time_point last_;
};

// How far the chip may be by now.
class Pace {
 public:
  Pace(std::optional<double> speed, Clock::time_point now) : speed_(speed), origin_(now) {}

  std::uint64_t due(std::uint64_t cycle, Clock::time_point now) {
    if (!speed_) return cycle + largest_step_;
    const double clocks_per_s = *speed_ * kClockHz;
    const Seconds debt = (now - origin_) - Seconds(static_cast<double>(cycle) / clocks_per_s);
    if (debt > kLargestDebt) origin_ += std::chrono::duration_cast<Clock::duration>(debt - kLargestDebt);
    const auto due = static_cast<std::uint64_t>(std::max(0.0, Seconds(now - origin_).count()) * clocks_per_s);
    return std::clamp(due, cycle, cycle + largest_step_);
  }
  // More is due than one step does.
  bool behind(std::uint64_t cycle, Clock::time_point now) { return due(cycle, now) == cycle + largest_step_; }
  // A step of so many clocks has taken so long: the longest ones become as long as a slice.
  void took(std::uint64_t clocks, Seconds time) {
    if (time > 2 * kSlice) largest_step_ = std::max<std::uint64_t>(largest_step_ / 2, 100);
    if (time < kSlice / 2 && clocks == largest_step_)
      largest_step_ = std::min<std::uint64_t>(largest_step_ * 2, spec::kClkHz);
  }

 private:
  std::optional<double> speed_;
  Clock::time_point origin_;
  std::uint64_t largest_step_ = 1000;
};

// The chip's pins into a file.
class Waves {
 public:
  explicit Waves(const std::filesystem::path& path)
      : vcd_(path, recording::BusForm::bits), recorder_(vcd_, tb::chip_pin_header("meltstage chip serve")) {}

  void record(std::uint64_t cycle, const chip::Inputs& in, chip::Outputs out) {
    out.heater = out.heater && !in.inhibit;  // without a clock
    if (!first_ && in == last_in_ && out == last_out_) return;
    const auto levels = tb::pin_levels(in, out);
    for (std::uint32_t pin = 0; pin < tb::kChipPinCount; ++pin) recorder_.set(pin, levels[pin]);
    recorder_.commit(cycle);
    last_in_ = in;
    last_out_ = out;
    first_ = false;
  }
  void finish(std::uint64_t cycle) { recorder_.finish(cycle); }

 private:
  recording::VcdWriter vcd_;
  recording::Recorder recorder_;
  bool first_ = true;
  chip::Inputs last_in_;
  chip::Outputs last_out_{};
};

class Server {
 public:
  Server(const ServeOptions& options, const tb::PlantConfig& plant)
      : head_({.plant = plant}), master_(line_settings(run_.chip)) {
    if (!options.vcd.empty()) waves_.emplace(options.vcd);
    if (options.rtl) {
      lockstep_.emplace(tb::make_verilated_rtl(),
                        tb::RunIdentity{.test = "serve", .repeat_command = options.command});
    }
    head_.set_reset(true);
    run_until(kResetClocks);
    head_.set_reset(false);
  }

  const chip::Chip& chip() const { return lockstep_ ? lockstep_->model() : run_.chip; }
  std::uint64_t cycle() const { return run_.cycle; }
  MasterEnd& master() { return master_; }
  // The chip is on its way to an answer.
  bool serving() const { return master_.busy() || chip().uartc.cmd_valid() || chip().uartc.rsp_busy(); }

  void run_until(std::uint64_t until) {
    ServedHead around{head_, master_};
    const auto observe = [this](std::uint64_t at, const chip::Inputs& in, const chip::Outputs& out) {
      if (waves_) waves_->record(at, in, out);
    };
    if (!lockstep_) {
      chip::advance(run_, until, around, observe);
    } else {
      for (; run_.cycle < until; ++run_.cycle) {
        const chip::Inputs in = around.step(run_.cycle, run_.out);
        observe(run_.cycle, in, run_.out);
        run_.out = lockstep_->step(in);
      }
    }
    while (head_.telemetry().take()) {  // nobody listens to that pin here
    }
    master_.follow(line_settings(chip()));
  }

  void finish() {
    if (waves_) waves_->finish(cycle() - 1);  // the last one that was run
  }

 private:
  tb::Head head_;
  chip::Run run_;
  MasterEnd master_;
  std::optional<tb::Lockstep> lockstep_;
  std::optional<Waves> waves_;
};

std::string chip_state(const chip::Chip& chip) {
  const std::uint16_t pv = chip.read_register(spec::kInPv);
  std::string text =
      pv == spec::kPvNone
          ? "no reading yet"
          : fmt::format("{:.1f} degC", static_cast<std::int16_t>(pv) * spec::kInput[spec::kInPv].scale);
  const double duty = chip.read_register(spec::kInDuty) * spec::kInput[spec::kInDuty].scale;
  text += fmt::format(", duty {:.1f} %", duty);
  if (const auto first = spec::first_fault(chip.read_register(spec::kInFirstFault)))
    text += fmt::format(", fault {}", spec::kFaults[*first].name);
  return text + fmt::format(", {} frames", chip.uartc.messages());
}

// Chip time over real time.
class Ratio {
 public:
  Ratio(std::uint64_t cycle, Clock::time_point now) : cycle_(cycle), start_(now) {}
  double operator()(std::uint64_t cycle, Clock::time_point now) const {
    return seconds(cycle - cycle_) / std::max(1e-9, Seconds(now - start_).count());
  }
  Seconds since(Clock::time_point now) const { return now - start_; }

 private:
  std::uint64_t cycle_;
  Clock::time_point start_;
};

// What a master must wait for the longest answer, that of a read, at this ratio.
double longest_answer_s(const LineSettings& line, double ratio) {
  constexpr double kRequest = 8, kSilence = 4, kAnswer = 5 + 2 * spec::kMaxRead;  // characters
  constexpr double kLongestCharacter_bits = 12.0;
  return (kRequest + kSilence + kAnswer) * kLongestCharacter_bits / baud(line) / ratio;
}

void serve(Server& server, PseudoTerminal& port, const std::optional<double>& speed) {
  ProgressLine line;
  Frames frames;
  Clock::time_point now = Clock::now();
  Pace pace(speed, now);
  const Ratio whole(server.cycle(), now);
  Ratio recent = whole;
  bool told_slow = false;
  unsigned told_fault = 0;
  for (;;) {
    throw_if_interrupted();
    const bool hurry = server.serving() || frames.size() != 0;
    const bool behind = pace.behind(server.cycle(), now);
    const int patience_ms = behind ? 0 : hurry ? 1 : 5;
    if (frames.size() >= kFewFrames) {
      std::this_thread::sleep_for(std::chrono::milliseconds(patience_ms));
    } else if (port.wait(patience_ms)) {
      frames.add(port.read(), Clock::now());
    }
    now = Clock::now();
    if (!server.master().sending() && frames.waiting(now))
      server.master().send(server.cycle(), frames.take());
    const std::uint64_t begin = server.cycle();
    server.run_until(pace.due(begin, now));
    port.write(server.master().take());
    const Clock::time_point then = std::exchange(now, Clock::now());
    pace.took(server.cycle() - begin, now - then);

    if (!told_slow && speed && whole.since(now) > kMeasureOver) {
      const double ratio = whole(server.cycle(), now);
      if (ratio < 0.9 * *speed) {
        fmt::print("runs at {:.3f} x real time here: give masters a time-out of {:.1f} s or more\n", ratio,
                   std::ceil(20.0 * longest_answer_s(line_settings(server.chip()), ratio)) / 10.0);
        std::fflush(stdout);
      }
      told_slow = true;
    }
    if (const unsigned first = server.chip().guard.first_q; first != told_fault) {
      told_fault = first;
      line.clear();
      if (first != 0)
        fmt::print("{:.1f} s: {}\n", seconds(server.cycle()), tb::latched_fault(server.chip(), "Measured"));
      std::fflush(stdout);
    }
    if (recent.since(now) > kShowEvery) {
      line.show(fmt::format("{:.1f} s ({:.3g} x real time)  {}", seconds(server.cycle()),
                            recent(server.cycle(), now), chip_state(server.chip())));
      recent = Ratio(server.cycle(), now);
    }
  }
}

// The waves would take the link's name at the end.
void check_names(const ServeOptions& options) {
  if (options.port.empty()) throw UserError("--port: found an empty name, expected one for the link to make");
  if (!options.vcd.empty() && whole_name(options.vcd) == whole_name(options.port))
    throw UserError(
        fmt::format("--vcd: found {}, the name of --port, expected another file; choose another name",
                    options.vcd.string()));
}

}  // namespace

std::optional<double> parse_speed(const std::string& text) {
  if (text == "max") return std::nullopt;
  double speed = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), speed);
  if (error != std::errc{} || end != text.data() + text.size() || !(speed >= 0.001 && speed <= 1e6))
    throw UserError(fmt::format("--speed: found \"{}\", expected 0.001 to 1000000 or max", text));
  return speed;
}

int serve_chip(const ServeOptions& options) {
  check_names(options);
  tb::PlantConfig plant;
  try {
    plant = tb::plant_config(options.plant);
  } catch (const std::invalid_argument& error) {
    throw UserError(fmt::format("--plant: {}", error.what()));
  }
  catch_interrupts();
  Server server(options, plant);
  PseudoTerminal port(options.port);
  const LineSettings line = line_settings(server.chip());
  fmt::print("{}: {} of the chip on plant {}, address {}, {:.0f} Bd {}, {}; ends with Ctrl-C\n",
             escaped(options.port.string()), options.rtl ? "RTL" : "model", options.plant,
             server.chip().uartc.address_q, baud(line), format_name(line),
             options.speed ? fmt::format("{} x real time", *options.speed) : "as fast as it goes");
  std::fflush(stdout);
  const Ratio whole(server.cycle(), Clock::now());
  try {
    serve(server, port, options.speed);
  } catch (const Interrupted&) {
    server.finish();
  } catch (const tb::Mismatch& mismatch) {
    server.finish();
    on_stderr(mismatch.what());
    return 1;
  }
  fmt::print("{:.3f} s of the chip at {:.3g} x real time: {}\n", seconds(server.cycle()),
             whole(server.cycle(), Clock::now()), chip_state(server.chip()));
  return 0;
}

}  // namespace meltstage::app
