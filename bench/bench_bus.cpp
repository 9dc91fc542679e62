// SPDX-License-Identifier: Apache-2.0
// The serial line: how far off a host's clock may be, with jittering edges and with glitches, and how long a
// poll takes. The model runs from event to event.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/bench.hpp"
#include "cmodel/advance.hpp"
#include "tb/devices/modbus_host.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;

constexpr double kStep = 0.0025;  // of the host's clock error
constexpr int kSteps = 24;        // each way: 6 %
constexpr double kWanted = 3.5;   // %

// The longest write's 41 bytes, back to back.
constexpr std::size_t kFrameBytes = 41;
constexpr std::uint8_t kUnit = 17;

chip::Chip chip_at(double baud, std::uint8_t format) {
  chip::Chip chip;
  for (int i = 0; i < 4; ++i) chip.step({});  // the reset synchroniser lets go
  const auto set = [&](spec::Reg reg, double value) {
    chip.mem.preset(reg, static_cast<std::uint16_t>(std::lround(value)));
  };
  set(spec::kRegAddress, kUnit);
  set(spec::kRegBaud, baud / 100);
  set(spec::kRegFormat, format);
  for (int i = 0; i < 4; ++i) chip.step({});  // the idle port takes them over
  return chip;
}

// A host that only talks.
struct Talker {
  tb::UartTransmitter transmitter;
  chip::Inputs step(std::uint64_t cycle, const chip::Outputs&) {
    return {.uart_rx = transmitter.step(cycle)};
  }
  std::uint64_t next_event() const { return transmitter.next_event(); }
};

struct Trial {
  double baud = 115200;
  spec::CharacterFormat format = spec::kFormat8E1;
  tb::UartLine line() const { return {spec::kClkHz, baud, tb::uart_format(format)}; }
  double clock_error = 0;
  double jitter_bits = 0;
  std::uint64_t glitch_clocks = 0;  // one glitch a frame, anywhere in it
};

// Frames, of `frames`, that the chip does not accept. They are diagnostics to all, which are never answered.
unsigned lost(const Trial& trial, unsigned frames) {
  const tb::UartLine line = trial.line();
  Talker host{{line, {trial.clock_error, trial.jitter_bits}, stream(1, "jitter")}};
  Rng rng = stream(1, "frames");
  chip::Run run{.chip = chip_at(trial.baud, trial.format)};
  run.out = run.chip.outputs({});
  const double bit = line.bit_cycles() / (1.0 + trial.clock_error);
  const double frame = kFrameBytes * line.format.bits() * bit;
  const auto heard = [&] { return run.chip.uartc.messages(); };
  std::uint16_t accepted = 0;
  for (unsigned i = 0; i < frames; ++i) {
    std::vector<std::uint8_t> body{0, 8};
    while (body.size() < kFrameBytes - 2) body.push_back(static_cast<std::uint8_t>(rng.bits()));
    // Anywhere in the chip's clock and its sixteenth bit.
    const double wait = bit * (4.0 * line.format.bits() + rng.uniform());
    bool first = true;
    for (tb::UartChar c : tb::with_crc(body).frame) {
      if (first) c.gap_bits = wait / bit;
      first = false;
      host.transmitter.send(c);
    }
    if (trial.glitch_clocks != 0)
      host.transmitter.glitch(run.cycle + static_cast<std::uint64_t>(wait + rng.uniform() * frame),
                              trial.glitch_clocks);
    chip::advance(run, run.cycle + static_cast<std::uint64_t>(wait + frame + 4.0 * line.format.bits() * bit),
                  host, [](auto...) {});
    accepted = heard();
  }
  return frames - accepted;
}

// Largest errors, slow and fast, up to which and at all steps between no frame is lost, in %.
struct Range {
  double slow = 0;
  double fast = 0;
};

std::vector<unsigned> curve(Trial trial, unsigned frames) {
  std::vector<unsigned> losses;
  for (int step = -kSteps; step <= kSteps; ++step) {
    trial.clock_error = step * kStep;
    losses.push_back(lost(trial, frames));
  }
  return losses;
}

Range error_free(const std::vector<unsigned>& losses) {
  const auto reach = [&](int direction) {
    int step = 0;
    while (step <= kSteps && losses[static_cast<std::size_t>(kSteps + direction * step)] == 0) ++step;
    return step == 0 ? -1.0 : (step - 1) * kStep * 100;  // -1: not even without error
  };
  return {reach(-1), reach(+1)};
}

// A host that polls.
struct Poller {
  tb::ModbusHost host;
  chip::Inputs step(std::uint64_t cycle, const chip::Outputs& out) {
    return {.uart_rx = host.step(cycle, out.uart_tx)};
  }
  std::uint64_t next_event() const { return host.next_event(); }
};

// Clocks to the next control tick.
std::uint64_t clocks_to_tick(const chip::Chip& chip) {
  constexpr std::uint64_t kMs = spec::kClkHz / 1000;
  const std::uint64_t ms_left = chip.params()[spec::kRegTs] - 1U - chip.sysctrl.ts_cnt_q;
  return ms_left * kMs + (kMs - 1 - chip.sysctrl.ms_cnt_q);
}

// The worst of `polls` polls: from the request's first start bit to the answer's last stop bit, less both
// frames on the wire and 3.5 characters; in us. The chip takes the requests up from 100 us before a control
// tick to 200 us after it, where the sensor is read and the loop calculated; in the rest of the period
// nothing keeps it from answering.
double poll_over_us(double baud, std::uint16_t registers, unsigned polls) {
  const tb::UartLine line{spec::kClkHz, baud, tb::k8E1};
  const std::uint16_t first =
      registers <= spec::kInputCount ? 0 : spec::kHoldingBase;  // function 04 reads both
  constexpr double kBefore = 100e-6 * spec::kClkHz;
  constexpr double kSpan = 300e-6 * spec::kClkHz;
  const double taken_up = (8.0 + 3.5) * line.char_cycles() - 2.5 * line.bit_cycles();
  const double wire = (8.0 + 5.0 + 2.0 * registers + 3.5) * line.char_cycles();
  Poller poller{{{.line = line}, stream(1, "jitter")}};
  chip::Run run{.chip = chip_at(baud, spec::kFormat8E1)};
  run.out = run.chip.outputs({});
  const auto advance_by = [&](std::uint64_t clocks) {
    chip::advance(run, run.cycle + clocks, poller, [](auto...) {});
  };
  double worst = 0;
  for (unsigned i = 0; i <= polls; ++i) {
    advance_by(spec::kClkHz / 100);  // the silence between frames
    std::uint64_t to_tick = clocks_to_tick(run.chip);
    if (to_tick < spec::kClkHz / 50)
      to_tick += std::uint64_t{run.chip.params()[spec::kRegTs]} * (spec::kClkHz / 1000);
    advance_by(to_tick - static_cast<std::uint64_t>(kBefore + taken_up - kSpan * i / polls));
    poller.host.submit(tb::read_input_registers(kUnit, first, registers));
    while (poller.host.busy()) advance_by(spec::kClkHz / 1000);
    const auto result = poller.host.take_result();
    if (!result || result->outcome != tb::ModbusOutcome::data)
      throw std::runtime_error(fmt::format("bench bus: poll {} at {} baud is not answered", i, baud));
    worst =
        std::max(worst, static_cast<double>(result->reply_end_cycle - result->request_start_cycle) - wire);
  }
  return worst / spec::kClkHz * 1e6;
}

}  // namespace

std::vector<BenchRow> bench_bus(const BenchOptions& options) {
  const unsigned frames = options.quick ? 50 : 1000;  // at each point of a curve
  const unsigned frames_of_range = options.quick ? 50 : 200;
  const unsigned polls = options.quick ? 100 : 1000;
  std::vector<BenchRow> rows;
  struct Poll {
    double baud;
    std::uint16_t registers;
    std::optional<double> at_most;
  };
  const std::array timed{Poll{115200, 16, 100.0}, Poll{115200, 32, 100.0}, Poll{19200, 16, {}},
                         Poll{19200, 32, {}}};
  for (const Poll& poll : timed) {
    tell(options.progress, "polls", rows.size(), timed.size());
    rows.push_back({fmt::format("FC04 of {} at {}: over wire + 3.5 char.", poll.registers, poll.baud),
                    poll_over_us(poll.baud, poll.registers, polls),
                    "us",
                    {},
                    poll.at_most});
  }

  rows.push_back({fmt::format("frames of {} bytes at each point of a range", kFrameBytes),
                  static_cast<double>(frames_of_range),
                  "",
                  {},
                  {}});
  rows.push_back({"  and of a curve", static_cast<double>(frames), "", {}, {}});
  const auto range_rows = [&](const std::string& what, const Range& range, std::optional<double> wanted) {
    rows.push_back({what + ": error-free, host slow", range.slow, "%", wanted, {}});
    rows.push_back({what + ": error-free, host fast", range.fast, "%", wanted, {}});
  };
  constexpr std::array kRates{9600.0, 115200.0, 500000.0};
  std::size_t ranges = 0;
  for (const double baud : kRates) {
    for (std::size_t code = 0; code < spec::kCharacters.size(); ++code) {
      tell(options.progress, "ranges", ranges++, kRates.size() * spec::kCharacters.size());
      const Trial trial{.baud = baud, .format = static_cast<spec::CharacterFormat>(code)};
      range_rows(fmt::format("{:.0f} {}", baud, spec::kCharacters[code].name),
                 error_free(curve(trial, frames_of_range)), kWanted);
    }
  }
  // The curve itself, for both kinds of character and each jitter.
  constexpr std::array drawn{spec::kFormat8E1, spec::kFormat8N1};
  constexpr std::array kJitters{0.0, 0.05, 0.10};
  std::size_t curves = 0;
  for (const spec::CharacterFormat format : drawn) {
    for (const double jitter : kJitters) {
      tell(options.progress, "curves", curves++, drawn.size() * kJitters.size());
      const std::string what =
          fmt::format("115200 {} jitter {:.0f} %", spec::kCharacters[format].name, 100 * jitter);
      const std::vector<unsigned> losses = curve({.format = format, .jitter_bits = jitter}, frames);
      if (jitter != 0) range_rows(what, error_free(losses), {});
      for (int step = -kSteps; step <= kSteps; ++step) {
        rows.push_back({fmt::format("{}, host {:+.2f} %: lost", what, step * kStep * 100),
                        1000.0 * losses[static_cast<std::size_t>(step + kSteps)] / frames,
                        "per 1000",
                        {},
                        {}});
      }
    }
  }
  // One pulse a frame; a bit at 115200 has 104 clocks, a sixteenth 6.5.
  for (const std::uint64_t clocks : {1U, 3U, 6U, 13U, 26U, 52U, 104U}) {
    rows.push_back({fmt::format("115200 8E1, a pulse of {} clocks in each frame: lost", clocks),
                    1000.0 * lost({.glitch_clocks = clocks}, frames) / frames,
                    "per 1000",
                    {},
                    {}});
  }
  return rows;
}

}  // namespace meltstage::app
