// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>
#include <utility>

#include "base/error.hpp"
#include "bindings/c/handles.hpp"
#include "bindings/c/status.hpp"
#include "bindings/common/run_pins.hpp"

using namespace meltstage;
using c::guarded;
using c::required;

namespace {

constexpr double kLongest_s = 1e9;

std::uint64_t cycle_of(const char* name, double time_s) {
  return static_cast<std::uint64_t>(
      std::llround(c::number(name, time_s, 0.0, kLongest_s) * chip::spec::kClkHz));
}

// The rows are handed out as they are.
static_assert(sizeof(ms_trace_row) == sizeof(tb::TraceRow));
static_assert(offsetof(ms_trace_row, duty_percent) == offsetof(tb::TraceRow, duty_percent));
static_assert(offsetof(ms_trace_row, pins_hash) == offsetof(tb::TraceRow, pins_hash));

}  // namespace

extern "C" {

ms_status ms_run_new(const char* scenario, ms_run** run) {
  return guarded([&] {
    ms_run*& made = required(run, "run");
    tb::ParsedScenario parsed = tb::parse_scenario(&required(scenario, "scenario"));
    if (parsed.defect)
      throw UserError(fmt::format("scenario, line {}: found {}, expected {}", parsed.defect->line,
                                  parsed.defect->found, parsed.defect->expected));
    made = new ms_run{tb::ScriptedRun(std::move(parsed.scenario))};
  });
}

void ms_run_free(ms_run* run) { delete run; }

ms_status ms_run_until(ms_run* run, double time_s) {
  return guarded([&] { required(run, "run").run.until(cycle_of("time_s", time_s)); });
}

ms_status ms_run_do(ms_run* run, const char* event, double at_s) {
  return guarded([&] {
    ms_run& found = required(run, "run");
    tb::ParsedEvent parsed = tb::parse_event(&required(event, "event"), cycle_of("at_s", at_s));
    if (parsed.defect)
      throw UserError(
          fmt::format("event: found {}, expected {}", parsed.defect->found, parsed.defect->expected));
    found.run.add(std::move(parsed.event));
  });
}

ms_status ms_run_trace(const ms_run* run, const ms_trace_row** rows, size_t* count) {
  return guarded([&] {
    const auto& kept = required(run, "run").run.rows();
    const ms_trace_row*& out = required(rows, "rows");
    required(count, "count") = kept.size();
    out = reinterpret_cast<const ms_trace_row*>(kept.data());
  });
}

ms_status ms_run_failed(const ms_run* run, uint64_t* count) {
  return guarded([&] {
    const tb::ScriptedRun& found = required(run, "run").run;
    required(count, "count") = found.failed() + found.unanswered().size();
  });
}

ms_status ms_run_fault(const ms_run* run, char* text, size_t size, size_t* needed) {
  return guarded([&] {
    const std::string fault = required(run, "run").run.fault();
    if (size != 0) {
      char* out = &required(text, "text");
      const std::size_t taken = std::min(fault.size(), size - 1);
      std::memcpy(out, fault.data(), taken);
      out[taken] = '\0';
    }
    if (needed != nullptr) *needed = fault.size() + 1;
  });
}

ms_status ms_run_chip(const ms_run* run, ms_chip** copy) {
  return guarded([&] {
    ms_chip*& made = required(copy, "copy");
    made = new ms_chip{bindings::chip_of(required(run, "run").run)};
  });
}

ms_status ms_run_record(const ms_run* run, const char* path) {
  return guarded(
      [&] { bindings::record_pins(required(run, "run").run, &required(path, "path"), "libmeltstage"); });
}

}  // extern "C"
