// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <vector>

#include "asic/dft/files/pattern_files.hpp"
#include "base/byte_order_mark.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

namespace {

// One variable of the dump.
struct Variable {
  std::string name;
  std::size_t where = 0;
  std::optional<bool> input;  // extended VCD: told by its first value
  bool used = true;
  char value = 'x';
  std::size_t signal = 0;  // once the cycles begin
};

struct Change {
  long long ps;
  std::size_t variable;
  char value;  // 0 1 x
  std::size_t where;
};

class DumpReader {
 public:
  DumpReader(std::string_view text, const std::string& name, const TestTiming& timing,
             const Directions& directions)
      : text_(without_byte_order_mark(text)), name_(name), timing_(timing), directions_(directions) {}

  CycleStream read() {
    if (!text_.empty() && text_.back() != '\n')
      fail(text_.size(), "the file's end in the middle of a line", "a line end; it may be cut off");
    read_header();
    read_changes();
    return cycles();
  }

 private:
  [[noreturn]] void fail(std::size_t where, const std::string& found, const std::string& expected) const {
    const Place place = place_of(text_, where);
    throw PatternFileError(defect_at(name_, place, found, expected), place.line);
  }
  // The next word, its place in word_at_; empty at the end.
  std::string_view word() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
    word_at_ = at_;
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) == 0) ++at_;
    return text_.substr(word_at_, at_ - word_at_);
  }
  std::vector<std::string_view> to_end(std::size_t where) {
    std::vector<std::string_view> words;
    for (std::string_view next = word(); next != "$end"; next = word()) {
      if (next.empty()) fail(where, "a block left open", "$end");
      words.push_back(next);
    }
    return words;
  }

  void read_header() {
    for (;;) {
      const std::string_view key = word();
      const std::size_t where = word_at_;
      if (key.empty()) fail(where, "the end of the file", "$enddefinitions");
      if (key[0] != '$') fail(where, fmt::format("\"{}\"", shown(key)), "a declaration with $");
      const std::vector<std::string_view> words = to_end(where);
      if (key == "$enddefinitions") break;
      if (key == "$timescale") set_scale(words, where);
      if (key == "$var") add_variable(words, where);
    }
    if (scale_ps_ == 0) fail(word_at_, "no $timescale", "one before $enddefinitions");
    if (variables_.empty()) fail(word_at_, "no $var", "the ports");
  }
  void set_scale(const std::vector<std::string_view>& words, std::size_t where) {
    std::string text;
    for (const std::string_view w : words) text += w;
    const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
    const long number = number_in<long>(std::string_view(text).substr(0, digits), 1, 100).value_or(0);
    static const std::map<std::string, long long> kUnits = {
        {"s", 1'000'000'000'000}, {"ms", 1'000'000'000}, {"us", 1'000'000}, {"ns", 1'000}, {"ps", 1}};
    const auto unit = kUnits.find(text.substr(digits));
    if ((number != 1 && number != 10 && number != 100) || unit == kUnits.end())
      fail(where, fmt::format("$timescale {}", shown(text)), "1, 10 or 100 of s, ms, us, ns or ps");
    scale_ps_ = number * unit->second;
  }
  void add_variable(const std::vector<std::string_view>& words, std::size_t where) {
    if (words.size() < 4)
      fail(where, fmt::format("$var with {} words", words.size()), "type, width, code, name");
    const bool port = words[0] == "port";
    if (variables_.empty()) extended_ = port;
    if (port != extended_) fail(where, fmt::format("$var {}", shown(words[0])), "ports alone or none");
    Variable variable;
    variable.name = words[3].starts_with('\\') ? words[3].substr(1) : words[3];  // an escaped name
    for (std::size_t i = 4; i < words.size(); ++i) variable.name += words[i];    // a [0] set apart
    variable.where = where;
    const bool is_bit = words[1] == "1";
    if (extended_) {
      if (!is_bit) fail(where, fmt::format("a width of {}", shown(words[1])), "1: one variable a bit");
    } else {
      const auto direction = directions_.find(variable.name);
      variable.used = is_bit && direction != directions_.end();
      if (variable.used) variable.input = direction->second;
      if (!is_bit && is_bus_of_ports(words[3]))
        fail(where, fmt::format("\"{}\" with a width of {}", shown(words[3]), shown(words[1])),
             "one variable for each bit of a port");
    }
    if (variable.used && !is_plain_name(variable.name))
      fail(where, fmt::format("signal \"{}\"", shown(variable.name)),
           "a name without blanks, quotes, \\, % and `");
    std::vector<std::size_t>& same_code = code_[std::string(words[2])];
    if (extended_ && !same_code.empty())
      fail(where, fmt::format("code {} again", shown(words[2])), "one of its own");
    // One net has one code in all scopes that see it.
    const bool is_seen_again = std::any_of(same_code.begin(), same_code.end(), [&](std::size_t other) {
      return variables_[other].name == variable.name;
    });
    if (variable.used && !is_seen_again && !names_.insert(variable.name).second)
      fail(where, fmt::format("signal \"{}\" again", variable.name),
           "each signal once; where scopes have signals of one name, dump one scope alone");
    if (is_seen_again) return;
    same_code.push_back(variables_.size());
    variables_.push_back(std::move(variable));
  }
  bool is_bus_of_ports(std::string_view name) const {
    const std::string first = std::string(name) + "[";
    const auto port = directions_.lower_bound(first);
    return port != directions_.end() && port->first.starts_with(first);
  }

  const std::vector<std::size_t>& variables_of(std::string_view code, std::size_t where) const {
    const auto found = code_.find(std::string(code));
    if (found == code_.end()) fail(where, fmt::format("code {}", shown(code)), "one of a $var");
    return found->second;
  }
  void read_changes() {
    long long now = -1;
    for (std::string_view token = word(); !token.empty(); token = word()) {
      const std::size_t where = word_at_;
      if (token[0] == '#') {
        long long stamp = 0;
        const auto end = std::from_chars(token.data() + 1, token.data() + token.size(), stamp);
        if (end.ec != std::errc() || end.ptr != token.data() + token.size() || stamp < 0 ||
            stamp > std::numeric_limits<long long>::max() / scale_ps_)
          fail(where, fmt::format("time {}", shown(token)),
               fmt::format("# and a whole number from 0 to {}",
                           std::numeric_limits<long long>::max() / scale_ps_));
        if (stamp * scale_ps_ < now)
          fail(where, fmt::format("time {}", shown(token)), "one that doesn't go back");
        now = stamp * scale_ps_;
        last_at_ = where;
      } else if (token[0] == '$') {
        if (token == "$comment")
          to_end(where);
        else if (token != "$dumpvars" && token != "$dumpports" && token != "$dumpportsall" &&
                 token != "$dumpall" && token != "$end")
          fail(where, fmt::format("\"{}\"", shown(token)), "a change, a time or a dump command");
      } else {
        if (now < 0) fail(where, "a change before the first time", "#0");
        change(token, now, where);
      }
    }
    end_ps_ = now;
    if (now < 0) fail(word_at_, "no times", "changes of the ports");
  }
  void change(std::string_view token, long long now, std::size_t where) {
    if (extended_) {
      if (token[0] != 'p' || token.size() != 2)
        fail(where, fmt::format("\"{}\"", shown(token)), "p and a state");
      const char state = token[1];
      for (int strength = 0; strength < 2; ++strength) {
        const std::string_view number = word();
        if (number.size() != 1 || number[0] < '0' || number[0] > '7')
          fail(word_at_, fmt::format("strength \"{}\"", shown(number)), "0 to 7");
      }
      const std::size_t v = variables_of(word(), where).front();
      const bool drives = std::string_view("DUNZdu").find(state) != std::string_view::npos,
                 shows = std::string_view("LHXTlh").find(state) != std::string_view::npos;
      if (!drives && !shows)
        fail(where, fmt::format("state {}", shown({&state, 1})),
             "D U N Z of an input or L H X T of an output");
      if (variables_[v].input && *variables_[v].input != drives)
        fail(where, fmt::format("state {} of \"{}\"", state, variables_[v].name),
             *variables_[v].input ? "one of an input" : "one of an output");
      variables_[v].input = drives;
      const char value = state == 'D' || state == 'L' || state == 'd' || state == 'l'   ? '0'
                         : state == 'U' || state == 'H' || state == 'u' || state == 'h' ? '1'
                                                                                        : 'x';
      changes_.push_back({now, v, value, where});
      return;
    }
    const char c = static_cast<char>(std::tolower(static_cast<unsigned char>(token[0])));
    if (c == 'b' || c == 'r' || c == 's') {  // a vector, a real number or a text: no port's
      const std::size_t code_at = at_;
      for (const std::size_t v : variables_of(word(), code_at))
        if (variables_[v].used) fail(where, fmt::format("\"{}\"", shown(token)), "0, 1, x or z of a bit");
      return;
    }
    if (c != '0' && c != '1' && c != 'x' && c != 'z')
      fail(where, fmt::format("\"{}\"", shown(token)), "0, 1, x or z and a code");
    for (const std::size_t v : variables_of(token.substr(1), where))
      if (variables_[v].used) changes_.push_back({now, v, c == 'z' ? 'x' : c, where});
  }

  CycleStream cycles() {
    CycleStream stream;
    stream.title = name_;
    stream.timing = timing_;
    for (const bool inputs : {true, false}) {
      for (Variable& v : variables_) {
        if (!v.used) continue;
        if (!v.input) fail(v.where, fmt::format("no value of \"{}\"", v.name), "one at the first time");
        if (*v.input != inputs) continue;
        v.signal = stream.signals.size();
        stream.signals.push_back({v.name, inputs});
      }
    }
    for (const auto& [name, input] : directions_) {
      if (extended_) break;
      if (names_.count(name) == 0)
        fail(last_at_, fmt::format("no variable {}", name), input ? "every input port" : "every output port");
    }
    const auto ps = [](double ns) { return std::llround(ns * 1000.0); };
    const long long period = ps(timing_.period_ns), drive = ps(timing_.drive_ns),
                    strobe = ps(timing_.strobe_ns), rise = ps(timing_.clock_rise_ns),
                    fall = ps(timing_.clock_fall_ns);
    if (end_ps_ % period != 0)
      fail(last_at_, fmt::format("an end at {} ps", end_ps_),
           fmt::format("a multiple of the period of {} ps", period));
    const long long total = end_ps_ / period;
    if (static_cast<std::uint64_t>(total) > kMostCounted)
      fail(last_at_, fmt::format("{} cycles", total), fmt::format("at most {}", kMostCounted));
    std::string now(stream.signals.size(), 'x');
    std::vector<std::size_t> changed_at(now.size(), last_at_);
    std::size_t next = 0;
    for (long long cycle = 0; cycle < total; ++cycle) {
      const long long start = cycle * period;
      std::string states(now.size(), 'X');
      const auto sample = [&](bool inputs) {
        for (const Variable& v : variables_) {
          if (!v.used || *v.input != inputs) continue;
          const char value = now[v.signal];
          if (inputs && value == 'x')
            fail(next < changes_.size() ? changes_[next].where : last_at_,
                 fmt::format("no value of \"{}\" in cycle {}", v.name, cycle), "0 or 1");
          states[v.signal] = inputs ? value : value == '1' ? 'H' : value == '0' ? 'L' : 'X';
        }
      };
      bool driven = false, compared = false;
      const std::size_t first_change = next;
      const auto sample_until = [&](long long offset) {
        if (!driven && offset > drive) sample(true), driven = true;
        if (!compared && offset > strobe) sample(false), compared = true;
      };
      while (next < changes_.size() && changes_[next].ps < start + period) {
        const Change& c = changes_[next];
        const Variable& v = variables_[c.variable];
        const long long offset = c.ps - start;
        sample_until(offset);
        if (*v.input && offset != drive) pulse(v, c, offset, rise, fall, states);
        now[v.signal] = c.value;
        changed_at[v.signal] = c.where;
        ++next;
      }
      sample_until(period);
      for (const Variable& v : variables_) {
        if (v.used && *v.input && states[v.signal] == 'R')
          fail(changed_at[v.signal], fmt::format("\"{}\" high at the end of cycle {}", v.name, cycle),
               fmt::format("a fall at {} ps of it", fall));
      }
      // a cycle without a change is like all up to the next one
      const long long changed = next < changes_.size() ? changes_[next].ps / period : total;
      const long long alike = next == first_change ? std::min(changed, total) - cycle : 1;
      if (stream.cycles.empty() || stream.cycles.back().states != states) {
        if (stream.cycles.size() * states.size() >= kMostStates)
          fail(last_at_, "more cycles than this program takes",
               fmt::format("at most {} states", kMostStates));
        stream.cycles.push_back({std::move(states), "", 0});
      }
      stream.cycles.back().count += static_cast<std::uint64_t>(alike);
      cycle += alike - 1;
    }
    return stream;
  }
  void pulse(const Variable& v, const Change& c, long long offset, long long rise, long long fall,
             std::string& states) const {
    char& state = states[v.signal];
    if (offset == rise && c.value == '1' && state == '0')
      state = 'R';
    else if (offset == fall && c.value == '0' && state == 'R')
      state = 'P';
    else
      fail(c.where, fmt::format("a change of \"{}\" {} ps into its cycle", v.name, offset),
           fmt::format("one at {} ps, or a pulse from {} to {} ps", std::llround(timing_.drive_ns * 1000.0),
                       rise, fall));
  }

  std::string_view text_;
  const std::string& name_;
  const TestTiming& timing_;
  const Directions& directions_;
  std::size_t at_ = 0, word_at_ = 0, last_at_ = 0;
  long long scale_ps_ = 0, end_ps_ = 0;
  bool extended_ = false;
  std::vector<Variable> variables_;
  std::map<std::string, std::vector<std::size_t>> code_;  // of one net: several variables
  std::set<std::string> names_;                           // of those that are used
  std::vector<Change> changes_;
};

}  // namespace

void require_timing(const TestTiming& t, const std::string& name) {
  constexpr double kLeastNs = 0.001, kMostNs = 1e9;
  const auto is_within = [&](double ns) { return ns >= 0 && ns < t.period_ns; };
  const bool good = t.period_ns >= kLeastNs && t.period_ns <= kMostNs && is_within(t.drive_ns) &&
                    is_within(t.strobe_ns) && is_within(t.clock_rise_ns) && is_within(t.clock_fall_ns) &&
                    t.clock_rise_ns < t.clock_fall_ns;
  if (!good)
    throw UserError(
        fmt::format("{}: found period {} ns, drive {}, strobe {}, clock from {} to {}, expected a period of "
                    "{} ns to 1 s, "
                    "the other times within it and the clock's rise before its fall",
                    name, t.period_ns, t.drive_ns, t.strobe_ns, t.clock_rise_ns, t.clock_fall_ns, kLeastNs));
}

CycleStream parse_dump(std::string_view text, const std::string& name, const TestTiming& timing,
                       const Directions& directions) {
  require_timing(timing, name);
  CycleStream stream = DumpReader(text, name, timing, directions).read();
  require_runnable(stream);  // times that the user says, not the file
  return stream;
}

}  // namespace meltstage::dft
