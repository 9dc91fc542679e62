// SPDX-License-Identifier: Apache-2.0
#include "app/grade_report.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>

#include "asic/dft/error.hpp"
#include "asic/dft/places.hpp"

namespace meltstage::app {

namespace {

using namespace dft;

constexpr char kStill[] = "cannot move once reset, whatever the vectors";

bool begins_with_any(const std::string& name, const std::vector<std::string>& beginnings) {
  return std::any_of(beginnings.begin(), beginnings.end(),
                     [&](const std::string& b) { return name.starts_with(b); });
}

// By node, why it cannot toggle; empty where nothing says so.
std::vector<std::string> reasons_of(const CaptureView& view, const std::vector<std::string>& places,
                                    const std::vector<Unreached>& unreached) {
  const Circuit& circuit = view.circuit;
  std::vector<std::string> reasons(circuit.size());
  std::vector<std::uint8_t> held(view.flops.size(), 0);
  const auto note = [&](const std::string& reason) {
    const std::vector<std::uint8_t> still = still_after_reset(view, held);
    for (Node node = 0; node < circuit.size(); ++node) {
      if (still[node] != 0 && reasons[node].empty()) reasons[node] = reason;
    }
  };
  note(kStill);
  for (const Unreached& rule : unreached) {
    for (std::size_t k = 0; k < held.size(); ++k) {
      if (begins_with_any(places[circuit.inputs()[view.input_ports.size() + k]], rule.flops)) held[k] = 1;
    }
    note(rule.reason);
  }
  for (const Unreached& rule : unreached) {
    for (Node node = 0; node < circuit.size(); ++node) {
      if (reasons[node].empty() && begins_with_any(places[node], rule.near)) reasons[node] = rule.reason;
    }
  }
  return reasons;
}

// Pieces of the stream by the clock that begins them.
std::map<std::uint64_t, std::string> pieces_of(const CycleStream& stream) {
  std::map<std::uint64_t, std::string> pieces{{0, ""}};
  std::uint64_t clock = 0;
  for (const TestCycle& cycle : stream.cycles) {
    if (!cycle.label.empty()) pieces[clock] = cycle.label;
    if (cycle.states.find('P') != std::string::npos) clock += cycle.count;
  }
  return pieces;
}

std::vector<std::string> strings_of(const toml::table& table, const char* key, const std::string& where) {
  std::vector<std::string> result;
  if (!table.contains(key)) return result;
  const toml::array* array = table[key].as_array();
  if (array == nullptr || !array->is_homogeneous(toml::node_type::string))
    throw InputError(fmt::format("{}: {}: expected an array of strings", where, key));
  for (const toml::node& node : *array) result.push_back(node.value_or(std::string()));
  return result;
}

double percent(std::size_t part, std::size_t of) {
  return of == 0 ? 100.0 : 100.0 * static_cast<double>(part) / static_cast<double>(of);
}

}  // namespace

std::vector<Unreached> read_unreached(const std::filesystem::path& path) {
  std::vector<Unreached> rules;
  try {
    const toml::table root = toml::parse_file(path.string());
    const toml::array* tables = root["unreached"].as_array();
    if (tables == nullptr)
      throw InputError(path.string() + ": found no [[unreached]], expected one for each reason");
    for (const toml::node& node : *tables) {
      const toml::table* table = node.as_table();
      const std::string where = fmt::format("{}:{}", path.string(), node.source().begin.line);
      if (table == nullptr || !(*table)["reason"].is_string())
        throw InputError(where + ": found no reason, expected a string");
      Unreached rule{strings_of(*table, "flops", where), strings_of(*table, "near", where),
                     (*table)["reason"].value_or(std::string())};
      if (rule.flops.empty() && rule.near.empty())
        throw InputError(where + ": found neither flops nor near, expected names");
      rules.push_back(std::move(rule));
    }
  } catch (const toml::parse_error& error) {
    throw InputError(fmt::format("{}:{}: {}; expected TOML", path.string(), error.source().begin.line,
                                 error.description()));
  }
  return rules;
}

GradeReport grade_report(const Netlist& netlist, const CaptureView& view, const CycleStream& stream,
                         const std::vector<Fault>& sample, const std::vector<FaultClass>& verdicts,
                         const FunctionalGrade& grade, const std::vector<Unreached>& unreached) {
  const std::vector<std::string> places = places_of(netlist, view);
  const std::vector<std::string> reasons = reasons_of(view, places, unreached);
  const std::vector<Site>& sites = view.circuit.sites();
  const std::map<std::uint64_t, std::string> pieces = pieces_of(stream);
  std::map<std::uint64_t, std::size_t> found_in;
  GradeReport report;
  std::string faults, idle;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    ModuleGrade& module = report.modules[module_of(places[sample[i].node])];
    ++module.faults;
    const std::uint64_t first = grade.first_clock[i];
    const bool found = first != FunctionalGrade::kUndetected;
    module.detected += verdicts[i] == FaultClass::DS ? 1 : 0;
    if (found) ++found_in[std::prev(pieces.upper_bound(first))->first];
    faults += fmt::format("{}{} stuck-at-{} {}{} at {}\n", view.circuit.name(sample[i].node),
                          sample[i].pin == kStem ? "" : fmt::format(" input {}", sample[i].pin),
                          sample[i].stuck ? 1 : 0, to_string(verdicts[i]),
                          found ? fmt::format(" {}", first) : "", places[sample[i].node]);
  }
  for (const std::size_t site : grade.toggle.idle) {
    const Node node = sites[site].node;
    ++report.modules[module_of(places[node])].outputs;
    const std::string& reason = reasons[node];
    idle += fmt::format("{} does not toggle at {}{}\n", sites[site].name, places[node],
                        reason.empty() ? "" : ": " + reason);
    if (reason.empty()) continue;
    ++report.unreached;
    ++report.reasons[reason];
    ++report.modules[module_of(places[node])].unreached;
  }
  for (const Node node : grade.toggle.moving) {
    ModuleGrade& module = report.modules[module_of(places[node])];
    ++module.outputs;
    ++module.toggled;
  }
  for (const auto& [name, m] : report.modules)
    report.text +=
        fmt::format("module {}: {} of {} faults ({:.1f} %), {} of {} outputs toggle ({:.1f} %), {} cannot\n",
                    name, m.detected, m.faults, percent(m.detected, m.faults), m.toggled, m.outputs,
                    percent(m.toggled, m.outputs), m.unreached);
  for (const auto& [clock, label] : pieces) {
    if (!label.empty() || found_in.count(clock) != 0)
      report.text +=
          fmt::format("piece \"{}\" from clock {}: {} faults first\n", label, clock, found_in[clock]);
  }
  for (const auto& [reason, count] : report.reasons)
    report.text += fmt::format("reason \"{}\": {} outputs\n", reason, count);
  report.text += faults + idle;
  return report;
}

}  // namespace meltstage::app
