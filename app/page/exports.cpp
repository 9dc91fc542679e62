// SPDX-License-Identifier: Apache-2.0
// The scripted run as the page's script calls it: plain functions of WebAssembly over one run. Text goes in
// through input(), and comes out at answer(). Rows, pins and registers are read where they lie.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "tb/scenario/scripted_run.hpp"

#define EXPORTED(name) extern "C" __attribute__((export_name(#name)))

namespace {

using namespace meltstage;
namespace spec = chip::spec;

std::string input_text;
std::string answer_text;
std::optional<tb::ScriptedRun> run;

std::string quoted(std::string_view text) {
  std::string json = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      json += fmt::format("\\{}", c);
    else if (static_cast<unsigned char>(c) < 0x20)
      json += fmt::format("\\u{:04x}", c);
    else
      json += c;
  }
  return json + '"';
}

std::string hexadecimal(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{}{:02x}", text.empty() ? "" : " ", byte);
  return text;
}

// "[a,b,...]" of what `item` makes of each entry.
template <class List, class Item>
std::string list(const List& entries, Item item) {
  std::string json;
  for (const auto& entry : entries) json += (json.empty() ? "[" : ",") + item(entry);
  return json.empty() ? "[]" : json + "]";
}

// Whether it was taken; if not, the answer says why.
bool taken(const std::optional<tb::ScenarioDefect>& defect) {
  answer_text =
      defect ? fmt::format("line {}: found {}, expected {}", defect->line, defect->found, defect->expected)
             : std::string();
  return !defect;
}

std::uint64_t cycle_at(double time_s) {
  return static_cast<std::uint64_t>(std::llround(std::clamp(time_s, 0.0, 1e9) * spec::kClkHz));
}

}  // namespace

/// Room for a text of so many bytes to come.
EXPORTED(input) char* input(std::uint32_t bytes) {
  input_text.assign(bytes, ' ');
  return input_text.data();
}
EXPORTED(answer) const char* answer() { return answer_text.data(); }
EXPORTED(answer_bytes) std::uint32_t answer_bytes() { return static_cast<std::uint32_t>(answer_text.size()); }

/// A new run by the scenario in input(). A defect leaves the run as it was.
EXPORTED(open) bool open_run() {
  tb::ParsedScenario parsed = tb::parse_scenario(input_text);
  if (!taken(parsed.defect)) return false;
  run.emplace(std::move(parsed.scenario));
  run->until(run->cycle());
  return true;
}
/// The event in input(), now.
EXPORTED(act) bool act() {
  tb::ParsedEvent parsed = tb::parse_event(input_text, run->cycle());
  if (!taken(parsed.defect)) return false;
  run->add(std::move(parsed.event));
  return true;
}
EXPORTED(run_until) void run_until(double time_s) { run->until(cycle_at(time_s)); }
EXPORTED(now) double now() { return run->now_s(); }

/// The rows that are kept, row_doubles() doubles each (tb::TraceRow).
EXPORTED(rows) const tb::TraceRow* rows() { return run->rows().data(); }
EXPORTED(row_count) std::uint32_t row_count() { return static_cast<std::uint32_t>(run->rows().size()); }
EXPORTED(row_doubles) std::uint32_t row_doubles() { return sizeof(tb::TraceRow) / sizeof(double); }

EXPORTED(states_seen) std::uint32_t states_seen() { return run->take_states_seen(); }

/// Into answer(): the fault's sentence.
EXPORTED(fault) void fault() { answer_text = run->fault(); }
/// Into answer(): the trace as text.
EXPORTED(trace) void trace() { answer_text = tb::trace_text(*run); }
/// Into answer(): log entries from that number on, as JSON.
EXPORTED(log_from) void log_from(std::uint32_t number) {
  const std::uint64_t dropped = run->log_dropped();
  const std::size_t skip = number > dropped ? number - dropped : 0;
  std::string json;
  for (std::size_t i = skip; i < run->log().size(); ++i) {
    const tb::LogEntry& entry = run->log()[i];
    json += fmt::format("{}[{},{:.6f},{},{},{},{},{}]", json.empty() ? "" : ",", dropped + i, entry.time_s,
                        quoted(entry.what), quoted(entry.answer), quoted(hexadecimal(entry.request)),
                        quoted(hexadecimal(entry.reply)), entry.failed);
  }
  answer_text = "[" + json + "]";
}
/// Into answer(): words of all input registers, then of all holding registers, as JSON.
EXPORTED(registers) void registers() {
  std::string json;
  const auto add = [&](std::uint16_t address) {
    json += fmt::format("{}{}", json.empty() ? "" : ",", run->chip().read_register(address));
  };
  for (std::uint16_t i = 0; i < spec::kInputCount; ++i) add(i);
  for (std::uint16_t i = 0; i < spec::kHoldingCount; ++i)
    add(static_cast<std::uint16_t>(spec::kHoldingBase + i));
  answer_text = "[" + json + "]";
}
/// Into answer(): [clock, levels] of each change of pins between two times, as JSON.
EXPORTED(pins) void pins(double begin_s, double end_s) {
  answer_text = list(run->pins(cycle_at(begin_s), cycle_at(end_s)), [](const tb::PinChange& change) {
    return fmt::format("[{},{}]", change.cycle, change.pins);
  });
}
/// Into answer(): what the page names, as JSON.
EXPORTED(about) void about() {
  const auto name = [](const auto& entry) { return quoted(entry.name); };
  const std::string events = list(tb::event_usages(), [](const tb::EventUsage& usage) {
    return fmt::format("[{},{},{}]", quoted(usage.word), quoted(usage.arguments), quoted(usage.summary));
  });
  answer_text = fmt::format(
      R"({{"clock_hz":{},"heads":{},"sensors":{},"states":{},"state_codes":{},"faults":{},"pins":{},"events":{}}})",
      spec::kClkHz, list(tb::kPlants, name), list(spec::kSensorPresets, name), list(spec::kStates, name),
      list(spec::kStates,
           [](const spec::StateInfo& s) { return fmt::format("{}", static_cast<int>(s.code)); }),
      list(spec::kFaults, name),
      list(tb::chip_pin_bits(),
           [](const tb::PinBits& pin) {
             return fmt::format("[{},{},{}]", quoted(pin.name), pin.first, pin.width);
           }),
      events);
}
