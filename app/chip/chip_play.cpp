// SPDX-License-Identifier: Apache-2.0
#include "app/chip/chip_play.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

#include "app/terminal.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "tb/scenario/scripted_run.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;

tb::Scenario read_scenario(const std::filesystem::path& path) {
  tb::ParsedScenario parsed = tb::parse_scenario(read_file(path, "a scenario", tb::kMostScenarioBytes));
  if (parsed.defect)
    throw UserError(fmt::format("{}:{}: found {}, expected {}", path.string(), parsed.defect->line,
                                parsed.defect->found, parsed.defect->expected));
  return std::move(parsed.scenario);
}

// What the trace doesn't say.
void tell(const tb::ScriptedRun& run, const PlayOptions& options) {
  const std::string file = shown(options.scenario.string());
  for (const tb::LogEntry& refusal : run.refusals())
    fmt::print(stderr, "note: {}: at {:.6g} s: {}: {}\n", file, refusal.time_s, refusal.what, refusal.answer);
  if (run.refused() > run.refusals().size())
    fmt::print(stderr, "note: {}: the chip refused {} more\n", file, run.refused() - run.refusals().size());
  if (const auto& rest = run.events_to_come(); !rest.empty())
    fmt::print(stderr,
               "note: {}: {} of its events, from \"{}\" at {:.6g} s on, are behind the end at {:g} s\n", file,
               rest.size(), shown(rest.front().text), static_cast<double>(rest.front().cycle) / spec::kClkHz,
               options.for_s);
}

}  // namespace

int play_scenario(const PlayOptions& options) {
  if (!options.out.empty()) require_other_file(options.out, {options.scenario});
  tb::ScriptedRun run(read_scenario(options.scenario));
  const auto end = static_cast<std::uint64_t>(std::llround(options.for_s * spec::kClkHz));
  ProgressLine line;
  while (run.cycle() < end) {
    throw_if_interrupted();
    run.until(std::min(end, run.cycle() + spec::kClkHz));
    line.show(fmt::format("{:.0f} of {:.0f} s of the chip", run.now_s(), options.for_s));
  }
  line.clear();
  tell(run, options);
  const std::string trace = trace_text(run);
  if (options.out.empty())
    fmt::print("{}", trace);
  else
    write_whole(options.out, trace);
  return 0;
}

}  // namespace meltstage::app
