// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "asic/dft/pattern_files.hpp"

namespace meltstage::dft {

namespace {

struct Token {
  std::string text;  // empty at the end
  bool quoted = false;
  std::size_t line = 1;
};

class WglReader {
 public:
  WglReader(std::string_view text, const std::string& name) : text_(text), name_(name) { advance(); }

  CycleStream read() {
    expect("waveform");
    stream_.title = take_name();
    while (!at("end")) {
      const Token block = token_;
      advance();
      if (block.text == "signal")
        read_signals();
      else if (block.text == "timeplate")
        read_timeplate();
      else if (block.text == "pattern")
        read_pattern();
      else if (block.text == "scancell" || block.text == "scanchain" || block.text == "scanstate")
        skip_block(block.line);
      else
        fail(block.line, shown(block), "signal, timeplate, pattern or end");
    }
    if (!pattern_) fail(token_.line, "no pattern", "one");
    set_timing();
    return std::move(stream_);
  }

 private:
  // An input: P keeps the value before, D low, U high, S the value of the vector. An output: X, Q compared.
  struct Event {
    double ns;
    char state;
  };

  [[noreturn]] void fail(std::size_t line, const std::string& found, const std::string& expected) const {
    throw PatternFileError(fmt::format("{}:{}: found {}, expected {}", name_, line, found, expected), line);
  }
  static std::string shown(const Token& token) {
    return token.text.empty() ? "the end of the file" : fmt::format("\"{}\"", token.text);
  }
  void advance() {
    for (;; ++at_) {
      if (at_ >= text_.size()) {
        token_ = {"", false, line_};
        return;
      }
      const char c = text_[at_];
      if (c == '\n') ++line_;
      if (c == '{' || c == '#') {  // a comment, or a label
        const char close = c == '{' ? '}' : '\n';
        const std::size_t end = text_.find(close, at_);
        if (end == std::string_view::npos) fail(line_, "a comment left open", std::string(1, '}'));
        if (c == '{') comment_ = trimmed(text_.substr(at_ + 1, end - at_ - 1));
        line_ += static_cast<std::size_t>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(at_),
                                                     text_.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
        at_ = close == '\n' ? end - 1 : end;
        continue;
      }
      if (std::isspace(static_cast<unsigned char>(c)) == 0) break;
    }
    token_ = {"", false, line_};
    if (text_[at_] == '"') {
      const std::size_t end = text_.find('"', at_ + 1), newline = text_.find('\n', at_);
      if (end == std::string_view::npos || end > newline) fail(line_, "a name left open with \"", "\"");
      token_ = {std::string(text_.substr(at_ + 1, end - at_ - 1)), true, line_};
      at_ = end + 1;
      return;
    }
    constexpr std::string_view kMarks = "[](),;:=";
    if (text_.substr(at_, 2) == ":=") {
      token_.text = ":=";
      at_ += 2;
    } else if (kMarks.find(text_[at_]) != std::string_view::npos) {
      token_.text = text_[at_++];
    } else {
      const std::size_t begin = at_;
      while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) == 0 &&
             kMarks.find(text_[at_]) == std::string_view::npos && text_[at_] != '{' && text_[at_] != '"')
        ++at_;
      token_.text = text_.substr(begin, at_ - begin);
    }
  }
  static std::string trimmed(std::string_view text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0)
      text.remove_prefix(1);
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.remove_suffix(1);
    return std::string(text);
  }
  bool at(std::string_view word) const { return !token_.quoted && token_.text == word; }
  void expect(std::string_view word) {
    if (!at(word)) fail(token_.line, shown(token_), fmt::format("\"{}\"", word));
    advance();
  }
  std::string take_name() {
    if (token_.text.empty()) fail(token_.line, shown(token_), "a name");
    std::string name = token_.text;
    advance();
    return name;
  }
  void skip_block(std::size_t line) {
    while (!at("end")) {
      if (token_.text.empty() && !token_.quoted) fail(line, "a block left open", "\"end\"");
      advance();
    }
    advance();
  }
  std::size_t signal(const Token& token) const {
    const auto found = signal_.find(token.text);
    if (found == signal_.end())
      fail(token.line, fmt::format("signal \"{}\"", token.text), "one of the signal block");
    return found->second;
  }

  void read_signals() {
    while (!at("end")) {
      const Token name = token_;
      take_name();
      expect(":");
      const Token direction = token_;
      advance();
      if (direction.text != "input" && direction.text != "output")
        fail(direction.line, shown(direction), "input or output");
      if (!signal_.emplace(name.text, stream_.signals.size()).second)
        fail(name.line, fmt::format("signal \"{}\" again", name.text), "each signal once");
      stream_.signals.push_back({name.text, direction.text == "input"});
      while (!at(";")) {
        if (token_.text.empty() || at("end")) fail(direction.line, shown(token_), "\";\"");
        advance();
      }
      expect(";");
    }
    advance();
  }

  double take_time() {
    const Token token = token_;
    char* end = nullptr;
    const double value = std::strtod(token.text.c_str(), &end);
    std::string unit(end);
    std::transform(unit.begin(), unit.end(), unit.begin(),
                   [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
    static const std::map<std::string, double> kUnits = {
        {"s", 1e9}, {"ms", 1e6}, {"us", 1e3}, {"ns", 1}, {"ps", 1e-3}};
    const auto found = kUnits.find(unit);
    if (end == token.text.c_str() || found == kUnits.end() || !std::isfinite(value) || value < 0)
      fail(token.line, fmt::format("time \"{}\"", token.text), "a number with s, ms, us, ns or ps");
    advance();
    return value * found->second;
  }

  void read_timeplate() {
    const Token name = token_;
    take_name();
    if (!plate_.empty()) fail(name.line, fmt::format("a second timeplate \"{}\"", name.text), "one");
    plate_ = name.text;
    expect("period");
    stream_.timing.period_ns = take_time();
    events_.assign(stream_.signals.size(), {});
    while (!at("end")) {
      const std::size_t s = signal(token_), line = token_.line;
      advance();
      expect(":=");
      const Token direction = token_;
      advance();
      if (direction.text != (stream_.signals[s].is_input ? "input" : "output"))
        fail(direction.line, shown(direction), stream_.signals[s].is_input ? "input" : "output");
      expect("[");
      for (bool more = true; more;) {
        Event event{take_time(), ' '};
        if (event.ns > stream_.timing.period_ns)
          fail(line, fmt::format("an edge at {} ns", event.ns),
               fmt::format("one within the period of {} ns", stream_.timing.period_ns));
        if (!events_[s].empty() && event.ns <= events_[s].back().ns)
          fail(line, fmt::format("an edge at {} ns", event.ns), "one behind the edge before");
        expect(":");
        const Token state = token_;
        advance();
        const std::string_view known = stream_.signals[s].is_input ? "PDUSNZ" : "XQT";
        if (state.text.size() != 1 || known.find(state.text) == std::string_view::npos)
          fail(state.line, shown(state), fmt::format("one of {}", known));
        event.state = state.text[0];
        events_[s].push_back(event);
        more = at(",");
        if (more) advance();
      }
      expect("]");
      expect(";");
    }
    advance();
    for (std::size_t s = 0; s < events_.size(); ++s) {
      if (events_[s].empty())
        fail(name.line,
             fmt::format("no edges of \"{}\" in timeplate \"{}\"", stream_.signals[s].name, plate_),
             "some for every signal");
    }
  }
  // A clock is low but where the vector's value stands.
  bool pulsed(std::size_t s) const {
    return stream_.signals[s].is_input && events_[s].size() == 3 && events_[s][0].state == 'D' &&
           events_[s][1].state == 'S' && events_[s][2].state == 'D';
  }
  void set_timing() {
    TestTiming& timing = stream_.timing;
    for (std::size_t s = 0; s < events_.size(); ++s) {
      const auto edge = std::find_if(events_[s].begin(), events_[s].end(),
                                     [](const Event& e) { return e.state == 'S' || e.state == 'Q'; });
      if (edge == events_[s].end()) continue;
      if (pulsed(s)) {
        timing.clock_rise_ns = edge->ns;
        timing.clock_fall_ns = events_[s][2].ns;
      } else {
        (stream_.signals[s].is_input ? timing.drive_ns : timing.strobe_ns) = edge->ns;
      }
    }
  }

  void read_pattern() {
    const Token name = token_;
    take_name();
    if (plate_.empty()) fail(name.line, "a pattern without a timeplate", "the timeplate before it");
    if (pattern_) fail(name.line, fmt::format("a second pattern \"{}\"", name.text), "one");
    pattern_ = true;
    expect("(");
    std::vector<std::size_t> order;
    for (bool more = true; more;) {
      order.push_back(signal(token_));
      advance();
      more = at(",");
      if (more) advance();
    }
    expect(")");
    std::vector<std::uint8_t> named(stream_.signals.size(), 0);
    for (const std::size_t s : order) named[s] = 1;
    for (std::size_t s = 0; s < named.size(); ++s) {
      if (named[s] == 0)
        fail(name.line, fmt::format("no column of \"{}\"", stream_.signals[s].name), "one for every signal");
    }
    comment_.clear();
    while (!at("end")) read_vector(order);
    advance();
  }
  void read_vector(const std::vector<std::size_t>& order) {
    const std::string label = std::exchange(comment_, {});
    std::uint64_t count = 1;
    if (at("repeat") || at("loop")) {
      advance();
      const Token number = token_;
      char* end = nullptr;
      count = std::strtoull(number.text.c_str(), &end, 10);
      if (end == number.text.c_str() || *end != '\0' || count == 0)
        fail(number.line, shown(number), "how often the vector is repeated");
      advance();
    }
    expect("vector");
    expect("(");
    if (token_.text != plate_)
      fail(token_.line, fmt::format("timeplate \"{}\"", token_.text), fmt::format("\"{}\"", plate_));
    advance();
    expect(")");
    expect(":=");
    const std::size_t line = token_.line;
    expect("[");
    std::string states(stream_.signals.size(), '\0'), values;
    for (; !at("]"); advance()) {
      if (token_.text.empty() || at(";")) fail(line, "a vector left open", "\"]\"");
      values += token_.text;
    }
    advance();
    expect(";");
    if (values.size() != order.size())
      fail(line, fmt::format("{} values", values.size()), fmt::format("the {} of the pattern", order.size()));
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::size_t s = order[i];
      const char c = values[i];
      char state = '\0';
      if (stream_.signals[s].is_input && (c == '0' || c == '1')) state = c == '1' && pulsed(s) ? 'P' : c;
      if (!stream_.signals[s].is_input && (c == '0' || c == '1')) state = c == '1' ? 'H' : 'L';
      if (!stream_.signals[s].is_input && (c == 'X' || c == '-')) state = 'X';
      if (state == '\0')
        fail(line, fmt::format("{} for \"{}\"", c, stream_.signals[s].name),
             stream_.signals[s].is_input ? "0 or 1" : "0, 1 or X");
      states[s] = state;
    }
    stream_.cycles.push_back({std::move(states), label, count});
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0, line_ = 1;
  Token token_;
  std::string comment_, plate_;
  bool pattern_ = false;
  CycleStream stream_;
  std::map<std::string, std::size_t> signal_;
  std::vector<std::vector<Event>> events_;
};

}  // namespace

CycleStream parse_wgl(std::string_view text, const std::string& name) { return WglReader(text, name).read(); }

}  // namespace meltstage::dft
