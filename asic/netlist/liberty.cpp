// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/liberty.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>

#include "base/error.hpp"

namespace meltstage::dft {

namespace {

using Op = Expression::Op;

bool is_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '[' || c == ']';
}

// Recursive descent over the four levels of Liberty's precedence.
class ExpressionParser {
 public:
  explicit ExpressionParser(std::string_view text) : text_(text) {}

  Expression whole() {
    Expression result = any();
    skip();
    if (at_ != text_.size()) fail("an operator or the end");
    return result;
  }

 private:
  void skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  char peek() {
    skip();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  [[noreturn]] void fail(const char* expected) const {
    throw UserError(fmt::format("function \"{}\", column {}: found \"{}\", expected {}", text_, at_ + 1,
                                at_ < text_.size() ? std::string(1, text_[at_]) : "the end", expected));
  }
  static Expression join(Op op, std::vector<Expression> args) {
    if (args.size() == 1) return std::move(args.front());
    return {op, "", std::move(args)};
  }

  Expression any() {
    std::vector<Expression> args{all()};
    while (peek() == '|' || peek() == '+') {
      ++at_;
      args.push_back(all());
    }
    return join(Op::any, std::move(args));
  }
  Expression all() {
    std::vector<Expression> args{parity()};
    for (;;) {
      const char c = peek();
      if (c == '&' || c == '*')
        ++at_;
      else if (!(c == '!' || c == '(' || is_name(c)))  // a blank is an AND too
        break;
      args.push_back(parity());
    }
    return join(Op::all, std::move(args));
  }
  Expression parity() {
    std::vector<Expression> args{factor()};
    while (peek() == '^') {
      ++at_;
      args.push_back(factor());
    }
    return join(Op::parity, std::move(args));
  }
  Expression factor() {
    Expression result;
    const char c = peek();
    if (c == '!') {
      ++at_;
      return {Op::inv, "", {factor()}};
    }
    if (c == '(') {
      ++at_;
      result = any();
      if (peek() != ')') fail("\")\"");
      ++at_;
    } else if (is_name(c)) {
      const std::size_t begin = at_;
      while (at_ < text_.size() && is_name(text_[at_])) ++at_;
      const std::string name(text_.substr(begin, at_ - begin));
      if (name == "0")
        result.op = Op::zero;
      else if (name == "1")
        result.op = Op::one;
      else
        result = {Op::pin, name, {}};
    } else {
      fail("a pin");
    }
    while (peek() == '\'') {
      ++at_;
      result = {Op::inv, "", {std::move(result)}};
    }
    return result;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

// Liberty's syntax: name (arguments) { ... }, name : value ;, name (arguments) ;
struct Group {
  std::string name;
  std::vector<std::string> args;
  std::map<std::string, std::string> attributes;
  std::vector<Group> groups;
  std::size_t line = 0;

  std::string attribute(const std::string& key) const {
    const auto found = attributes.find(key);
    return found == attributes.end() ? "" : found->second;
  }
};

class GroupParser {
 public:
  GroupParser(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  Group whole() {
    Group top;
    statement(top);
    if (top.groups.size() != 1 || top.groups[0].name != "library")
      fail(1, "no library group", "library (NAME) { ... }");
    return std::move(top.groups[0]);
  }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& found, const std::string& expected) const {
    throw UserError(fmt::format("{}:{}: found {}, expected {}", name_, line, found, expected));
  }
  void skip() {
    while (at_ < text_.size()) {
      if (text_[at_] == '\n') ++line_;
      if (std::isspace(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '\\') {
        ++at_;
      } else if (text_.substr(at_, 2) == "/*") {
        const std::size_t end = text_.find("*/", at_ + 2);
        if (end == std::string_view::npos) fail(line_, "an open comment", "*/");
        for (; at_ < end + 2; ++at_) line_ += text_[at_] == '\n' ? 1 : 0;
      } else if (text_.substr(at_, 2) == "//") {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      } else {
        return;
      }
    }
  }
  char peek() {
    skip();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  void expect(char c) {
    const char found = peek();
    if (found != c)
      fail(line_, found == '\0' ? "the end of the file" : fmt::format("\"{}\"", found),
           fmt::format("\"{}\"", c));
    ++at_;
  }
  std::string value(std::string_view stops) {
    if (peek() == '"') {
      const std::size_t begin = ++at_;
      while (at_ < text_.size() && text_[at_] != '"') line_ += text_[at_++] == '\n' ? 1 : 0;
      if (at_ == text_.size()) fail(line_, "an open string", "\"");
      return std::string(text_.substr(begin, at_++ - begin));
    }
    const std::size_t begin = at_;
    while (at_ < text_.size() && stops.find(text_[at_]) == std::string_view::npos) ++at_;
    std::size_t end = at_;
    while (end > begin && std::isspace(static_cast<unsigned char>(text_[end - 1])) != 0) --end;
    return std::string(text_.substr(begin, end - begin));
  }

  void statement(Group& parent) {
    const std::string name = value(":({;}\n \t\r");
    if (name.empty())
      fail(line_, peek() == '\0' ? "the end of the file" : fmt::format("\"{}\"", peek()), "a name");
    const std::size_t line = line_;
    if (peek() == ':') {
      ++at_;
      parent.attributes[name] = value(";}\n");
      if (peek() == ';') ++at_;
      return;
    }
    expect('(');
    Group group{name, {}, {}, {}, line};
    while (peek() != ')') {
      group.args.push_back(value(",)"));
      if (peek() == ',') ++at_;
      if (peek() == '\0') fail(line, "an open argument list", "\")\"");
    }
    ++at_;
    if (peek() == '{') {
      ++at_;
      while (peek() != '}') {
        if (peek() == '\0') fail(line, "group " + name + " left open", "\"}\"");
        statement(group);
      }
      ++at_;
      if (peek() == ';') ++at_;
      parent.groups.push_back(std::move(group));
    } else if (peek() == ';') {
      ++at_;  // a complex attribute: no use here
    }
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

// What is left of an expression when a pin is 0.
Expression with_pin_at_zero(const Expression& e, const std::string& pin) {
  if (e.op == Op::pin) return e.pin == pin ? Expression{Op::zero, "", {}} : e;
  if (e.op == Op::zero || e.op == Op::one) return e;
  if (e.op == Op::inv) {
    Expression arg = with_pin_at_zero(e.args[0], pin);
    if (arg.op == Op::zero) return {Op::one, "", {}};
    if (arg.op == Op::one) return {Op::zero, "", {}};
    return {Op::inv, "", {std::move(arg)}};
  }
  Expression result{e.op, "", {}};
  for (const Expression& part : e.args) {
    Expression arg = with_pin_at_zero(part, pin);
    if (arg.op == Op::zero && e.op == Op::all) return arg;
    if (arg.op == Op::one && e.op == Op::any) return arg;
    const bool neutral = arg.op == Op::zero || (arg.op == Op::one && e.op == Op::all);
    if (!neutral) result.args.push_back(std::move(arg));
  }
  if (result.args.empty()) return {e.op == Op::all ? Op::one : Op::zero, "", {}};
  return result.args.size() == 1 ? result.args[0] : result;
}

class CellReader {
 public:
  CellReader(const Group& group, const std::string& file) : group_(group), file_(file) {}

  Cell read() {
    Cell cell;
    cell.name = group_.args.empty() ? "" : group_.args[0];
    cell.area = std::strtod(group_.attribute("area").c_str(), nullptr);
    for (const Group& part : group_.groups) {
      if (part.name == "pin") add_pins(cell, part);
      if (part.name == "ff") cell.flop = flop(part);
      if (part.name == "latch" || part.name == "statetable") cell.has_latch = true;
    }
    for (const Group& part : group_.groups) {
      if (part.name == "test_cell") cell.scan = scan(part);
    }
    if (cell.flop && !cell.scan) cell.scan = scan_of_pins(*cell.flop);
    cell.gate = clock_gate();
    if (cell.gate) cell.has_latch = false;
    return cell;
  }

 private:
  Expression expression(const Group& group, const std::string& key) const {
    try {
      return parse_expression(group.attribute(key));
    } catch (const UserError& error) {
      throw UserError(fmt::format("{}:{}: cell {}: {}: {}", file_, group.line,
                                  group_.args.empty() ? "?" : group_.args[0], key, error.what()));
    }
  }
  void add_pins(Cell& cell, const Group& group) const {
    const std::string direction = group.attribute("direction");
    if (direction != "input" && direction != "output") return;
    for (const std::string& name : group.args) {
      CellPin pin{name, direction == "output", std::nullopt};
      if (pin.is_output && group.attributes.count("function") != 0)
        pin.function = expression(group, "function");
      cell.pins.push_back(std::move(pin));
    }
  }
  Flop flop(const Group& group) const {
    Flop flop;
    flop.state = !group.args.empty() ? group.args[0] : "IQ";
    flop.state_n = group.args.size() > 1 ? group.args[1] : "IQN";
    flop.next_state = expression(group, "next_state");
    flop.clocked_on = expression(group, "clocked_on");
    if (group.attributes.count("clear") != 0) flop.clear = expression(group, "clear");
    if (group.attributes.count("preset") != 0) flop.preset = expression(group, "preset");
    return flop;
  }
  std::optional<ScanPins> scan(const Group& test) const {
    ScanPins pins;
    for (const Group& part : test.groups) {
      if (part.name == "ff") pins.next_state = expression(part, "next_state");
      if (part.name != "pin" || part.args.empty()) continue;
      const std::string type = part.attribute("signal_type");
      if (type == "test_scan_in") pins.in = part.args[0];
      if (type == "test_scan_enable" || type == "test_scan_enable_inverted") {
        pins.enable = part.args[0];
        pins.enable_low = type == "test_scan_enable_inverted";
      }
    }
    if (pins.in.empty() || pins.enable.empty()) return std::nullopt;
    return pins;
  }
  // Libraries without test_cell say it at the pins; what is captured is the next state with the enable at 0.
  std::optional<ScanPins> scan_of_pins(const Flop& flop) const {
    ScanPins pins;
    for (const Group& part : group_.groups) {
      if (part.name != "pin" || part.args.empty()) continue;
      const std::string type = part.attribute("nextstate_type");
      if (type == "scan_in") pins.in = part.args[0];
      if (type == "scan_enable") pins.enable = part.args[0];
    }
    if (pins.in.empty() || pins.enable.empty()) return std::nullopt;
    pins.next_state = with_pin_at_zero(flop.next_state, pins.enable);
    return pins;
  }
  std::optional<ClockGate> clock_gate() const {
    static const std::set<std::string> kinds = {"latch_posedge", "latch_posedge_precontrol",
                                                "latch_posedge_postcontrol"};
    if (kinds.count(group_.attribute("clock_gating_integrated_cell")) == 0) return std::nullopt;
    ClockGate gate;
    for (const Group& part : group_.groups) {
      if (part.name != "pin" || part.args.empty()) continue;
      if (part.attribute("clock_gate_clock_pin") == "true") gate.clock = part.args[0];
      if (part.attribute("clock_gate_enable_pin") == "true") gate.enable = part.args[0];
      if (part.attribute("clock_gate_test_pin") == "true") gate.test = part.args[0];
      if (part.attribute("clock_gate_out_pin") == "true") gate.out = part.args[0];
    }
    if (gate.clock.empty() || gate.enable.empty() || gate.out.empty()) return std::nullopt;
    return gate;
  }

  const Group& group_;
  const std::string& file_;
};

}  // namespace

Expression parse_expression(std::string_view text) { return ExpressionParser(text).whole(); }

const CellPin* Cell::find(std::string_view pin) const {
  for (const CellPin& candidate : pins) {
    if (candidate.name == pin) return &candidate;
  }
  return nullptr;
}

CellLibrary parse_liberty(std::string_view text, const std::string& name) {
  const Group library = GroupParser(text, name).whole();
  CellLibrary cells;
  for (const Group& group : library.groups) {
    if (group.name != "cell") continue;
    Cell cell = CellReader(group, name).read();
    cells[cell.name] = std::move(cell);
  }
  if (cells.empty())
    throw UserError(fmt::format("{}: found no cell, expected a Liberty library with cells", name));
  return cells;
}

CellLibrary read_liberty(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw UserError(fmt::format("{}: can't be read; give a Liberty file", path.string()));
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return parse_liberty(text, path.string());
}

}  // namespace meltstage::dft
