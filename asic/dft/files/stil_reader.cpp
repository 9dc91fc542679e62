// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include "asic/dft/files/stil.hpp"

namespace meltstage::dft {

namespace {

constexpr std::size_t kMaxCycles = 50'000'000;
constexpr std::size_t kMaxDepth = 16;  // calls within calls

struct Token {
  enum class Kind { word, string, time, punctuation, end };
  Kind kind = Kind::end;
  std::string text;
  std::size_t line = 1;
};

struct Lexer {
  std::string_view text;
  const std::string& name;
  std::size_t at = 0;
  std::size_t line = 1;

  [[noreturn]] void fail(std::size_t where, const std::string& found, const std::string& expected) const {
    throw StilError(fmt::format("{}:{}: found {}, expected {}", name, where, found, expected), where);
  }
  void skip() {
    while (at < text.size()) {
      if (text.substr(at, 2) == "//") {
        while (at < text.size() && text[at] != '\n') ++at;
      } else if (text.substr(at, 2) == "/*" || text.substr(at, 2) == "{*") {
        const std::string_view close = text[at] == '/' ? "*/" : "*}";
        const std::size_t end = text.find(close, at + 2);
        if (end == std::string_view::npos) fail(line, "a comment left open", std::string(close));
        for (; at < end + 2; ++at) line += text[at] == '\n' ? 1 : 0;
      } else if (std::isspace(static_cast<unsigned char>(text[at])) != 0) {
        line += text[at++] == '\n' ? 1 : 0;
      } else {
        return;
      }
    }
  }
  Token next() {
    skip();
    Token token{Token::Kind::end, "", line};
    if (at >= text.size()) return token;
    const char c = text[at];
    if (c == '"' || c == '\'') {
      const std::size_t end = text.find(c, at + 1);
      if (end == std::string_view::npos)
        fail(line, fmt::format("a string left open with {}", c), std::string(1, c));
      token.kind = c == '"' ? Token::Kind::string : Token::Kind::time;
      token.text = text.substr(at + 1, end - at - 1);
      line += static_cast<std::size_t>(std::count(token.text.begin(), token.text.end(), '\n'));
      at = end + 1;
      return token;
    }
    if (std::string_view("{};:=").find(c) != std::string_view::npos) {
      token.kind = Token::Kind::punctuation;
      token.text = c;
      ++at;
      return token;
    }
    token.kind = Token::Kind::word;
    const std::size_t begin = at;
    while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) == 0 &&
           std::string_view("{};:=\"'").find(text[at]) == std::string_view::npos)
      ++at;
    token.text = text.substr(begin, at - begin);
    return token;
  }
  // Vector data after "=": all up to the semicolon.
  std::string data() {
    const std::size_t end = text.find_first_of(";}", at);
    if (end == std::string_view::npos || text[end] == '}') fail(line, "vector data without an end", "\";\"");
    const std::string result(text.substr(at, end - at));
    line += static_cast<std::size_t>(std::count(result.begin(), result.end(), '\n'));
    at = end + 1;
    return result;
  }
};

struct Assignment {
  std::string signals;
  std::string data;
  std::size_t line = 0;
};

struct Statement {
  enum class Kind { table, condition, fixed, vector, call, macro, shift, loop, stop };
  Kind kind = Kind::stop;
  std::string name;  // table, call, macro
  std::string label;
  std::vector<Assignment> assignments;
  std::vector<Statement> body;  // shift, loop
  std::size_t count = 1;        // loop
  std::size_t line = 0;
};

// Everything the file defines, then the pattern expanded.
class Reader {
 public:
  Reader(std::string_view text, const std::string& name) : lexer_{text, name} { advance(); }

  CycleStream read() {
    expect_word("STIL");
    take_word();  // the version
    if (is("{"))
      skip_block();
    else
      expect(";");
    while (token_.kind != Token::Kind::end) top_block();
    return expand_all();
  }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& found, const std::string& expected) const {
    lexer_.fail(line, found, expected);
  }
  void advance() { token_ = lexer_.next(); }
  bool is(std::string_view punctuation) const {
    return token_.kind == Token::Kind::punctuation && token_.text == punctuation;
  }
  bool is_word(std::string_view word) const {
    return token_.kind == Token::Kind::word && token_.text == word;
  }
  std::string shown() const {
    return token_.kind == Token::Kind::end ? "the end of the file" : fmt::format("\"{}\"", token_.text);
  }
  void expect(std::string_view punctuation) {
    if (!is(punctuation)) fail(token_.line, shown(), fmt::format("\"{}\"", punctuation));
    advance();
  }
  void expect_word(std::string_view word) {
    if (!is_word(word)) fail(token_.line, shown(), std::string(word));
    advance();
  }
  std::string take_word() {
    if (token_.kind != Token::Kind::word) fail(token_.line, shown(), "a word");
    std::string word = token_.text;
    advance();
    return word;
  }
  std::string take_name() {
    if (token_.kind != Token::Kind::word && token_.kind != Token::Kind::string)
      fail(token_.line, shown(), "a name");
    std::string word = token_.text;
    advance();
    return word;
  }
  void skip_block() {
    const std::size_t line = token_.line;
    expect("{");
    for (std::size_t depth = 1; depth != 0; advance()) {
      if (token_.kind == Token::Kind::end) fail(line, "a block left open", "\"}\"");
      if (is("{")) ++depth;
      if (is("}") && --depth == 0) break;
    }
    expect("}");
  }

  void top_block() {
    const std::size_t line = token_.line;
    const std::string word = take_word();
    if (word == "Signals") {
      read_signals();
    } else if (word == "SignalGroups") {
      if (!is("{")) take_name();
      read_groups();
    } else if (word == "Timing") {
      if (!is("{")) take_name();
      read_timing();
    } else if (word == "ScanStructures") {
      if (!is("{")) take_name();
      read_chains();
    } else if (word == "PatternBurst") {
      const std::string name = take_name();
      bursts_[name] = read_burst();
    } else if (word == "PatternExec") {
      if (!is("{")) take_name();
      read_exec();
    } else if (word == "Procedures" || word == "MacroDefs") {
      if (!is("{")) take_name();
      read_procedures(word == "Procedures" ? procedures_ : macros_);
    } else if (word == "Pattern") {
      const std::string name = take_name();
      expect("{");
      patterns_[name] = statements();
    } else if (word == "Header") {
      read_header();
    } else if (word == "Ann" || word == "UserKeywords" || word == "Spec" || word == "Selector" ||
               word == "Environment" || word == "Include") {
      while (!is("{") && !is(";") && token_.kind != Token::Kind::end) advance();
      if (is("{"))
        skip_block();
      else
        expect(";");
    } else {
      fail(line, fmt::format("\"{}\"", word), "a block of STIL (Signals, SignalGroups, Timing, Pattern ...)");
    }
  }

  void read_header() {
    expect("{");
    while (!is("}")) {
      if (token_.kind == Token::Kind::end) fail(token_.line, shown(), "\"}\"");
      const bool title = is_word("Title");
      advance();
      if (title && token_.kind == Token::Kind::string) stream_.title = token_.text;
      if (is("{")) skip_block();
    }
    expect("}");
  }

  void read_signals() {
    expect("{");
    while (!is("}")) {
      const std::size_t line = token_.line;
      const std::string name = take_name(), direction = take_word();
      if (direction != "In" && direction != "Out")
        fail(line, fmt::format("signal \"{}\" {}", name, direction), "In or Out");
      if (!signal_.emplace(name, stream_.signals.size()).second)
        fail(line, fmt::format("signal \"{}\" again", name), "each signal once");
      stream_.signals.push_back({name, direction == "In"});
      if (is("{"))
        skip_block();
      else
        expect(";");
    }
    expect("}");
  }

  // Signals of a name or of an expression 'a + b - c'.
  std::vector<std::size_t> members(const std::string& name, std::size_t line) const {
    if (const auto found = groups_.find(name); found != groups_.end()) return found->second;
    if (const auto found = signal_.find(name); found != signal_.end()) return {found->second};
    fail(line, fmt::format("signal or group \"{}\"", name), "one that is defined in Signals or SignalGroups");
  }
  std::vector<std::size_t> expression(const std::string& text, std::size_t line) const {
    std::vector<std::size_t> result;
    char sign = '+';
    for (std::size_t i = 0; i < text.size();) {
      const char c = text[i];
      if (std::isspace(static_cast<unsigned char>(c)) != 0) {
        ++i;
      } else if (c == '+' || c == '-') {
        sign = c;
        ++i;
      } else {
        const bool quote = c == '"';
        const std::size_t begin = quote ? i + 1 : i;
        std::size_t end = begin;
        while (end < text.size() &&
               (quote ? text[end] != '"'
                      : text[end] != '+' && text[end] != '-' && text[end] != ' ' && text[end] != '\n'))
          ++end;
        for (const std::size_t s : members(text.substr(begin, end - begin), line)) {
          if (sign == '+')
            result.push_back(s);
          else
            result.erase(std::remove(result.begin(), result.end(), s), result.end());
        }
        i = quote ? end + 1 : end;
      }
    }
    return result;
  }
  void read_groups() {
    expect("{");
    while (!is("}")) {
      const std::size_t line = token_.line;
      const std::string name = take_name();
      expect("=");
      if (token_.kind != Token::Kind::time) fail(token_.line, shown(), "signals in single quotes");
      groups_[name] = expression(token_.text, line);
      advance();
      if (is("{"))
        skip_block();
      else
        expect(";");
    }
    expect("}");
  }

  double time_ns(const Token& token) const {
    if (token.kind != Token::Kind::time)
      fail(token.line, fmt::format("\"{}\"", token.text), "a time in single quotes, as '100ns'");
    char* end = nullptr;
    const double value = std::strtod(token.text.c_str(), &end);
    const std::string unit(end);
    static const std::map<std::string, double> units = {{"s", 1e9}, {"ms", 1e6},  {"us", 1e3},
                                                        {"ns", 1},  {"ps", 1e-3}, {"fs", 1e-6}};
    const auto found = units.find(unit);
    if (end == token.text.c_str() || found == units.end() || !std::isfinite(value) || value < 0)
      fail(token.line, fmt::format("time '{}'", token.text), "a number with s, ms, us, ns or ps");
    return value * found->second;
  }

  struct Table {
    double period_ns = 0;
    std::vector<std::set<char>> characters;  // by signal
    std::map<char, std::vector<std::pair<double, std::string>>> events;
  };
  void read_timing() {
    expect("{");
    while (!is("}")) {
      expect_word("WaveformTable");
      const std::string name = take_name();
      Table table;
      table.characters.resize(stream_.signals.size());
      expect("{");
      while (!is("}")) {
        const std::size_t line = token_.line;
        const std::string word = take_word();
        if (word == "Period") {
          table.period_ns = time_ns(token_);
          advance();
          expect(";");
        } else if (word == "Waveforms") {
          read_waveforms(table);
        } else {
          fail(line, fmt::format("\"{}\"", word), "Period or Waveforms");
        }
      }
      expect("}");
      if (table.period_ns <= 0)
        fail(token_.line, fmt::format("no Period in WaveformTable \"{}\"", name), "one above 0");
      for (const auto& [c, events] : table.events) {
        for (const auto& [at, event] : events) {
          if (at >= table.period_ns)
            fail(token_.line, fmt::format("an edge at {} ns in waveform {} of \"{}\"", at, c, name),
                 fmt::format("one within the period of {} ns", table.period_ns));
        }
      }
      tables_[name] = std::move(table);
    }
    expect("}");
  }
  void read_waveforms(Table& table) {
    expect("{");
    while (!is("}")) {
      const std::size_t line = token_.line;
      const std::vector<std::size_t> signals = members(take_name(), line);
      expect("{");
      while (!is("}")) {
        const std::string characters = take_word();
        expect("{");
        std::vector<std::vector<std::pair<double, std::string>>> lists(characters.size());
        while (!is("}")) {
          const double at = time_ns(token_);
          advance();
          std::string events = take_word();
          events.erase(std::remove(events.begin(), events.end(), '/'), events.end());
          if (events.size() != 1 && events.size() != characters.size())
            fail(token_.line, fmt::format("events {} for characters {}", events, characters),
                 "one event, or one a character");
          for (std::size_t i = 0; i < characters.size(); ++i) {
            const char event = events[events.size() == 1 ? 0 : i];
            if (std::string_view("DUZPNLHXTlhxt").find(event) == std::string_view::npos)
              fail(token_.line, fmt::format("event {}", event), "D U Z P N, or L H X T");
            if (!lists[i].empty() && at < lists[i].back().first)
              fail(token_.line, fmt::format("an edge at {} ns after a later one", at), "rising times");
            lists[i].emplace_back(at, std::string(1, event));
          }
          expect(";");
        }
        expect("}");
        for (std::size_t i = 0; i < characters.size(); ++i) {
          for (const std::size_t s : signals) table.characters[s].insert(characters[i]);
          if (!lists[i].empty()) table.events[characters[i]] = lists[i];
        }
      }
      expect("}");
    }
    expect("}");
  }

  void read_chains() {
    expect("{");
    while (!is("}")) {
      expect_word("ScanChain");
      const std::string name = take_name();
      std::size_t length = 0;
      std::string in, out, inversion;
      std::vector<std::string> cells;
      std::vector<std::size_t> inversions;
      const std::size_t line = token_.line;
      expect("{");
      while (!is("}")) {
        if (token_.kind == Token::Kind::end) fail(line, "ScanChain left open", "\"}\"");
        const std::string word = take_word();
        if (word == "ScanLength") length = number(take_word());
        if (word == "ScanIn") in = take_name();
        if (word == "ScanOut") out = take_name();
        if (word == "ScanInversion") inversion = take_word();
        for (; !is(";") && !is("}") && token_.kind != Token::Kind::end; advance()) {
          if (word != "ScanCells") continue;
          if (token_.kind == Token::Kind::word && token_.text == "!")
            inversions.push_back(cells.size());
          else
            cells.push_back(token_.text);
        }
        expect(";");
      }
      expect("}");
      if (!cells.empty() && cells.size() != length)
        fail(line, fmt::format("{} cells in ScanChain \"{}\"", cells.size(), name),
             fmt::format("{}, its ScanLength", length));
      const std::string_view parity = inversions.size() % 2 == 0 ? "0" : "1";
      if (!cells.empty() && !inversion.empty() && inversion != parity)
        fail(line,
             fmt::format("ScanInversion {} and {} marks in the ScanCells of \"{}\"", inversion,
                         inversions.size(), name),
             fmt::format("ScanInversion {}", parity));
      for (const std::string& port : {in, out}) {
        if (!port.empty()) members(port, line);
      }
      chain_length_ = std::max(chain_length_, length);
      stream_.chains.push_back({name, in, out, std::move(cells), std::move(inversions)});
    }
    expect("}");
  }
  std::size_t number(const std::string& text) const {
    if (text.empty() || text.size() > 9 ||
        !std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; }))
      fail(token_.line, fmt::format("\"{}\"", text), "a whole number");
    return static_cast<std::size_t>(std::stoul(text));
  }

  std::vector<Assignment> read_burst() {
    std::vector<Assignment> list;
    expect("{");
    while (!is("}")) {
      const std::string word = take_word();
      if (word == "PatList") {
        expect("{");
        while (!is("}")) {
          list.push_back({token_.text, "", token_.line});
          take_name();
          if (is("{"))
            skip_block();
          else
            expect(";");
        }
        expect("}");
      } else {
        while (!is(";") && token_.kind != Token::Kind::end) advance();
        expect(";");
      }
    }
    expect("}");
    return list;
  }
  void read_exec() {
    expect("{");
    while (!is("}")) {
      const std::size_t line = token_.line;
      const std::string word = take_word();
      const std::string name = take_name();
      if (word == "PatternBurst") executed_.push_back({name, "", line});
      if (word == "Timing" || word == "Selector" || word == "Category") {
      }
      expect(";");
    }
    expect("}");
  }

  void read_procedures(std::map<std::string, std::vector<Statement>>& into) {
    expect("{");
    while (!is("}")) {
      const std::string name = take_name();
      expect("{");
      into[name] = statements();
    }
    expect("}");
  }

  // Up to and with the closing brace.
  std::vector<Statement> statements() {
    std::vector<Statement> list;
    std::string label;
    const std::size_t opened = token_.line;
    while (!is("}")) {
      if (token_.kind == Token::Kind::end) fail(opened, "a block left open", "\"}\"");
      const std::size_t line = token_.line;
      const bool string = token_.kind == Token::Kind::string;
      const std::string word = take_name();
      if (is(":")) {
        advance();
        label = word;
        continue;
      }
      if (string) fail(line, fmt::format("\"{}\"", word), "a statement or a label with \":\"");
      Statement statement;
      statement.line = line;
      statement.label = std::move(label);
      label.clear();
      if (word == "W" || word == "WaveformTable") {
        statement.kind = Statement::Kind::table;
        statement.name = take_name();
        expect(";");
      } else if (word == "C" || word == "Condition" || word == "F" || word == "Fixed" || word == "V" ||
                 word == "Vector") {
        statement.kind = word[0] == 'C'   ? Statement::Kind::condition
                         : word[0] == 'F' ? Statement::Kind::fixed
                                          : Statement::Kind::vector;
        assignments(statement);
      } else if (word == "Call" || word == "Macro") {
        statement.kind = word == "Call" ? Statement::Kind::call : Statement::Kind::macro;
        statement.name = take_name();
        if (is("{"))
          assignments(statement);
        else
          expect(";");
      } else if (word == "Shift") {
        statement.kind = Statement::Kind::shift;
        expect("{");
        statement.body = statements();
      } else if (word == "Loop") {
        statement.kind = Statement::Kind::loop;
        statement.count = number(take_word());
        expect("{");
        statement.body = statements();
      } else if (word == "Ann" || word == "IddqTestPoint" || word == "Stop" || word == "BreakPoint") {
        statement.kind = Statement::Kind::stop;
        if (is(";")) advance();
        if (is("{")) skip_block();
      } else {
        fail(line, fmt::format("\"{}\"", word), "W, C, F, V, Call, Macro, Shift or Loop");
      }
      list.push_back(std::move(statement));
    }
    expect("}");
    return list;
  }
  void assignments(Statement& statement) {
    expect("{");
    while (!is("}")) {
      Assignment assignment{"", "", token_.line};
      assignment.signals = take_name();
      if (!is("=")) fail(token_.line, shown(), "\"=\"");
      assignment.data = lexer_.data();  // the lexer stands right behind the "="
      advance();
      statement.assignments.push_back(std::move(assignment));
    }
    expect("}");
  }

  // "\r5 0 1" to "000001".
  std::string unrolled(const Assignment& assignment) const {
    std::string result;
    const std::string& text = assignment.data;
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (std::isspace(static_cast<unsigned char>(text[i])) != 0) continue;
      if (text[i] != '\\') {
        result += text[i];
        continue;
      }
      std::size_t end = i + 2;
      while (end < text.size() && std::isdigit(static_cast<unsigned char>(text[end])) != 0) ++end;
      if (i + 1 >= text.size() || text[i + 1] != 'r' || end == i + 2 || end - i > 9)
        fail(assignment.line, fmt::format("\"{}\"", text.substr(i, 8)), "\\rN and a character");
      const std::size_t count = static_cast<std::size_t>(std::stoul(text.substr(i + 2, end - i - 2)));
      while (end < text.size() && std::isspace(static_cast<unsigned char>(text[end])) != 0) ++end;
      if (end >= text.size()) fail(assignment.line, "\\r without a character", "\\rN and a character");
      result.append(count, text[end]);
      i = end;
    }
    return result;
  }

  // ---- Expansion
  // --------------------------------------------------------------------------------------------------------------

  struct Parameter {
    std::string data;
    std::size_t used = 0;
    std::size_t line = 0;
  };
  using Parameters = std::map<std::size_t, Parameter>;  // by signal

  CycleStream expand_all() {
    if (executed_.empty()) fail(token_.line, "no PatternExec with a PatternBurst", "one");
    states_.assign(stream_.signals.size(), '\0');
    for (const Assignment& exec : executed_) {
      const auto burst = bursts_.find(exec.signals);
      if (burst == bursts_.end())
        fail(exec.line, fmt::format("PatternBurst \"{}\"", exec.signals), "one that is defined");
      for (const Assignment& entry : burst->second) {
        const auto pattern = patterns_.find(entry.signals);
        if (pattern == patterns_.end())
          fail(entry.line, fmt::format("pattern \"{}\"", entry.signals), "one that is defined");
        Parameters none;
        run(pattern->second, none, 0);
      }
    }
    set_timing();
    return std::move(stream_);
  }
  void set_timing() {
    if (used_table_ == nullptr) return;
    TestTiming& timing = stream_.timing;
    timing.period_ns = used_table_->period_ns;
    const auto edge = [&](char c, std::size_t i, double& into) {
      const auto found = used_table_->events.find(c);
      if (found != used_table_->events.end() && i < found->second.size()) into = found->second[i].first;
    };
    edge('0', 0, timing.drive_ns);
    edge('P', 1, timing.clock_rise_ns);
    edge('P', 2, timing.clock_fall_ns);
    const auto high = used_table_->events.find('H');
    if (high != used_table_->events.end()) timing.strobe_ns = high->second.back().first;
  }

  void run(const std::vector<Statement>& list, Parameters& parameters, std::size_t depth) {
    for (const Statement& statement : list) {
      switch (statement.kind) {
        case Statement::Kind::table: {
          const auto found = tables_.find(statement.name);
          if (found == tables_.end())
            fail(statement.line, fmt::format("WaveformTable \"{}\"", statement.name), "one that is defined");
          if (used_table_ != nullptr && used_table_ != &found->second)
            fail(statement.line, fmt::format("a second WaveformTable \"{}\"", statement.name),
                 "one for the whole pattern");
          used_table_ = &found->second;
          break;
        }
        case Statement::Kind::condition:
        case Statement::Kind::fixed:
          assign(statement, parameters);
          break;
        case Statement::Kind::vector:
          assign(statement, parameters);
          emit(statement);
          break;
        case Statement::Kind::call:
        case Statement::Kind::macro:
          call(statement, depth);
          break;
        case Statement::Kind::shift:
          shift(statement, parameters, depth);
          break;
        case Statement::Kind::loop:
          if (!statement.label.empty()) pending_label_ = statement.label;
          if (statement.body.size() == 1 && statement.body[0].kind == Statement::Kind::vector && depth == 0) {
            if (statement.count == 0) break;
            assign(statement.body[0], parameters);
            emit(statement.body[0], statement.count);
            break;
          }
          for (std::size_t i = 0; i < statement.count; ++i) run(statement.body, parameters, depth);
          break;
        case Statement::Kind::stop:
          break;
      }
    }
  }
  void call(const Statement& statement, std::size_t depth) {
    const bool macro = statement.kind == Statement::Kind::macro;
    const auto& defined = macro ? macros_ : procedures_;
    const auto found = defined.find(statement.name);
    if (found == defined.end())
      fail(statement.line, fmt::format("{} \"{}\"", macro ? "macro" : "procedure", statement.name),
           "one that is defined");
    if (depth >= kMaxDepth)
      fail(statement.line, fmt::format("calls {} deep", depth), fmt::format("at most {}", kMaxDepth));
    Parameters parameters;
    for (const Assignment& assignment : statement.assignments) {
      const std::vector<std::size_t> signals = members(assignment.signals, assignment.line);
      const std::string data = unrolled(assignment);
      if (signals.size() == 1) {
        parameters[signals[0]] = {data, 0, assignment.line};
      } else {
        if (data.size() != signals.size())
          fail(assignment.line, fmt::format("{} characters for \"{}\"", data.size(), assignment.signals),
               fmt::format("{}", signals.size()));
        for (std::size_t i = 0; i < signals.size(); ++i)
          parameters[signals[i]] = {std::string(1, data[i]), 0, assignment.line};
      }
    }
    if (!statement.label.empty())
      pending_label_ = statement.label;
    else if (macro && depth == 0)
      pending_label_ = statement.name;
    run(found->second, parameters, depth + 1);
    for (const auto& [signal, parameter] : parameters) {
      if (parameter.used != parameter.data.size())
        fail(parameter.line,
             fmt::format("{} characters for \"{}\"", parameter.data.size(), stream_.signals[signal].name),
             fmt::format("the {} that \"{}\" takes", parameter.used, statement.name));
    }
  }
  // As many times as the longest data of a signal that the body shifts.
  void shift(const Statement& statement, Parameters& parameters, std::size_t depth) {
    std::size_t count = 0;
    for (const Statement& inner : statement.body) {
      for (const Assignment& assignment : inner.assignments) {
        if (assignment.data.find('#') == std::string::npos) continue;
        for (const std::size_t s : members(assignment.signals, assignment.line)) {
          const auto found = parameters.find(s);
          if (found != parameters.end())
            count = std::max(count, found->second.data.size() - found->second.used);
        }
      }
    }
    if (chain_length_ != 0 && count != 0 && count != chain_length_) {
      std::size_t line = statement.line;
      for (const auto& [s, parameter] : parameters) {
        if (parameter.data.size() == count) line = parameter.line;
      }
      fail(line, fmt::format("scan data of {} bits", count),
           fmt::format("{}, the longest ScanLength", chain_length_));
    }
    for (std::size_t i = 0; i < count; ++i) run(statement.body, parameters, depth);
  }
  void assign(const Statement& statement, Parameters& parameters) {
    for (const Assignment& assignment : statement.assignments) {
      const std::vector<std::size_t> signals = members(assignment.signals, assignment.line);
      const std::string data = unrolled(assignment);
      if (data.size() != signals.size())
        fail(assignment.line, fmt::format("{} characters for \"{}\"", data.size(), assignment.signals),
             fmt::format("{}", signals.size()));
      for (std::size_t i = 0; i < signals.size(); ++i) {
        char c = data[i];
        std::size_t line = assignment.line;
        if (c == '#' || c == '%') {
          const auto found = parameters.find(signals[i]);
          if (found == parameters.end()) continue;  // keeps its value
          Parameter& parameter = found->second;
          line = parameter.line;
          if (parameter.used >= parameter.data.size())
            fail(line,
                 fmt::format("{} characters for \"{}\"", parameter.data.size(),
                             stream_.signals[signals[i]].name),
                 "as many as the other signals have");
          const std::size_t at = parameter.used;
          if (c == '#') ++parameter.used;
          c = parameter.data[at];
        }
        if (used_table_ == nullptr) fail(line, "data before a W statement", "a WaveformTable first");
        if (used_table_->characters[signals[i]].count(c) == 0)
          fail(line, fmt::format("waveform character {} for \"{}\"", c, stream_.signals[signals[i]].name),
               "one that its WaveformTable defines");
        states_[signals[i]] = c;
      }
    }
  }
  void emit(const Statement& statement, std::uint64_t count = 1) {
    for (std::size_t s = 0; s < states_.size(); ++s) {
      if (states_[s] == '\0')
        fail(statement.line, fmt::format("no value of \"{}\" so far", stream_.signals[s].name),
             "one before the first V");
    }
    if (stream_.cycles.size() >= kMaxCycles)
      fail(statement.line, "more cycles than this program takes", fmt::format("at most {}", kMaxCycles));
    std::string label = !statement.label.empty() && pending_label_.empty() ? statement.label : pending_label_;
    stream_.cycles.push_back({states_, std::move(label), count});
    pending_label_.clear();
  }

  Lexer lexer_;
  Token token_;
  CycleStream stream_;
  std::map<std::string, std::size_t> signal_;
  std::map<std::string, std::vector<std::size_t>> groups_;
  std::map<std::string, Table> tables_;
  const Table* used_table_ = nullptr;
  std::map<std::string, std::vector<Statement>> procedures_, macros_, patterns_;
  std::map<std::string, std::vector<Assignment>> bursts_;
  std::vector<Assignment> executed_;
  std::size_t chain_length_ = 0;
  std::string states_;
  std::string pending_label_;
};

}  // namespace

CycleStream parse_stil(std::string_view text, const std::string& name) { return Reader(text, name).read(); }

CycleStream read_stil(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw StilError(fmt::format("{}: can't be read; give a STIL file", path.string()), 0);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return parse_stil(text, path.string());
}

}  // namespace meltstage::dft
