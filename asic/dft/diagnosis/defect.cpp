// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/diagnosis/defect.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::dft {
namespace {

constexpr const char* kNames[] = {"stuck-at-0",   "stuck-at-1", "slow-to-rise", "slow-to-fall",
                                  "dominated-by", "wired-and",  "wired-or"};

Line line_of(const Circuit& circuit, std::string_view name, std::string_view whole) {
  const auto& sites = circuit.sites();
  const auto site = std::find_if(sites.begin(), sites.end(), [&](const Site& s) { return s.name == name; });
  if (site == sites.end())
    throw UserError(fmt::format("defect \"{}\": found {}, expected a pin of a cell (CELL/PIN) or a port",
                                shown(whole), shown(name)));
  if (site->node == kNoNode)
    throw UserError(fmt::format("defect \"{}\": found {}, expected a pin that carries data, not a clock",
                                shown(whole), shown(name)));
  return {site->node, site->pin};
}

std::string line_name(const Circuit& circuit, const Line& line) {
  for (const Site& site : circuit.sites())
    if (site.node == line.node && site.pin == line.pin) return site.name;
  return circuit.name(line.node);
}

}  // namespace

const char* to_string(DefectKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

bool is_bridge(DefectKind kind) { return kind >= DefectKind::dominated_by; }

Node source_of(const Circuit& circuit, const Line& line) {
  return line.pin == kStem ? line.node : circuit.fanin(line.node)[static_cast<std::size_t>(line.pin)];
}

Line stem_of(const Circuit& circuit, const Line& line) {
  const Node source = source_of(circuit, line);
  return circuit.fanout(source).size() == 1 ? Line{source, kStem} : line;
}

std::vector<bool> cone_of(const Circuit& circuit, Node node) {
  std::vector<bool> cone(circuit.size(), false);
  cone[node] = true;
  for (Node at = node + 1; at-- > 0;) {
    if (!cone[at]) continue;
    for (const Node driver : circuit.fanin(at)) cone[driver] = true;
  }
  return cone;
}

std::vector<bool> reached_from(const Circuit& circuit, Node node) {
  std::vector<bool> reached(circuit.size(), false);
  reached[node] = true;
  for (Node at = node; at < circuit.size(); ++at) {
    if (!reached[at]) continue;
    for (const Node next : circuit.fanout(at)) reached[next] = true;
  }
  return reached;
}

bool leads_to(const Circuit& circuit, Node from, Node to) { return reached_from(circuit, from)[to]; }

ChipDefect parse_defect(const Circuit& circuit, std::string_view text) {
  const auto blank = text.find(' ');
  const std::string_view rest = blank == std::string_view::npos ? "" : text.substr(blank + 1);
  const auto second = rest.find(' ');
  const auto kind = std::find(std::begin(kNames), std::end(kNames), rest.substr(0, second));
  if (kind == std::end(kNames))
    throw UserError(
        fmt::format("defect \"{}\": expected CELL/PIN and one of {}", shown(text), fmt::join(kNames, ", ")));
  ChipDefect defect{static_cast<DefectKind>(kind - std::begin(kNames)),
                    line_of(circuit, text.substr(0, blank), text)};
  if (is_bridge(defect.kind) != (second != std::string_view::npos))
    throw UserError(
        fmt::format("defect \"{}\": expected {}", shown(text),
                    is_bridge(defect.kind) ? "the bridge's other pin behind it" : "nothing behind the kind"));
  if (!is_bridge(defect.kind)) return defect;
  defect.line = {source_of(circuit, defect.line), kStem};
  defect.other = {source_of(circuit, line_of(circuit, rest.substr(second + 1), text)), kStem};
  const Node a = defect.line.node, b = defect.other.node;
  if (a == b || leads_to(circuit, a, b) || leads_to(circuit, b, a))
    throw UserError(fmt::format(
        "defect \"{}\": found lines of which one drives the other, expected two that do not: such a bridge "
        "holds a state or swings",
        shown(text)));
  return defect;
}

std::string defect_name(const Circuit& circuit, const ChipDefect& defect) {
  std::string name = line_name(circuit, defect.line) + ' ' + to_string(defect.kind);
  if (is_bridge(defect.kind)) name += ' ' + line_name(circuit, defect.other);
  return name;
}

}  // namespace meltstage::dft
