// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/bench_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "asic/dft/core/cycles.hpp"
#include "base/byte_order_mark.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

namespace {

struct Statement {
  Place place;
  std::string result;  // empty: INPUT or OUTPUT
  std::string function;
  std::vector<std::string> args;
};

bool has_blank_within_name(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r\v\f", kMarks = "(),=";
  for (auto at = line.find_first_of(kBlanks); at != std::string_view::npos;) {
    const auto end = line.find_first_not_of(kBlanks, at);
    if (end == std::string_view::npos) return false;
    if (at > 0 && kMarks.find(line[at - 1]) == std::string_view::npos &&
        kMarks.find(line[end]) == std::string_view::npos)
      return true;
    at = line.find_first_of(kBlanks, end);
  }
  return false;
}

// "a = NAND(b, c)" or "INPUT(a)"; nothing for blank and comment lines.
std::optional<Statement> parse(std::string_view text, const std::string& file, std::size_t number) {
  Statement statement;
  statement.place.line = number;
  std::string line(text.substr(0, text.find('#')));
  const auto is_blank = [](unsigned char c) { return std::isspace(c) != 0; };
  const auto first = std::find_if_not(line.begin(), line.end(), is_blank);
  statement.place.column = static_cast<std::size_t>(first - line.begin()) + 1;
  if (first == line.end()) return std::nullopt;
  const auto refuse = [&](std::string_view found, std::string_view expected) {
    throw UserError(defect_at(file, statement.place, fmt::format("{} in \"{}\"", found, shown(text)),
                              std::string(expected)));
  };
  // Behind "=" ABC writes a look-up table as two words.
  const std::string inputs = line.substr(std::min(line.find('('), line.size())),
                    before = line.substr(0, line.find('='));
  line.erase(std::remove_if(line.begin(), line.end(), is_blank), line.end());
  for (const std::string_view constant : {"=vdd", "=gnd"})  // as ABC writes them
    if (line.ends_with(constant)) line += "()";
  const std::size_t open = line.find('('), close = line.rfind(')'), equals = line.find('=');
  if (open == std::string::npos || close == std::string::npos || close < open || close + 1 != line.size())
    throw UserError(defect_at(file, statement.place, fmt::format("\"{}\"", shown(text)),
                              "NAME = GATE(INPUTS), INPUT(NAME) or OUTPUT(NAME)"));
  if (has_blank_within_name(inputs) || (equals < open && has_blank_within_name(before)))
    refuse("a blank within a name", "a comma between two names");
  const std::size_t begin = equals == std::string::npos || equals > open ? 0 : equals + 1;
  statement.result = begin == 0 ? "" : line.substr(0, equals);
  statement.function = line.substr(begin, open - begin);
  std::transform(statement.function.begin(), statement.function.end(), statement.function.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  for (std::size_t at = open + 1; close > open + 1 && at <= close;) {
    const std::size_t end = std::min(line.find(',', at), close);
    if (end == at) refuse("an input without a name", "a name between the commas");
    if (line.substr(at, end - at).find_first_of("()") != std::string::npos)
      refuse("more than one gate", "one a line");
    statement.args.push_back(line.substr(at, end - at));
    at = end + 1;
  }
  return statement;
}

struct GateName {
  Gate gate;
  std::size_t least, most;
};

const std::map<std::string, GateName>& gate_names() {
  constexpr std::size_t kAny = 1000;
  static const std::map<std::string, GateName> names = {
      {"BUF", {Gate::buf, 1, 1}},      {"BUFF", {Gate::buf, 1, 1}},    {"NOT", {Gate::inv, 1, 1}},
      {"INV", {Gate::inv, 1, 1}},      {"AND", {Gate::all, 1, kAny}},  {"NAND", {Gate::nall, 1, kAny}},
      {"OR", {Gate::any, 1, kAny}},    {"NOR", {Gate::none, 1, kAny}}, {"XOR", {Gate::parity, 1, kAny}},
      {"XNOR", {Gate::same, 1, kAny}}, {"MUX", {Gate::mux, 3, 3}},     {"CONST0", {Gate::tie0, 0, 0}},
      {"CONST1", {Gate::tie1, 0, 0}},  {"GND", {Gate::tie0, 0, 0}},    {"VDD", {Gate::tie1, 0, 0}},
  };
  return names;
}

// One-input forms of the wide gates.
Gate narrow(Gate gate, std::size_t inputs) {
  if (inputs != 1) return gate;
  if (gate == Gate::all || gate == Gate::any || gate == Gate::parity) return Gate::buf;
  if (gate == Gate::nall || gate == Gate::none || gate == Gate::same) return Gate::inv;
  return gate;
}

// A line may reach one gate at several inputs: the second of these ends has .2 behind its name.
class SiteNames {
 public:
  explicit SiteNames(const std::unordered_map<std::string, Node>& lines) : lines_(lines) {}
  std::string fresh(const std::string& name) {
    std::string unused = name;
    for (std::size_t end = 2; lines_.count(unused) != 0 || !taken_.insert(unused).second; ++end)
      unused = fmt::format("{}.{}", name, end);
    return unused;
  }

 private:
  const std::unordered_map<std::string, Node>& lines_;
  std::unordered_set<std::string> taken_;
};

}  // namespace

Circuit read_bench(const std::filesystem::path& path) {
  return parse_bench(read_file(path, "a .bench netlist"), path.string());
}

Circuit parse_bench(std::string_view text, const std::string& name) {
  const auto fail = [&](Place place, const std::string& found, const std::string& expected) {
    throw UserError(defect_at(name, place, found, expected));
  };
  CircuitBuilder builder;
  std::unordered_map<std::string, Node> nodes;
  std::vector<std::pair<std::string, Place>> ports_out, captures, states;
  std::vector<std::pair<Node, Statement>> gates;
  const auto define = [&](const std::string& line, Node node, Place place) {
    if (line.empty()) fail(place, "a line without a name", "one before \"=\" and in parentheses");
    if (!is_plain_name(line))
      fail(place, fmt::format("line \"{}\"", shown(line)), "a name without blanks, quotes, \\, % and `");
    if (!nodes.emplace(line, node).second) fail(place, "a second driver of " + shown(line), "one");
  };
  text = without_byte_order_mark(text);
  std::size_t number = 0;
  while (!text.empty()) {
    const std::string_view row = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), row.size() + 1));
    std::optional<Statement> read = parse(row, name, ++number);
    if (!read) continue;
    Statement& statement = *read;
    const std::size_t inputs = statement.args.size();
    if (statement.result.empty()) {
      if (inputs != 1 || (statement.function != "INPUT" && statement.function != "OUTPUT"))
        fail(statement.place, fmt::format("\"{}\"", shown(row)), "INPUT(NAME) or OUTPUT(NAME)");
      if (statement.function == "INPUT")
        define(statement.args[0], builder.add(Gate::input, {}, statement.args[0]), statement.place);
      else
        ports_out.emplace_back(statement.args[0], statement.place);
      continue;
    }
    if (statement.function == "DFF") {
      if (inputs != 1) fail(statement.place, fmt::format("{} inputs of DFF", inputs), "1");
      states.emplace_back(statement.result, statement.place);
      captures.emplace_back(statement.args[0], statement.place);
      continue;
    }
    if (statement.function.starts_with("LUT0X"))
      fail(statement.place, "a look-up table (LUT)", "gates; ABC writes them by write_bench -l");
    const auto known = gate_names().find(statement.function);
    if (known == gate_names().end())
      fail(statement.place, fmt::format("gate \"{}\"", shown(statement.function)),
           "AND NAND OR NOR XOR XNOR NOT BUF MUX DFF");
    const auto [gate, least, most] = known->second;
    if (inputs < least || inputs > most)
      fail(statement.place, fmt::format("{} inputs of {}", inputs, statement.function),
           least == most ? std::to_string(least) : fmt::format("{} to {}", least, most));
    const Node node = builder.add(narrow(gate, inputs), {}, statement.result);
    define(statement.result, node, statement.place);
    gates.emplace_back(node, std::move(statement));
  }
  for (const auto& [line, place] : states) define(line, builder.add(Gate::input, {}, line), place);
  if (ports_out.empty() && captures.empty())
    throw UserError(fmt::format("{}: found no OUTPUT and no DFF, expected a .bench netlist with one", name));
  const auto driver = [&](const std::string& line, Place place) {
    const auto found = nodes.find(line);
    if (found == nodes.end()) fail(place, "no driver of " + shown(line), "one");
    return found->second;
  };
  std::vector<std::size_t> uses(builder.size(), 0);
  for (auto& [node, statement] : gates) {
    std::vector<Node> fanin;
    for (const std::string& arg : statement.args) fanin.push_back(driver(arg, statement.place));
    for (const Node source : fanin) ++uses[source];
    // MUX(s, a, b) has the select first, as those who write it have it; Gate::mux has it last.
    if (statement.function == "MUX") std::rotate(fanin.begin(), fanin.begin() + 1, fanin.end());
    builder.set_fanin(node, std::move(fanin));
  }
  for (const auto* list : {&ports_out, &captures}) {
    for (const auto& [line, place] : *list) {
      const Node source = driver(line, place);
      ++uses[source];
      builder.add(Gate::output, {source}, line);
    }
  }
  const std::size_t lines = uses.size();
  SiteNames names(nodes);
  for (Node node = 0; node < builder.size(); ++node) {
    const bool of_flop = node >= lines + ports_out.size();
    const std::string& reader = of_flop ? states[node - lines - ports_out.size()].first : builder.name(node);
    const std::size_t pins = builder.fanin(node).size();
    for (std::size_t place = 0; place < pins; ++place) {  // as the file has them
      const std::size_t pin = builder.kind(node) == Gate::mux ? (place + pins - 1) % pins : place;
      const Node source = builder.fanin(node)[pin];
      if (uses[source] > 1)
        builder.add_site(
            {names.fresh(builder.name(source) + "->" + reader), node, static_cast<std::int32_t>(pin)});
    }
    if (node < lines) builder.add_site({builder.name(node), node, kStem});
  }
  return builder.finish(name);
}

}  // namespace meltstage::dft
