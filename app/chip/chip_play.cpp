// SPDX-License-Identifier: Apache-2.0
#include "app/chip/chip_play.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "app/chip/scenario_file.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"
#include "recording/vcd.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/scenario/scripted_run.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;

// What was asked of the chip in vain, each in a line; returns how many.
std::uint64_t tell_failures(const tb::ScriptedRun& run, const std::string& file) {
  std::vector<tb::LogEntry> told = run.failures();
  const std::vector<tb::LogEntry> unanswered = run.unanswered();
  const std::uint64_t all = run.failed() + unanswered.size();
  told.insert(told.end(), unanswered.begin(), unanswered.end());
  if (told.size() > tb::ScriptedRun::kMostFailures) told.resize(tb::ScriptedRun::kMostFailures);
  for (const tb::LogEntry& entry : told)
    fmt::print(stderr, "{}{}: at {:.6g} s: {}: {}\n", file,
               entry.line == 0 ? std::string() : fmt::format(":{}", entry.line), entry.time_s, entry.what,
               entry.answer);
  if (all != 0)
    fmt::print(stderr,
               "{}: {} of what the host asked {} not done, expected all; write try before what may fail\n",
               file, all, all == 1 ? "was" : "were");
  return all;
}

// Not done, as its time was not reached.
void tell_rest(const tb::ScriptedRun& run, const PlayOptions& options, const std::string& file) {
  if (const auto& rest = run.events_to_come(); !rest.empty())
    fmt::print(stderr,
               "note: {}: {} of its events, from \"{}\" at {:.6g} s on, are behind the end at {:g} s\n", file,
               rest.size(), shown(rest.front().text), static_cast<double>(rest.front().cycle) / spec::kClkHz,
               options.for_s);
}

void write_waves(const tb::ScriptedRun& run, const std::filesystem::path& path) {
  const std::vector<tb::PinBits> pins = tb::chip_pin_bits();  // in the order of the recording's
  recording::VcdWriter vcd(path, recording::BusForm::bits);
  recording::Recorder recorder(vcd, tb::chip_pin_header("meltstage chip play"));
  for (const tb::PinChange& change : run.pins(0, run.cycle())) {
    const auto level = [&](std::uint32_t pin) {
      return change.pins >> pins[pin].first & ((std::uint64_t{1} << pins[pin].width) - 1);
    };
    for (std::uint32_t pin = 0; pin < tb::kChipPinCount; ++pin) recorder.set(pin, level(pin));
    recorder.set(tb::kPinHeater, level(tb::kPinHeater) & ~level(tb::kPinInhibit));  // without a clock
    recorder.commit(change.cycle);
  }
  recorder.finish(run.cycle() - 1);  // the last one that was run
}

}  // namespace

int play_scenario(const PlayOptions& options) {
  require_other_files({options.out, options.vcd}, {options.scenario});
  tb::ScriptedRun run(tb::parse_scenario(scenario_text(options.scenario)).scenario);
  const auto end = static_cast<std::uint64_t>(std::llround(options.for_s * spec::kClkHz));
  ProgressLine line;
  while (run.cycle() < end) {
    throw_if_interrupted();
    run.until(std::min(end, run.cycle() + spec::kClkHz));
    line.show(fmt::format("{:.0f} of {:.0f} s of the chip", run.now_s(), options.for_s));
  }
  line.clear();
  const std::string file = shown(options.scenario.string());
  const std::uint64_t failed = tell_failures(run, file);
  tell_rest(run, options, file);
  if (!options.vcd.empty()) write_waves(run, options.vcd);
  const std::string trace = trace_text(run);
  if (options.out.empty())
    fmt::print("{}", trace);
  else
    write_whole(options.out, trace);
  return failed == 0 ? 0 : 1;
}

}  // namespace meltstage::app
