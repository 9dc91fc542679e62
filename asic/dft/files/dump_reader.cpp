// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <vector>

#include "asic/dft/files/pattern_files.hpp"

namespace meltstage::dft {

namespace {

// One variable of the dump.
struct Variable {
  std::string name;
  std::size_t line = 0;
  std::optional<bool> input;  // extended VCD: told by its first value
  bool used = true;
  char value = 'x';
  std::size_t signal = 0;  // once the cycles begin
};

struct Change {
  long long ps;
  std::size_t variable;
  char value;  // 0 1 x
  std::size_t line;
};

class DumpReader {
 public:
  DumpReader(std::string_view text, const std::string& name, const TestTiming& timing,
             const Directions& directions)
      : text_(text), name_(name), timing_(timing), directions_(directions) {}

  CycleStream read() {
    read_header();
    read_changes();
    return cycles();
  }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& found, const std::string& expected) const {
    throw PatternFileError(fmt::format("{}:{}: found {}, expected {}", name_, line, found, expected), line);
  }
  // The next word, its line in word_line_; empty at the end.
  std::string_view word() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0)
      line_ += text_[at_++] == '\n' ? 1 : 0;
    word_line_ = line_;
    const std::size_t begin = at_;
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) == 0) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  std::vector<std::string_view> to_end(std::size_t line) {
    std::vector<std::string_view> words;
    for (std::string_view next = word(); next != "$end"; next = word()) {
      if (next.empty()) fail(line, "a block left open", "$end");
      words.push_back(next);
    }
    return words;
  }

  void read_header() {
    for (;;) {
      const std::string_view key = word();
      const std::size_t line = word_line_;
      if (key.empty()) fail(line, "the end of the file", "$enddefinitions");
      if (key[0] != '$') fail(line, fmt::format("\"{}\"", key), "a declaration with $");
      const std::vector<std::string_view> words = to_end(line);
      if (key == "$enddefinitions") break;
      if (key == "$timescale") set_scale(words, line);
      if (key == "$var") add_variable(words, line);
    }
    if (scale_ps_ == 0) fail(word_line_, "no $timescale", "one before $enddefinitions");
    if (variables_.empty()) fail(word_line_, "no $var", "the ports");
  }
  void set_scale(const std::vector<std::string_view>& words, std::size_t line) {
    std::string text;
    for (const std::string_view w : words) text += w;
    char* end = nullptr;
    const long number = std::strtol(text.c_str(), &end, 10);
    static const std::map<std::string, long long> kUnits = {
        {"s", 1'000'000'000'000}, {"ms", 1'000'000'000}, {"us", 1'000'000}, {"ns", 1'000}, {"ps", 1}};
    const auto unit = kUnits.find(end);
    if ((number != 1 && number != 10 && number != 100) || unit == kUnits.end())
      fail(line, fmt::format("$timescale {}", text), "1, 10 or 100 of s, ms, us, ns or ps");
    scale_ps_ = number * unit->second;
  }
  void add_variable(const std::vector<std::string_view>& words, std::size_t line) {
    if (words.size() < 4)
      fail(line, fmt::format("$var with {} words", words.size()), "type, width, code, name");
    const bool port = words[0] == "port";
    if (variables_.empty()) extended_ = port;
    if (port != extended_) fail(line, fmt::format("$var {}", words[0]), "ports alone or none");
    if (words[1] != "1") fail(line, fmt::format("a width of {}", words[1]), "1: one variable a bit");
    Variable variable;
    variable.name = words[3];
    for (std::size_t i = 4; i < words.size(); ++i) variable.name += words[i];  // a [0] set apart
    variable.line = line;
    if (!extended_) {
      const auto direction = directions_.find(variable.name);
      variable.used = direction != directions_.end();
      if (variable.used) variable.input = direction->second;
    }
    for (const Variable& other : variables_) {
      if (other.name == variable.name && other.used && variable.used)
        fail(line, fmt::format("signal \"{}\" again", variable.name), "each signal once");
    }
    if (!code_.emplace(words[2], variables_.size()).second)
      fail(line, fmt::format("code {} again", words[2]), "one of its own");
    variables_.push_back(std::move(variable));
  }

  std::size_t variable(std::string_view code, std::size_t line) const {
    const auto found = code_.find(std::string(code));
    if (found == code_.end()) fail(line, fmt::format("code {}", code), "one of a $var");
    return found->second;
  }
  void read_changes() {
    long long now = -1;
    for (std::string_view token = word(); !token.empty(); token = word()) {
      const std::size_t line = word_line_;
      if (token[0] == '#') {
        long long stamp = 0;
        const auto end = std::from_chars(token.data() + 1, token.data() + token.size(), stamp);
        if (end.ec != std::errc() || end.ptr != token.data() + token.size() || stamp < 0 ||
            stamp > std::numeric_limits<long long>::max() / scale_ps_)
          fail(line, fmt::format("time {}", token), "a number");
        if (stamp * scale_ps_ < now) fail(line, fmt::format("time {}", token), "one that doesn't go back");
        now = stamp * scale_ps_;
        last_line_ = line;
      } else if (token[0] == '$') {
        if (token == "$comment")
          to_end(line);
        else if (token != "$dumpvars" && token != "$dumpports" && token != "$dumpall" && token != "$end")
          fail(line, fmt::format("\"{}\"", token), "a change, a time or a dump command");
      } else {
        if (now < 0) fail(line, "a change before the first time", "#0");
        change(token, now, line);
      }
    }
    end_ps_ = now;
    if (now < 0) fail(word_line_, "no times", "changes of the ports");
  }
  void change(std::string_view token, long long now, std::size_t line) {
    if (extended_) {
      if (token[0] != 'p' || token.size() != 2) fail(line, fmt::format("\"{}\"", token), "p and a state");
      const char state = token[1];
      for (int strength = 0; strength < 2; ++strength) {
        const std::string_view number = word();
        if (number.size() != 1 || number[0] < '0' || number[0] > '7')
          fail(word_line_, fmt::format("strength \"{}\"", number), "0 to 7");
      }
      const std::size_t v = variable(word(), line);
      const bool drives = std::string_view("DUNZdu").find(state) != std::string_view::npos,
                 shows = std::string_view("LHXTlh").find(state) != std::string_view::npos;
      if (!drives && !shows)
        fail(line, fmt::format("state {}", state), "D U N Z of an input or L H X T of an output");
      if (variables_[v].input && *variables_[v].input != drives)
        fail(line, fmt::format("state {} of \"{}\"", state, variables_[v].name),
             *variables_[v].input ? "one of an input" : "one of an output");
      variables_[v].input = drives;
      const char value = state == 'D' || state == 'L' || state == 'd' || state == 'l'   ? '0'
                         : state == 'U' || state == 'H' || state == 'u' || state == 'h' ? '1'
                                                                                        : 'x';
      changes_.push_back({now, v, value, line});
      return;
    }
    const char c = static_cast<char>(std::tolower(static_cast<unsigned char>(token[0])));
    if (c != '0' && c != '1' && c != 'x' && c != 'z')
      fail(line, fmt::format("\"{}\"", token), "0, 1, x or z and a code");
    const std::size_t v = variable(token.substr(1), line);
    if (variables_[v].used) changes_.push_back({now, v, c == 'z' ? 'x' : c, line});
  }

  CycleStream cycles() {
    CycleStream stream;
    stream.title = name_;
    stream.timing = timing_;
    for (const bool inputs : {true, false}) {
      for (Variable& v : variables_) {
        if (!v.used) continue;
        if (!v.input) fail(v.line, fmt::format("no value of \"{}\"", v.name), "one at the first time");
        if (*v.input != inputs) continue;
        v.signal = stream.signals.size();
        stream.signals.push_back({v.name, inputs});
      }
    }
    for (const auto& [name, input] : directions_) {
      if (extended_) break;
      const bool found = std::any_of(variables_.begin(), variables_.end(),
                                     [&](const Variable& v) { return v.name == name; });
      if (!found && input) fail(last_line_, fmt::format("no variable {}", name), "every input port");
    }
    const auto ps = [](double ns) { return std::llround(ns * 1000.0); };
    const long long period = ps(timing_.period_ns), drive = ps(timing_.drive_ns),
                    strobe = ps(timing_.strobe_ns), rise = ps(timing_.clock_rise_ns),
                    fall = ps(timing_.clock_fall_ns);
    if (end_ps_ % period != 0)
      fail(last_line_, fmt::format("an end at {} ps", end_ps_),
           fmt::format("a multiple of the period of {} ps", period));
    const long long total = end_ps_ / period;
    std::string now(stream.signals.size(), 'x');
    std::vector<std::size_t> changed_at(now.size(), last_line_);
    std::size_t next = 0;
    for (long long cycle = 0; cycle < total; ++cycle) {
      const long long start = cycle * period;
      std::string states(now.size(), 'X');
      const auto sample = [&](bool inputs) {
        for (const Variable& v : variables_) {
          if (!v.used || *v.input != inputs) continue;
          const char value = now[v.signal];
          if (inputs && value == 'x')
            fail(next < changes_.size() ? changes_[next].line : last_line_,
                 fmt::format("no value of \"{}\" in cycle {}", v.name, cycle), "0 or 1");
          states[v.signal] = inputs ? value : value == '1' ? 'H' : value == '0' ? 'L' : 'X';
        }
      };
      bool driven = false, compared = false;
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
        changed_at[v.signal] = c.line;
        ++next;
      }
      sample_until(period);
      for (const Variable& v : variables_) {
        if (v.used && *v.input && states[v.signal] == 'R')
          fail(changed_at[v.signal], fmt::format("\"{}\" high at the end of cycle {}", v.name, cycle),
               fmt::format("a fall at {} ps of it", fall));
      }
      if (!stream.cycles.empty() && stream.cycles.back().states == states)
        ++stream.cycles.back().count;
      else
        stream.cycles.push_back({std::move(states), ""});
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
      fail(c.line, fmt::format("a change of \"{}\" {} ps into its cycle", v.name, offset),
           fmt::format("one at {} ps, or a pulse from {} to {} ps", std::llround(timing_.drive_ns * 1000.0),
                       rise, fall));
  }

  std::string_view text_;
  const std::string& name_;
  const TestTiming& timing_;
  const Directions& directions_;
  std::size_t at_ = 0, line_ = 1, word_line_ = 1, last_line_ = 1;
  long long scale_ps_ = 0, end_ps_ = 0;
  bool extended_ = false;
  std::vector<Variable> variables_;
  std::map<std::string, std::size_t> code_;
  std::vector<Change> changes_;
};

}  // namespace

CycleStream parse_dump(std::string_view text, const std::string& name, const TestTiming& timing,
                       const Directions& directions) {
  return DumpReader(text, name, timing, directions).read();
}

}  // namespace meltstage::dft
