// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/liberty.hpp"

#include <fmt/format.h>

#include <cctype>
#include <set>

#include "asic/netlist/liberty_syntax.hpp"
#include "base/error.hpp"
#include "base/file.hpp"

namespace meltstage::dft {

namespace {

using Op = Expression::Op;

bool is_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '[' || c == ']';
}

constexpr std::size_t kMostNested = 100;  // parentheses and inversions

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
    throw UserError(fmt::format("function \"{}\", column {}: found \"{}\", expected {}", shown(text_),
                                at_ + 1, at_ < text_.size() ? shown(text_.substr(at_, 1)) : "the end",
                                expected));
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
    if (c == '!' || c == '(') deeper();
    if (c == '!') {
      ++at_;
      result = {Op::inv, "", {factor()}};
      --depth_;
      return result;
    }
    if (c == '(') {
      ++at_;
      result = any();
      if (peek() != ')') fail("\")\"");
      ++at_;
      --depth_;
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
    const std::size_t depth = depth_;
    for (; peek() == '\''; ++at_) {
      deeper();
      result = Expression{Op::inv, "", {std::move(result)}};
    }
    depth_ = depth;
    return result;
  }
  void deeper() {
    if (depth_ == kMostNested) fail("at most 100 parentheses and inversions in each other");
    ++depth_;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t depth_ = 0;
};

using liberty::Group;

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

void add_names(const Expression& e, std::set<std::string>& names) {
  if (e.op == Op::pin) names.insert(e.pin);
  for (const Expression& arg : e.args) add_names(arg, names);
}

bool same_meaning(const Cell& a, const Cell& b) {
  return !(a.area < b.area) && !(b.area < a.area) && a.pins == b.pins && a.flop == b.flop &&
         a.scan == b.scan && a.gate == b.gate && a.has_latch == b.has_latch &&
         a.defect.empty() == b.defect.empty();
}

class CellReader {
 public:
  CellReader(const Group& group, const std::string& file) : group_(group), file_(file) {}

  Cell read() {
    Cell cell;
    cell.name = group_.label();
    cell.where = fmt::format("{}:{}:{}", file_, group_.place.line, group_.place.column);
    cell.area = group_.number("area", file_);
    for (const Group& part : group_.groups) {
      if (part.name == "pin") add_pins(cell, part);
      if (part.name == "ff") {
        Flop read = flop(part);
        if (cell.flop && *cell.flop != read)
          fail(part.place, fmt::format("ff of cell {} again, other than before", shown(cell.name)),
               "it once");
        cell.flop = std::move(read);
      }
      if (part.name == "latch" || part.name == "statetable") cell.has_latch = true;
    }
    for (const Group& part : group_.groups) {
      if (part.name == "test_cell") cell.scan = scan(part);
    }
    if (cell.flop && !cell.scan) cell.scan = scan_of_pins(*cell.flop);
    cell.gate = clock_gate();
    if (cell.gate) cell.has_latch = false;
    cell.defect = defect(cell);
    return cell;
  }

 private:
  [[noreturn]] void fail(Place place, const std::string& found, const std::string& expected) const {
    throw UserError(defect_at(file_, place, found, expected));
  }
  std::string text(const Group& group, std::string_view key) const {
    const liberty::Attribute* const found = group.only(key, file_);
    return found == nullptr || found->values.empty() ? "" : found->values[0];
  }
  // What keeps the cell from being used, of all that it is made of.
  std::string defect(const Cell& cell) const {
    std::set<std::string> known;
    for (const CellPin& pin : cell.pins) known.insert(pin.name);
    if (cell.flop) known.insert({cell.flop->state, cell.flop->state_n});
    const auto unknown = [&](const Group& group, const char* key, const std::string& of,
                             const std::optional<Expression>& e) -> std::string {
      if (!e) return "";
      std::set<std::string> names;
      add_names(*e, names);
      for (const std::string& name : names) {
        if (known.count(name) == 0)
          return defect_at(file_, group.find(key)->place,
                           fmt::format("{} in the {} of {}", shown(name), key, shown(of)),
                           "pins of the cell and its state");
      }
      return "";
    };
    for (const Group& part : group_.groups) {
      std::string found;
      if (part.name == "pin" && !part.arguments.empty()) {
        const std::string of = cell.name + "/" + part.arguments[0];
        if (!text(part, "three_state").empty())
          return defect_at(file_, part.find("three_state")->place, "three_state of " + shown(of),
                           "cells that always drive their outputs");
        const CellPin* const pin = cell.find(part.arguments[0]);
        if (pin != nullptr && !cell.gate && !cell.has_latch)
          found = unknown(part, "function", of, pin->function);
      } else if (part.name == "ff") {
        const Flop& flop = *cell.flop;
        for (const auto& [key, e] : {std::pair("next_state", std::optional(flop.next_state)),
                                     std::pair("clocked_on", std::optional(flop.clocked_on)),
                                     std::pair("clear", flop.clear), std::pair("preset", flop.preset)}) {
          if (found.empty()) found = unknown(part, key, cell.name, e);
        }
        const Expression& clock = flop.clocked_on;
        if (found.empty() && !is_pin_or_inverse(clock))
          found = defect_at(file_, part.find("clocked_on")->place, "clocked_on of " + shown(cell.name),
                            "one pin, or its inverse");
      }
      if (!found.empty()) return found;
    }
    return "";
  }
  Expression expression(const Group& group, const std::string& key) const {
    const std::string said = text(group, key);
    try {
      return parse_expression(said);
    } catch (const UserError& error) {
      const liberty::Attribute* const attribute = group.find(key);
      const Place place = attribute == nullptr ? group.place : attribute->place;
      throw UserError(fmt::format("{}:{}:{}: cell {}: {}: {}", file_, place.line, place.column,
                                  shown(group_.label()), key, error.what()));
    }
  }
  // A pin may be said in pieces, but none of them may say another thing.
  void require_once(const Group& group) {
    for (const std::string& name : group.arguments) {
      const auto [first, is_new] = pins_.emplace(name, &group);
      if (is_new) continue;
      for (const char* key : {"direction", "function", "three_state"}) {
        if (text(*first->second, key) != text(group, key))
          fail(group.place,
               fmt::format("pin {} of cell {} again, with another {} than in line {}", shown(name),
                           shown(group_.label()), key, first->second->place.line),
               "it once");
      }
    }
  }
  void add_pins(Cell& cell, const Group& group) {
    const std::string direction = text(group, "direction");
    static const std::set<std::string> kinds = {"", "input", "output", "inout", "internal"};
    if (kinds.count(direction) == 0)
      fail(group.find("direction")->place, fmt::format("direction \"{}\"", shown(direction)),
           "input, output, inout or internal");
    require_once(group);
    if (direction != "input" && direction != "output") return;
    for (const std::string& name : group.arguments) {
      if (cell.find(name) != nullptr) continue;
      CellPin pin{name, direction == "output", std::nullopt};
      if (pin.is_output && group.find("function") != nullptr) pin.function = expression(group, "function");
      cell.pins.push_back(std::move(pin));
    }
  }
  Flop flop(const Group& group) const {
    Flop flop;
    flop.state = !group.arguments.empty() ? group.arguments[0] : "IQ";
    flop.state_n = group.arguments.size() > 1 ? group.arguments[1] : "IQN";
    flop.next_state = expression(group, "next_state");
    flop.clocked_on = expression(group, "clocked_on");
    if (group.find("clear") != nullptr) flop.clear = expression(group, "clear");
    if (group.find("preset") != nullptr) flop.preset = expression(group, "preset");
    for (const auto& [key, state] : {std::pair("clear_preset_var1", &flop.state_of_both),
                                     std::pair("clear_preset_var2", &flop.state_n_of_both)}) {
      const std::string said = text(group, key);
      if (said.empty()) continue;
      if (said.size() != 1 || std::string_view("LHNTX").find(said[0]) == std::string_view::npos)
        fail(group.find(key)->place, fmt::format("{} {}", key, shown(said)), "L, H, N, T or X");
      *state = said[0];
    }
    return flop;
  }
  std::optional<ScanPins> scan(const Group& test) const {
    ScanPins pins;
    for (const Group& part : test.groups) {
      if (part.name == "ff") pins.next_state = expression(part, "next_state");
      if (part.name != "pin" || part.arguments.empty()) continue;
      const std::string type = text(part, "signal_type");
      if (type == "test_scan_in") pins.in = part.arguments[0];
      if (type == "test_scan_enable" || type == "test_scan_enable_inverted") {
        pins.enable = part.arguments[0];
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
      if (part.name != "pin" || part.arguments.empty()) continue;
      const std::string type = text(part, "nextstate_type");
      if (type == "scan_in") pins.in = part.arguments[0];
      if (type == "scan_enable") pins.enable = part.arguments[0];
    }
    if (pins.in.empty() || pins.enable.empty()) return std::nullopt;
    pins.next_state = with_pin_at_zero(flop.next_state, pins.enable);
    return pins;
  }
  std::optional<ClockGate> clock_gate() const {
    static const std::set<std::string> kinds = {"latch_posedge", "latch_posedge_precontrol",
                                                "latch_posedge_postcontrol"};
    if (kinds.count(text(group_, "clock_gating_integrated_cell")) == 0) return std::nullopt;
    ClockGate gate;
    for (const Group& part : group_.groups) {
      if (part.name != "pin" || part.arguments.empty()) continue;
      if (text(part, "clock_gate_clock_pin") == "true") gate.clock = part.arguments[0];
      if (text(part, "clock_gate_enable_pin") == "true") gate.enable = part.arguments[0];
      if (text(part, "clock_gate_test_pin") == "true") gate.test = part.arguments[0];
      if (text(part, "clock_gate_out_pin") == "true") gate.out = part.arguments[0];
      // The clock while the latch is open, "CLK * IQ"; where something is inverted it is another gate.
      if (text(part, "state_function").find_first_of("!'") != std::string::npos) return std::nullopt;
    }
    if (gate.clock.empty() || gate.enable.empty() || gate.out.empty()) return std::nullopt;
    return gate;
  }

  const Group& group_;
  const std::string& file_;
  std::map<std::string, const Group*> pins_;  // the first of each name
};

}  // namespace

bool is_pin_or_inverse(const Expression& e) {
  return e.op == Op::pin || (e.op == Op::inv && e.args[0].op == Op::pin);
}

Expression parse_expression(std::string_view text) { return ExpressionParser(text).whole(); }

const CellPin* Cell::find(std::string_view pin) const {
  for (const CellPin& candidate : pins) {
    if (candidate.name == pin) return &candidate;
  }
  return nullptr;
}

CellLibrary parse_liberty(std::string_view text, const std::string& name) {
  const Group library = liberty::parse(text, name);
  CellLibrary cells;
  for (const Group& group : library.groups) {
    if (group.name != "cell") continue;
    const Cell cell = CellReader(group, name).read();
    const auto [first, is_new] = cells.emplace(cell.name, cell);
    if (!is_new && !same_meaning(first->second, cell))
      throw UserError(
          defect_at(name, group.place,
                    fmt::format("cell {} again, other than {}", shown(cell.name), first->second.where),
                    "each cell once"));
  }
  if (cells.empty())
    throw UserError(fmt::format("{}: found no cell, expected a Liberty library with cells", name));
  return cells;
}

CellLibrary read_liberty(const std::filesystem::path& path) {
  return parse_liberty(read_file(path, "a Liberty file"), path.string());
}

}  // namespace meltstage::dft
