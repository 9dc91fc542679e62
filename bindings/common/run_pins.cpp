// SPDX-License-Identifier: Apache-2.0
#include "bindings/common/run_pins.hpp"

#include <fmt/format.h>

#include <vector>

#include "base/error.hpp"
#include "recording/text.hpp"

namespace meltstage::bindings {

std::array<std::uint64_t, tb::kChipPinCount> levels_of(const tb::PinChange& change) {
  std::array<std::uint64_t, tb::kChipPinCount> levels{};
  unsigned first = 0;
  for (std::uint32_t pin = 0; pin < tb::kChipPinCount; ++pin) {
    const unsigned width = chip::spec::kPins[pin].width;
    levels[pin] = change.pins >> first & recording::max_value(width);
    first += width;
  }
  return levels;
}

ModelChip chip_of(const tb::ScriptedRun& run) {
  ModelChip copy{run.chip(), {}, run.cycle()};
  const std::vector<tb::PinChange> last = run.pins(run.cycle(), run.cycle());
  if (!last.empty()) copy.in = tb::inputs_of(levels_of(last.back()));
  return copy;
}

void record_pins(const tb::ScriptedRun& run, const std::filesystem::path& path, const std::string& origin) {
  const std::vector<tb::PinChange> changes = run.pins(0, run.cycle());
  if (changes.empty()) throw UserError("recording: found a run of no clock, expected one; let it run first");
  if (changes.front().cycle != 0)
    throw UserError(fmt::format(
        "recording: found pins from {:.6g} s on, as the run keeps no more changes, expected them from 0 s; "
        "record a shorter run",
        static_cast<double>(changes.front().cycle) / chip::spec::kClkHz));
  recording::TextWriter writer(path);
  recording::Recorder recorder(writer, tb::chip_pin_header(origin));
  for (const tb::PinChange& change : changes) {
    const auto levels = levels_of(change);
    const chip::Inputs in = tb::inputs_of(levels);
    tb::record_inputs(recorder, in);
    tb::record_outputs(recorder, tb::before_clock(tb::outputs_of(levels), in));
    recorder.commit(change.cycle);
  }
  recorder.finish(run.cycle() - 1);
}

}  // namespace meltstage::bindings
