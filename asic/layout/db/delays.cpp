// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/delays.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>

#include "asic/layout/db/tokens.hpp"
#include "base/error.hpp"

namespace meltstage::layout {

namespace {

/// `name (arguments) { ... }`, `name (arguments);` or `name : value;`.
struct Statement {
  std::string name;
  std::string value;  ///< of an attribute; arguments of the others
  std::vector<Statement> inner;

  const Statement* find(std::string_view key) const {
    for (const Statement& s : inner) {
      if (s.name == key) return &s;
    }
    return nullptr;
  }
  std::string text(std::string_view key) const {
    const Statement* s = find(key);
    return s == nullptr ? "" : s->value;
  }
  double number(std::string_view key) const { return std::strtod(text(key).c_str(), nullptr); }
};

class LibertyReader {
 public:
  LibertyReader(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  Statement read() {
    Statement top = statement();
    if (top.name != "library") fail("library (NAME) { ... }");
    return top;
  }

 private:
  [[noreturn]] void fail(std::string_view expected) const {
    const auto line =
        1 + std::count(text_.begin(),
                       text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size())), '\n');
    throw UserError(fmt::format("{}:{}: found {}, expected {}", name_, line,
                                at_ < text_.size() ? fmt::format("\"{}\"", text_[at_]) : "the file's end",
                                expected));
  }
  char peek() {
    while (at_ < text_.size()) {
      if (std::isspace(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '\\') {
        ++at_;
      } else if (text_.substr(at_, 2) == "/*") {
        at_ = std::min(text_.size(), text_.find("*/", at_ + 2));
        if (at_ == text_.size()) fail("*/");
        at_ += 2;
      } else if (text_.substr(at_, 2) == "//") {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      } else {
        return text_[at_];
      }
    }
    return '\0';
  }
  bool take(char c) {
    if (peek() != c) return false;
    ++at_;
    return true;
  }

  std::string word() {
    peek();
    const std::size_t begin = at_;
    while (at_ < text_.size() &&
           (std::isalnum(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '_'))
      ++at_;
    if (at_ == begin) fail("a name");
    return std::string(text_.substr(begin, at_ - begin));
  }

  /// Up to one of the stops, quotes and line ends of quoted lists taken out.
  std::string value(std::string_view stops) {
    std::string found;
    bool is_quoted = false;
    peek();
    while (at_ < text_.size() && (is_quoted || stops.find(text_[at_]) == std::string_view::npos)) {
      const char c = text_[at_++];
      if (c == '"')
        is_quoted = !is_quoted;
      else if (c != '\\')
        found += c;
    }
    if (at_ == text_.size()) fail(fmt::format("one of {}", stops));
    while (!found.empty() && std::isspace(static_cast<unsigned char>(found.back())) != 0) found.pop_back();
    return found;
  }

  Statement statement() {
    Statement s{word(), "", {}};
    if (take(':')) {
      s.value = value(";}\n");
      take(';');
      return s;
    }
    if (!take('(')) fail("\":\" or \"(\"");
    s.value = value(")");
    ++at_;
    if (take('{')) {
      while (!take('}')) s.inner.push_back(statement());
    }
    take(';');
    return s;
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
};

std::vector<double> numbers(const std::string& list) {
  std::vector<double> values;
  const char* at = list.c_str();
  while (*at != '\0') {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    if (end == at)
      ++at;
    else
      values.push_back(value), at = end;
  }
  return values;
}

DelayTable table_of(const Statement& library, const Statement& table) {
  const Statement* shape = nullptr;
  for (const Statement& s : library.inner) {
    if (s.name == "lu_table_template" && s.value == table.value) shape = &s;
  }
  const auto index = [&](const char* key) {
    const std::string own = table.text(key);
    return numbers(own.empty() && shape != nullptr ? shape->text(key) : own);
  };
  DelayTable result{index("index_1"), index("index_2"), numbers(table.text("values"))};
  const bool is_by_load_first =
      shape != nullptr && shape->text("variable_1") == "total_output_net_capacitance";
  if (is_by_load_first) {
    DelayTable turned{result.loads_pf, result.slews_ns, {}};
    for (std::size_t s = 0; s < turned.slews_ns.size(); ++s) {
      for (std::size_t l = 0; l < turned.loads_pf.size(); ++l)
        turned.values_ns.push_back(result.values_ns.at(l * turned.slews_ns.size() + s));
    }
    return turned;
  }
  return result;
}

DelayPin pin_of(const Statement& library, const Statement& pin) {
  DelayPin result;
  result.capacitance_pf = pin.number("capacitance");
  result.max_capacitance_pf = pin.number("max_capacitance");
  result.is_clock = pin.text("clock") == "true";
  for (const Statement& timing : pin.inner) {
    // an arc of one edge alone is that of an asynchronous set or reset
    const std::array<const Statement*, 4> tables{timing.find("cell_rise"), timing.find("rise_transition"),
                                                 timing.find("cell_fall"), timing.find("fall_transition")};
    if (timing.name != "timing" || std::count(tables.begin(), tables.end(), nullptr) > 0) continue;
    const std::string sense = timing.text("timing_sense");
    const DelayArc arc{timing.text("related_pin"),
                       table_of(library, *tables[0]),
                       table_of(library, *tables[1]),
                       table_of(library, *tables[2]),
                       table_of(library, *tables[3]),
                       sense == "positive_unate"   ? Unateness::positive
                       : sense == "negative_unate" ? Unateness::negative
                                                   : Unateness::none};
    const auto is_full = [](const DelayTable& t) {
      return !t.slews_ns.empty() && !t.loads_pf.empty() &&
             t.values_ns.size() == t.slews_ns.size() * t.loads_pf.size();
    };
    if (is_full(arc.delay) && is_full(arc.slew) && is_full(arc.fall_delay) && is_full(arc.fall_slew))
      result.arcs.push_back(arc);
  }
  return result;
}

/// The interval of an axis for a value, and how far into it the value lies.
std::pair<std::size_t, double> place_on(const std::vector<double>& axis, double value) {
  if (axis.size() < 2) return {0, 0.0};
  std::size_t k = 0;
  while (k + 2 < axis.size() && axis[k + 1] <= value) ++k;
  return {k, (value - axis[k]) / (axis[k + 1] - axis[k])};
}

}  // namespace

double DelayTable::at(double slew_ns, double load_pf) const {
  const auto [s, u] = place_on(slews_ns, slew_ns);
  const auto [l, v] = place_on(loads_pf, load_pf);
  const auto value = [&](std::size_t i, std::size_t j) {
    return values_ns[std::min(i, slews_ns.size() - 1) * loads_pf.size() + std::min(j, loads_pf.size() - 1)];
  };
  return (1 - u) * ((1 - v) * value(s, l) + v * value(s, l + 1)) +
         u * ((1 - v) * value(s + 1, l) + v * value(s + 1, l + 1));
}

Delays parse_delays(std::string_view text, const std::string& name) {
  const Statement library = LibertyReader(text, name).read();
  Delays delays;
  for (const Statement& cell : library.inner) {
    if (cell.name != "cell") continue;
    DelayCell& result = delays[cell.value];
    result.is_flop = cell.find("ff") != nullptr;
    result.is_clock_gate = cell.find("clock_gating_integrated_cell") != nullptr;
    for (const Statement& pin : cell.inner) {
      if (pin.name == "pin") result.pins[pin.value] = pin_of(library, pin);
    }
  }
  if (delays.empty()) throw UserError(fmt::format("{}: found no cell, expected a Liberty library", name));
  return delays;
}

Delays read_delays(const std::filesystem::path& path) {
  return parse_delays(read_text(path, "a Liberty file"), path.string());
}

}  // namespace meltstage::layout
