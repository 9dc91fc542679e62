// SPDX-License-Identifier: Apache-2.0
#include "asic/signoff/grade_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <span>

#include "asic/dft/core/parities.hpp"
#include "asic/dft/core/places.hpp"
#include "base/error.hpp"
#include "base/toml_file.hpp"

namespace meltstage::app {

namespace {

using namespace dft;

constexpr char kStill[] = "cannot move once reset, whatever the vectors";

// A whole name; or, where it ends in [ or a dot, the beginning of one.
bool is_any_of(const std::string& name, const std::vector<std::string>& wanted) {
  return std::any_of(wanted.begin(), wanted.end(), [&](const std::string& w) {
    return name == w || ((w.ends_with('[') || w.ends_with('.')) && name.starts_with(w));
  });
}

// Why a line cannot toggle, and why a fault of it cannot be seen; empty where nothing says so.
struct LineReasons {
  std::string still, unseen;
  std::int8_t level = -1;  // that it keeps, where that is known
};

// Word and bit of flop `name`, "u.mem[7][3]" where `words` holds "u.mem[".
struct WordBit {
  std::string word;
  unsigned bit;
};
std::optional<WordBit> word_bit(const std::string& name, const std::vector<std::string>& words) {
  const std::size_t open = name.rfind('[');
  if (!is_any_of(name, words) || !name.ends_with(']') || open < 2 || name[open - 1] != ']') return {};
  WordBit result{name.substr(0, open), 0};
  const char* end = name.data() + name.size() - 1;
  const auto [rest, error] = std::from_chars(name.data() + open + 1, end, result.bit);
  if (error != std::errc() || rest != end) return {};
  return result;
}

// The flop whose state a net shows, straight or inverted; kNoNode where it shows none.
Node flop_of(const CaptureView& view, Net net) {
  const auto found = view.node_of_net.find(net);
  if (found == view.node_of_net.end()) return kNoNode;
  Node node = found->second;
  const Circuit& circuit = view.circuit;
  while (circuit.kind(node) == Gate::buf || circuit.kind(node) == Gate::inv) node = circuit.fanin(node)[0];
  const auto flops = std::span(circuit.inputs()).subspan(view.input_ports.size());
  return std::find(flops.begin(), flops.end(), node) != flops.end() ? node : kNoNode;
}

// Of a rule's words, the sums that never change; constant bits of a word are none of its flops.
std::vector<Parity> parities_of(const Netlist& netlist, const CaptureView& view, const Unreached& rule) {
  std::map<std::string, std::map<unsigned, Net>> words;
  for (const auto& [name, net] : netlist.nets_in_modules)
    if (const auto place = word_bit(name, rule.words)) words[place->word][place->bit] = net;
  std::vector<Parity> result;
  for (const auto& [word, bits] : words) {
    for (const std::vector<unsigned>& parity : rule.parities) {
      Parity flops;
      for (const unsigned bit : parity) {
        const auto net = bits.find(bit);
        if (net != bits.end() && (net->second == 0 || net->second == 1)) continue;
        const Node flop = net == bits.end() ? kNoNode : flop_of(view, net->second);
        if (flop == kNoNode)
          throw UserError(
              fmt::format("{}[{}]: found neither flop nor constant, expected a bit of a word (\"{}\")", word,
                          bit, rule.reason));
        flops.push_back(flop);
      }
      if (!flops.empty()) result.push_back(std::move(flops));
    }
  }
  if (result.empty())
    throw UserError(fmt::format("\"{}\": found no such words, expected NAME[index][bit]", rule.reason));
  return result;
}

// The level of each of `idle` that a rule's words leave it, with `held` ports at 0.
std::vector<std::int8_t> levels_of_words(const Netlist& netlist, const CaptureView& view,
                                         const Unreached& rule, const std::vector<std::uint8_t>& held,
                                         const std::vector<Node>& idle) {
  const std::size_t ports = view.input_ports.size();
  std::vector<std::int8_t> reset(held.size(), 0);
  for (std::size_t k = 0; k < view.flops.size(); ++k)
    reset[ports + k] = view.flops[k].has_reset && view.flops[k].reset_value ? 1 : 0;
  std::vector<std::uint8_t> ports_held(held.begin(), held.begin() + static_cast<std::ptrdiff_t>(ports));
  ports_held.resize(held.size(), 0);
  return levels_under(view.circuit, parities_of(netlist, view, rule), reset, ports_held, idle);
}

std::vector<LineReasons> reasons_of(const Netlist& netlist, const CaptureView& view,
                                    const std::vector<std::string>& places,
                                    const std::vector<Unreached>& unreached, const ToggleCoverage& toggle) {
  const Circuit& circuit = view.circuit;
  std::vector<LineReasons> reasons(circuit.size());
  std::vector<std::uint8_t> held(circuit.inputs().size(), 0);
  const auto note = [&](const std::string& reason) {
    const std::vector<std::int8_t> levels = still_after_reset(view, held);
    for (Node node = 0; node < circuit.size(); ++node) {
      if (levels[node] >= 0 && reasons[node].still.empty()) reasons[node] = {reason, {}, levels[node]};
    }
  };
  note(kStill);
  const std::size_t ports = view.input_ports.size();
  for (const Unreached& rule : unreached) {
    for (std::size_t i = 0; i < held.size(); ++i) {
      const std::string& name = i < ports ? view.input_ports[i] : places[circuit.inputs()[i]];
      if (is_any_of(name, rule.flops)) held[i] = 1;
    }
    note(rule.reason);
  }
  for (const Unreached& rule : unreached) {
    if (rule.words.empty()) continue;
    std::vector<Node> idle;
    for (const std::size_t site : toggle.idle)
      if (const Node node = circuit.sites()[site].node; reasons[node].still.empty()) idle.push_back(node);
    const std::vector<std::int8_t> levels = levels_of_words(netlist, view, rule, held, idle);
    for (const Node node : idle)
      if (levels[node] >= 0) reasons[node] = {rule.reason, {}, levels[node]};
  }
  for (const Unreached& rule : unreached) {
    std::vector<std::uint8_t> unseen;
    for (const std::string& port : view.output_ports) unseen.push_back(is_any_of(port, rule.unseen) ? 1 : 0);
    for (std::size_t k = 0; k < view.flops.size(); ++k)
      unseen.push_back(is_any_of(places[circuit.inputs()[ports + k]], rule.unseen) ? 1 : 0);
    const std::vector<std::uint8_t> only = leads_only_to(view, unseen);
    for (Node node = 0; node < circuit.size(); ++node) {
      LineReasons& line = reasons[node];
      if (line.still.empty() && is_any_of(places[node], rule.near)) line.still = rule.reason;
      if (line.unseen.empty() && only[node] != 0) line.unseen = rule.reason;
    }
  }
  return reasons;
}

// Why function cannot show an undetected fault; empty where nothing says so.
std::string hidden_by(const std::vector<LineReasons>& reasons, const Circuit& circuit, const Fault& fault,
                      const std::vector<std::uint8_t>& moving) {
  const Node line =
      fault.pin == kStem ? fault.node : circuit.fanin(fault.node)[static_cast<std::size_t>(fault.pin)];
  const LineReasons& of_line = reasons[line];
  if (of_line.level == (fault.stuck ? 1 : 0)) return of_line.still;
  if (!reasons[fault.node].unseen.empty()) return reasons[fault.node].unseen;
  // A place alone says nothing of a line that moves.
  return of_line.level < 0 && moving[line] == 0 ? of_line.still : std::string();
}

// Pieces of the stream by the cycle that begins them.
std::map<std::uint64_t, std::string> pieces_of(const CycleStream& stream) {
  std::map<std::uint64_t, std::string> pieces{{0, ""}};
  std::uint64_t number = 0;
  for (const TestCycle& cycle : stream.cycles) {
    if (!cycle.label.empty()) pieces[number] = cycle.label;
    number += cycle.count;
  }
  return pieces;
}

double percent(std::size_t part, std::size_t of) {
  return of == 0 ? 100.0 : 100.0 * static_cast<double>(part) / static_cast<double>(of);
}

}  // namespace

std::vector<Unreached> read_unreached(const std::filesystem::path& path) {
  constexpr unsigned kMostBits = 0xFFFF;
  const toml::table table = parse_toml(path, "reasons (TOML), a [[unreached]] each");
  TomlSection root(path, &table, "");
  std::vector<TomlSection> sections = root.sections("unreached");
  root.finish();
  std::vector<Unreached> rules;
  for (TomlSection& section : sections) {
    Unreached rule{section.texts("flops"),
                   section.texts("near"),
                   section.texts("unseen"),
                   section.texts("words"),
                   section.rows("parities", kMostBits),
                   section.text("reason", "")};
    section.finish();
    if (rule.reason.empty()) section.fail("reason", "nothing", "a text in quotes");
    if (rule.flops.empty() && rule.near.empty() && rule.unseen.empty() && rule.words.empty())
      section.fail("flops", "nothing, nor near, unseen, words", "names in one of them");
    if (rule.words.empty() != rule.parities.empty())
      section.fail(rule.words.empty() ? "words" : "parities", "nothing", "both words and parities, or none");
    rules.push_back(std::move(rule));
  }
  return rules;
}

GradeReport grade_report(const Netlist& netlist, const CaptureView& view, const CycleStream& stream,
                         const std::vector<Fault>& sample, const std::vector<FaultClass>& verdicts,
                         const FunctionalGrade& grade, const std::vector<Unreached>& unreached) {
  const std::vector<std::string> places = places_of(netlist, view);
  const std::vector<LineReasons> reasons = reasons_of(netlist, view, places, unreached, grade.toggle);
  std::vector<std::uint8_t> moving(view.circuit.size(), 0);
  for (const Node node : grade.toggle.moving) {
    moving[node] = 1;
    if (reasons[node].level >= 0)
      throw UserError(fmt::format("{}: found moving, expected still (\"{}\"); leave it out of the reasons",
                                  places[node], reasons[node].still));
  }
  const std::vector<Site>& sites = view.circuit.sites();
  const std::map<std::uint64_t, std::string> pieces = pieces_of(stream);
  std::map<std::uint64_t, std::size_t> found_in;
  GradeReport report;
  std::string faults, idle;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    ModuleGrade& module = report.modules[module_of(places[sample[i].node])];
    ++module.faults;
    const std::uint64_t first = grade.first_cycle[i];
    const bool found = first != FunctionalGrade::kUndetected;
    module.detected += verdicts[i] == FaultClass::DS ? 1 : 0;
    if (found) ++found_in[std::prev(pieces.upper_bound(first))->first];
    const std::string reason =
        verdicts[i] == FaultClass::DS ? "" : hidden_by(reasons, view.circuit, sample[i], moving);
    if (!reason.empty()) {
      ++report.hidden;
      ++module.hidden;
      ++report.reasons[reason].second;
    }
    faults +=
        fmt::format("{}{} stuck-at-{} {}{} at {}{}\n", view.circuit.name(sample[i].node),
                    sample[i].pin == kStem ? "" : fmt::format(" input {}", sample[i].pin),
                    sample[i].stuck ? 1 : 0, to_string(verdicts[i]), found ? fmt::format(" {}", first) : "",
                    places[sample[i].node], reason.empty() ? "" : ": " + reason);
  }
  for (const std::size_t site : grade.toggle.idle) {
    const Node node = sites[site].node;
    ++report.modules[module_of(places[node])].outputs;
    const std::string& reason = reasons[node].still;
    idle += fmt::format("{} does not toggle at {}{}\n", sites[site].name, places[node],
                        reason.empty() ? "" : ": " + reason);
    if (reason.empty()) continue;
    ++report.unreached;
    ++report.reasons[reason].first;
    ++report.modules[module_of(places[node])].unreached;
  }
  for (const Node node : grade.toggle.moving) {
    ModuleGrade& module = report.modules[module_of(places[node])];
    ++module.outputs;
    ++module.toggled;
  }
  for (const auto& [name, m] : report.modules)
    report.text += fmt::format(
        "module {}: {} of {} faults ({:.1f} %), {} cannot; {} of {} outputs toggle ({:.1f} %), {} cannot\n",
        name, m.detected, m.faults, percent(m.detected, m.faults), m.hidden, m.toggled, m.outputs,
        percent(m.toggled, m.outputs), m.unreached);
  for (const auto& [cycle, label] : pieces) {
    if (!label.empty() || found_in.count(cycle) != 0)
      report.text +=
          fmt::format("piece \"{}\" from cycle {}: {} faults first\n", label, cycle, found_in[cycle]);
  }
  for (const auto& [reason, count] : report.reasons)
    report.text += fmt::format("reason \"{}\": {} outputs, {} faults\n", reason, count.first, count.second);
  report.text += faults + idle;
  return report;
}

}  // namespace meltstage::app
