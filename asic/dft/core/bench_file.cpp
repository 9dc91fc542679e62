// SPDX-License-Identifier: Apache-2.0
// .bench: the netlist format of ISCAS-85, ISCAS-89 and ITC'99.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <unordered_map>

#include "asic/netlist/netlist.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

namespace {

struct Statement {
  std::size_t line = 0;
  std::string result;  // empty: INPUT or OUTPUT
  std::string function;
  std::vector<std::string> args;
};

// "a = NAND(b, c)" or "INPUT(a)"; blank and comment lines give false.
bool parse(const std::string& text, const std::string& where, Statement& statement) {
  std::string line = text.substr(0, text.find('#'));
  line.erase(std::remove_if(line.begin(), line.end(), [](unsigned char c) { return std::isspace(c) != 0; }),
             line.end());
  if (line.empty()) return false;
  const std::size_t open = line.find('('), close = line.rfind(')'), equals = line.find('=');
  if (open == std::string::npos || close == std::string::npos || close < open)
    throw UserError(fmt::format("{}: found \"{}\", expected NAME = GATE(INPUTS), INPUT(NAME) or OUTPUT(NAME)",
                                where, text));
  const std::size_t begin = equals == std::string::npos || equals > open ? 0 : equals + 1;
  statement.result = begin == 0 ? "" : line.substr(0, equals);
  statement.function = line.substr(begin, open - begin);
  std::transform(statement.function.begin(), statement.function.end(), statement.function.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  statement.args.clear();
  for (std::size_t at = open + 1; at < close;) {
    const std::size_t end = std::min(line.find(',', at), close);
    statement.args.push_back(line.substr(at, end - at));
    at = end + 1;
  }
  return true;
}

struct GateName {
  Gate gate;
  std::size_t least, most;
};

const std::map<std::string, GateName>& gate_names() {
  constexpr std::size_t any = 1000;
  static const std::map<std::string, GateName> names = {
      {"BUF", {Gate::buf, 1, 1}},     {"BUFF", {Gate::buf, 1, 1}},   {"NOT", {Gate::inv, 1, 1}},
      {"INV", {Gate::inv, 1, 1}},     {"AND", {Gate::all, 1, any}},  {"NAND", {Gate::nall, 1, any}},
      {"OR", {Gate::any, 1, any}},    {"NOR", {Gate::none, 1, any}}, {"XOR", {Gate::parity, 1, any}},
      {"XNOR", {Gate::same, 1, any}}, {"MUX", {Gate::mux, 3, 3}},    {"CONST0", {Gate::tie0, 0, 0}},
      {"CONST1", {Gate::tie1, 0, 0}}, {"GND", {Gate::tie0, 0, 0}},   {"VDD", {Gate::tie1, 0, 0}},
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

}  // namespace

Circuit read_bench(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::ifstream stream(path);
  if (!stream) throw UserError(fmt::format("{}: can't be read; give a .bench netlist", file));
  CircuitBuilder builder;
  std::unordered_map<std::string, Node> nodes;
  std::vector<std::pair<std::string, std::size_t>> ports_out, captures;
  std::vector<std::pair<Node, Statement>> gates;
  std::vector<std::pair<std::string, std::size_t>> states;
  std::string text;
  const auto define = [&](const std::string& name, Node node, const std::string& where) {
    if (!nodes.emplace(name, node).second)
      throw UserError(fmt::format("{}: found a second driver of {}, expected one", where, name));
  };
  for (std::size_t number = 1; std::getline(stream, text); ++number) {
    Statement statement;
    const std::string where = fmt::format("{}:{}", file, number);
    if (!parse(text, where, statement)) continue;
    statement.line = number;
    const std::size_t inputs = statement.args.size();
    if (statement.result.empty()) {
      if (inputs != 1 || (statement.function != "INPUT" && statement.function != "OUTPUT"))
        throw UserError(fmt::format("{}: found \"{}\", expected INPUT(NAME) or OUTPUT(NAME)", where, text));
      if (statement.function == "INPUT")
        define(statement.args[0], builder.add(Gate::input, {}, statement.args[0]), where);
      else
        ports_out.emplace_back(statement.args[0], number);
      continue;
    }
    if (statement.function == "DFF") {
      if (inputs != 1) throw UserError(fmt::format("{}: found {} inputs of DFF, expected 1", where, inputs));
      states.emplace_back(statement.result, number);
      captures.emplace_back(statement.args[0], number);
      continue;
    }
    const auto known = gate_names().find(statement.function);
    if (known == gate_names().end())
      throw UserError(fmt::format("{}: found gate \"{}\", expected AND NAND OR NOR XOR XNOR NOT BUF MUX DFF",
                                  where, statement.function));
    if (inputs < known->second.least || inputs > known->second.most)
      throw UserError(fmt::format(
          "{}: found {} inputs of {}, expected {}", where, inputs, statement.function,
          known->second.least == known->second.most ? std::to_string(known->second.least) : "one or more"));
    const Node node = builder.add(narrow(known->second.gate, inputs), {}, statement.result);
    define(statement.result, node, where);
    gates.emplace_back(node, std::move(statement));
  }
  for (const auto& [name, line] : states)
    define(name, builder.add(Gate::input, {}, name), fmt::format("{}:{}", file, line));
  const auto driver = [&](const std::string& name, std::size_t line) {
    const auto found = nodes.find(name);
    if (found == nodes.end())
      throw UserError(fmt::format("{}:{}: found no driver of {}, expected one", file, line, name));
    return found->second;
  };
  std::vector<std::size_t> uses(builder.size(), 0);
  for (auto& [node, statement] : gates) {
    std::vector<Node> fanin;
    for (const std::string& arg : statement.args) fanin.push_back(driver(arg, statement.line));
    for (const Node source : fanin) ++uses[source];
    builder.set_fanin(node, std::move(fanin));
  }
  for (const auto* list : {&ports_out, &captures}) {
    for (const auto& [name, line] : *list) {
      const Node source = driver(name, line);
      ++uses[source];
      builder.add(Gate::output, {source}, name);
    }
  }
  const std::size_t lines = uses.size();
  for (Node node = 0; node < builder.size(); ++node) {
    for (std::size_t pin = 0; pin < builder.fanin(node).size(); ++pin) {
      const Node source = builder.fanin(node)[pin];
      if (uses[source] > 1)
        builder.add_site({builder.name(source) + "->" + builder.name(node),
                          node,
                          static_cast<std::int32_t>(pin),
                          {false, false}});
    }
    if (node < lines) builder.add_site({builder.name(node), node, kStem, {false, false}});
  }
  return builder.finish(file);
}

}  // namespace meltstage::dft
