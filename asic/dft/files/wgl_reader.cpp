// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "asic/dft/files/pattern_files.hpp"
#include "asic/dft/files/waveforms.hpp"
#include "base/byte_order_mark.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

namespace {

struct Token {
  std::string text;  // empty at the end
  bool quoted = false;
  std::size_t where = 0;
};

class WglReader {
 public:
  WglReader(std::string_view text, const std::string& name, std::size_t most_cycles)
      : text_(without_byte_order_mark(text)), name_(name), most_cycles_(most_cycles) {
    advance();
  }

  CycleStream read() {
    expect("waveform");
    stream_.title = meltstage::shown(take_name());
    while (!at("end")) {
      const Token block = token_;
      advance();
      if (block.text == "signal")
        read_signals();
      else if (block.text == "timeplate")
        read_timeplate();
      else if (block.text == "pattern")
        read_pattern();
      else if (block.text == "scancell")
        read_cells();
      else if (block.text == "scanchain")
        read_chains();
      else if (block.text == "scanstate")
        read_states();
      else
        fail(block.where, shown(block), "signal, timeplate, scancell, scanchain, scanstate, pattern or end");
    }
    if (!pattern_) fail(token_.where, "no pattern", "one");
    advance();
    if (!at_end_of_file()) fail(token_.where, shown(token_), "nothing behind the waveform's end");
    shift_rows();
    set_timing();
    return std::move(stream_);
  }

 private:
  // Of a signal in the timeplate: an input's S is the value of the vector, an output's Q compares with it.
  struct Edges {
    std::vector<PinEvent> events;
    std::size_t where = 0;
    std::map<char, char> states;  // of a cycle, by the vector's value
  };

  struct Chain {
    std::size_t index, in, out;  // of the stream; signals
  };
  struct State {
    std::size_t chain;
    std::string bits;  // by cell
    std::size_t where;
  };
  struct ScanRow {
    std::size_t at;  // cycles before it
    std::string states, label;
    std::size_t where;
    std::vector<std::pair<const Chain*, Token>> load, unload;  // names of states
  };

  [[noreturn]] void fail(std::size_t where, const std::string& found, const std::string& expected) const {
    const Place place = place_of(text_, where);
    throw PatternFileError(defect_at(name_, place, found, expected), place.line);
  }
  static std::string shown(const Token& token) {
    return token.text.empty() ? "the end of the file" : fmt::format("\"{}\"", meltstage::shown(token.text));
  }
  void advance() {
    for (;; ++at_) {
      if (at_ >= text_.size()) {
        token_ = {"", false, text_.size()};
        return;
      }
      const char c = text_[at_];
      if (c == '{' || c == '#') {  // a comment, or a label
        const char close = c == '{' ? '}' : '\n';
        std::size_t end = text_.find(close, at_);
        if (end == std::string_view::npos && close == '\n') end = text_.size();  // the last line needs none
        if (end == std::string_view::npos) fail(at_, "a comment left open", std::string(1, '}'));
        if (c == '{') comment_ = trimmed(text_.substr(at_ + 1, end - at_ - 1));
        at_ = close == '\n' ? end - 1 : end;
        continue;
      }
      if (std::isspace(static_cast<unsigned char>(c)) == 0) break;
    }
    token_ = {"", false, at_};
    if (text_[at_] == '"') {
      const std::size_t end = text_.find('"', at_ + 1), newline = text_.find('\n', at_);
      if (end == std::string_view::npos || end > newline) fail(at_, "a name left open with \"", "\"");
      token_ = {std::string(text_.substr(at_ + 1, end - at_ - 1)), true, at_};
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
    if (!at(word)) fail(token_.where, shown(token_), fmt::format("\"{}\"", word));
    advance();
  }
  std::string take_name() {
    if (token_.text.empty()) fail(token_.where, shown(token_), "a name");
    std::string name = token_.text;
    advance();
    return name;
  }
  bool at_end_of_file() const { return token_.text.empty() && !token_.quoted; }
  std::size_t signal(const Token& token) const {
    const auto found = signal_.find(token.text);
    if (found == signal_.end())
      fail(token.where, fmt::format("signal \"{}\"", meltstage::shown(token.text)),
           "one of the signal block");
    return found->second;
  }

  void read_signals() {
    if (!plate_.empty()) fail(token_.where, "signals after the timeplate", "all signals before it");
    while (!at("end")) {
      const Token name = token_;
      take_name();
      if (!is_plain_name(name.text))
        fail(name.where, "signal " + shown(name), "a name without blanks, quotes, \\, % and `");
      expect(":");
      const Token direction = token_;
      advance();
      if (direction.text != "input" && direction.text != "output")
        fail(direction.where, shown(direction), "input or output");
      if (!signal_.emplace(name.text, stream_.signals.size()).second)
        fail(name.where, fmt::format("signal \"{}\" again", meltstage::shown(name.text)), "each signal once");
      stream_.signals.push_back({name.text, direction.text == "input"});
      while (!at(";")) {
        if (token_.text.empty() || at("end")) fail(direction.where, shown(token_), "\";\"");
        advance();
      }
      expect(";");
    }
    advance();
  }

  // Names; groups of cells in brackets are passed over.
  void read_cells() {
    for (; !at("end"); advance()) {
      if (at_end_of_file()) fail(token_.where, shown(token_), "a scan cell or \"end\"");
      if (at("[")) {
        while (!at("]") && !at_end_of_file()) advance();
      } else if (!at(";") && !at(",")) {
        cells_.insert(token_.text);
      }
    }
    advance();
  }

  // name [in, cell, ..., out]; a ! stands where it inverts.
  void read_chains() {
    while (!at("end")) {
      const Token name = token_;
      take_name();
      expect("[");
      std::vector<Token> members;
      for (bool more = true; more;) {
        members.push_back(token_);
        take_name();
        more = at(",");
        if (more) advance();
      }
      expect("]");
      expect(";");
      if (members.size() < 3)
        fail(name.where, fmt::format("chain \"{}\" with {} members", name.text, members.size()),
             "its input, cells and output");
      const std::size_t in = signal(members.front()), out = signal(members.back());
      if (!stream_.signals[in].is_input || stream_.signals[out].is_input)
        fail(name.where,
             fmt::format("chain \"{}\" from \"{}\" to \"{}\"", name.text, members.front().text,
                         members.back().text),
             "an input first and an output last");
      ScanChain chain{name.text, members.front().text, members.back().text, {}};
      for (std::size_t i = 1; i + 1 < members.size(); ++i) {
        if (members[i].text == "!" && !members[i].quoted) {
          chain.inversions.push_back(chain.cells.size());
          continue;
        }
        if (cells_.count(members[i].text) == 0)
          fail(members[i].where, fmt::format("scan cell \"{}\"", meltstage::shown(members[i].text)),
               "one of the scancell block");
        chain.cells.push_back(members[i].text);
      }
      if (chain.cells.empty())
        fail(name.where, fmt::format("chain \"{}\" without cells", meltstage::shown(name.text)), "some");
      if (!chain_.emplace(name.text, Chain{stream_.chains.size(), in, out}).second)
        fail(name.where, fmt::format("chain \"{}\" again", meltstage::shown(name.text)), "each chain once");
      stream_.chains.push_back(std::move(chain));
    }
    advance();
  }
  const Chain& chain(const Token& token) const {
    const auto found = chain_.find(token.text);
    if (found == chain_.end())
      fail(token.where, fmt::format("chain \"{}\"", meltstage::shown(token.text)),
           "one of the scanchain block");
    return found->second;
  }

  // name := chain (bits, that of the cell behind the chain's input first);
  void read_states() {
    while (!at("end")) {
      const Token name = token_;
      take_name();
      expect(":=");
      State state{chain(token_).index, "", name.where};
      advance();
      expect("(");
      for (; !at(")"); advance()) {
        if (at_end_of_file() || at(";")) fail(name.where, "a scan state left open", "\")\"");
        state.bits += token_.text;
      }
      advance();
      expect(";");
      const ScanChain& of = stream_.chains[state.chain];
      if (state.bits.size() != of.cells.size())
        fail(name.where, fmt::format("{} bits in state \"{}\"", state.bits.size(), name.text),
             fmt::format("{}, the cells of chain \"{}\"", of.cells.size(), of.name));
      if (!state_.emplace(name.text, std::move(state)).second)
        fail(name.where, fmt::format("state \"{}\" again", meltstage::shown(name.text)), "each state once");
    }
    advance();
  }

  double take_time() {
    const Token token = token_;
    const std::size_t behind = token.text.find_last_of("0123456789.") + 1;  // 0 without a number
    std::string unit = token.text.substr(behind);
    std::transform(unit.begin(), unit.end(), unit.begin(),
                   [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
    static const std::map<std::string, double> kUnits = {
        {"s", 1e9}, {"ms", 1e6}, {"us", 1e3}, {"ns", 1}, {"ps", 1e-3}};
    const auto found = kUnits.find(unit);
    const auto value = number_in(std::string_view(token.text).substr(0, behind), 0.0, 1e9);
    if (!value || found == kUnits.end())
      fail(token.where, fmt::format("time {}", shown(token)), "a number with s, ms, us, ns or ps");
    advance();
    return *value * found->second;
  }

  void read_timeplate() {
    const Token name = token_;
    take_name();
    if (!plate_.empty()) fail(name.where, fmt::format("a second timeplate \"{}\"", name.text), "one");
    plate_ = name.text;
    expect("period");
    stream_.timing.period_ns = take_time();
    edges_.assign(stream_.signals.size(), {});
    while (!at("end")) {
      const std::size_t s = signal(token_), where = token_.where;
      advance();
      expect(":=");
      const Token direction = token_;
      advance();
      if (direction.text != (stream_.signals[s].is_input ? "input" : "output"))
        fail(direction.where, shown(direction), stream_.signals[s].is_input ? "input" : "output");
      expect("[");
      for (bool more = true; more;) {
        PinEvent event{take_time(), ' '};
        if (event.ns > stream_.timing.period_ns)
          fail(where, fmt::format("an edge at {} ns", event.ns),
               fmt::format("one within the period of {} ns", stream_.timing.period_ns));
        if (!edges_[s].events.empty() && event.ns <= edges_[s].events.back().ns)
          fail(where, fmt::format("an edge at {} ns", event.ns), "one behind the edge before");
        expect(":");
        const Token state = token_;
        advance();
        const std::string_view known = stream_.signals[s].is_input ? "PDUSNZ" : "XQT";
        if (state.text.size() != 1 || known.find(state.text) == std::string_view::npos)
          fail(state.where, shown(state), fmt::format("one of {}", known));
        event.state = state.text[0];
        edges_[s].events.push_back(event);
        edges_[s].where = where;
        more = at(",");
        if (more) advance();
      }
      expect("]");
      expect(";");
    }
    advance();
    for (std::size_t s = 0; s < edges_.size(); ++s) {
      if (edges_[s].events.empty())
        fail(name.where,
             fmt::format("no edges of \"{}\" in timeplate \"{}\"", stream_.signals[s].name, plate_),
             "some for every signal");
    }
  }
  // What the pin does when the vector says 0, 1 or X.
  std::vector<PinEvent> events_of(std::size_t s, char value) const {
    std::vector<PinEvent> events = edges_[s].events;
    const bool input = stream_.signals[s].is_input;
    for (std::size_t i = 0; i < events.size(); ++i) {
      char& state = events[i].state;
      if (input && state == 'S') state = value == '0' ? 'D' : value == '1' ? 'U' : 'N';
      // compared up to the next edge, or the period's end
      if (!input && state == 'Q') state = value == 'X' ? 'X' : value == '1' ? 'h' : 'l';
    }
    return events;
  }
  void set_timing() {
    UsedWaveforms defined;  // say the times of what no cycle has
    for (std::size_t s = 0; s < edges_.size(); ++s) {
      for (const char value : {'0', '1'})
        defined.add('\0', "", 0, events_of(s, value), stream_.signals[s].is_input, stream_.timing.period_ns);
    }
    defined.set(stream_.timing);
    waveforms_.set(stream_.timing);
    for (const UsedWaveforms::Defect& defect : waveforms_.defects())
      stream_.timing_defects.push_back(
          defect_at(name_, place_of(text_, defect.where), defect.found, defect.expected));
  }

  void read_pattern() {
    const Token name = token_;
    take_name();
    if (plate_.empty()) fail(name.where, "a pattern without a timeplate", "the timeplate before it");
    if (pattern_) fail(name.where, fmt::format("a second pattern \"{}\"", name.text), "one");
    pattern_ = true;
    comment_.clear();
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
        fail(name.where, fmt::format("no column of \"{}\"", stream_.signals[s].name), "one for every signal");
    }
    read_vectors(order, 0);
  }
  // Up to and with their end.
  void read_vectors(const std::vector<std::size_t>& order, std::size_t depth) {
    for (; !at("end");) {
      if (at("loop"))
        read_loop(order, depth);
      else
        read_vector(order);
    }
    advance();
  }
  std::uint64_t take_times() {
    advance();
    const Token number = token_;
    const auto times = number_in<std::uint64_t>(number.text, 1, kMostCounted);
    if (!times)
      fail(number.where, shown(number),
           fmt::format("how often the vector is repeated, 1 to {}", kMostCounted));
    advance();
    return *times;
  }
  // loop N vector ... end
  void read_loop(const std::vector<std::size_t>& order, std::size_t depth) {
    const std::size_t where = token_.where;
    constexpr std::size_t kDeepest = 16;
    if (depth == kDeepest) fail(where, "loops nested more deeply", fmt::format("at most {}", kDeepest));
    const std::uint64_t times = take_times();
    const std::size_t first = stream_.cycles.size(), rows = rows_.size();
    const std::uint64_t counted_before = counted_;
    read_vectors(order, depth + 1);
    if (rows_.size() != rows) fail(where, "a scan row in a loop", "each by itself");
    const std::size_t length = stream_.cycles.size() - first;
    const std::uint64_t counted = counted_ - counted_before;
    if (counted != 0 && times > (kMostCounted - counted_before) / counted) fail_too_many(where);
    counted_ = counted_before + counted * times;
    if (length == 1) {
      stream_.cycles.back().count *= times;
      return;
    }
    for (std::uint64_t i = 1; i < times && length != 0; ++i) {
      if (is_full()) fail_too_many(where);
      for (std::size_t k = 0; k < length; ++k) {
        TestCycle again = stream_.cycles[first + k];
        again.label.clear();
        stream_.cycles.push_back(std::move(again));
      }
    }
  }
  bool is_full() const {
    return stream_.cycles.size() >= most_cycles_ ||
           stream_.cycles.size() * stream_.signals.size() >= kMostStates;
  }
  [[noreturn]] void fail_too_many(std::size_t where) const {
    fail(where, "more cycles than this program takes",
         fmt::format("at most {}, {} with repeats, {} states", most_cycles_, kMostCounted, kMostStates));
  }
  void read_vector(const std::vector<std::size_t>& order) {
    const std::string label = std::exchange(comment_, {});
    const std::uint64_t count = at("repeat") ? take_times() : 1;
    const Token row = token_;
    const bool scan = at("scan");
    if (scan && count != 1) fail(row.where, "a scan row repeated", "each by itself");
    expect(scan ? "scan" : "vector");
    expect("(");
    if (token_.text != plate_)
      fail(token_.where, fmt::format("timeplate \"{}\"", meltstage::shown(token_.text)),
           fmt::format("\"{}\"", plate_));
    advance();
    expect(")");
    expect(":=");
    const std::string values = take_values(order.size());
    if (scan) {
      read_scan_row(order, values, label, row.where);
      return;
    }
    expect(";");
    std::string states(stream_.signals.size(), '\0');
    for (std::size_t i = 0; i < order.size(); ++i)
      states[order[i]] = state_of(order[i], values[i], row.where);
    counted_ += count;
    if (is_full() || counted_ > kMostCounted) fail_too_many(row.where);
    stream_.cycles.push_back({std::move(states), label, count});
  }

  // "[ 0 1 X ]", so many.
  std::string take_values(std::size_t count) {
    const std::size_t where = token_.where;
    expect("[");
    std::string values;
    for (; !at("]"); advance()) {
      if (token_.text.empty() || at(";")) fail(where, "a vector left open", "\"]\"");
      values += token_.text;
    }
    advance();
    if (values.size() != count)
      fail(where, fmt::format("{} values", values.size()), fmt::format("the {} of the pattern", count));
    return values;
  }
  // The cycle's character for what the vector's value does to the pin.
  char state_of(std::size_t s, char value, std::size_t where) {
    if (value == '-') value = 'X';
    char& state = edges_[s].states[value];
    if (state != '\0') return state;
    const TestSignal& pin = stream_.signals[s];
    if (value != '0' && value != '1' && value != 'X')
      fail(where, fmt::format("{} for \"{}\"", value, pin.name), "0, 1 or X");
    const char plain = value == '0'   ? (pin.is_input ? '0' : 'L')
                       : value == '1' ? (pin.is_input ? '1' : 'H')
                                      : (pin.is_input ? 'N' : 'X');
    state = waveforms_
                .add(plain, fmt::format("{} of \"{}\"", value, pin.name), edges_[s].where,
                     events_of(s, value), pin.is_input, stream_.timing.period_ns)
                .value_or(plain);
    return state;
  }

  // scan(tp) := [ 0 1 - X ], output [chain:state, ...], input [chain:state, ...];
  void read_scan_row(const std::vector<std::size_t>& order, const std::string& values,
                     const std::string& label, std::size_t where) {
    ScanRow row{stream_.cycles.size(), std::string(stream_.signals.size(), '\0'), label, where, {}, {}};
    std::vector<std::uint8_t> shifted(stream_.signals.size(), 0);
    while (at(",")) {
      advance();
      const Token way = token_;
      advance();
      if (way.text != "input" && way.text != "output") fail(way.where, shown(way), "input or output");
      const bool load = way.text == "input";
      expect("[");
      for (bool more = true; more;) {
        const Chain& of = chain(token_);
        advance();
        expect(":");
        const std::size_t port = load ? of.in : of.out;
        if (shifted[port] != 0)
          fail(token_.where, fmt::format("\"{}\" again", stream_.signals[port].name), "each chain once");
        shifted[port] = 1;
        (load ? row.load : row.unload).push_back({&of, token_});
        take_name();
        more = at(",");
        if (more) advance();
      }
      expect("]");
    }
    expect(";");
    if (row.load.empty() && row.unload.empty())
      fail(where, "a scan row without states", "input or output [...]");
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::size_t s = order[i];
      row.states[s] = shifted[s] == 0               ? state_of(s, values[i], where)
                      : stream_.signals[s].is_input ? '0'
                                                    : 'X';
    }
    rows_.push_back(std::move(row));
  }
  const State& state(const Token& token, const Chain& of) const {
    const auto found = state_.find(token.text);
    if (found == state_.end())
      fail(token.where, fmt::format("scan state \"{}\"", meltstage::shown(token.text)),
           "one of the scanstate block");
    if (found->second.chain != of.index)
      fail(token.where, fmt::format("scan state \"{}\"", meltstage::shown(token.text)),
           fmt::format("one of chain \"{}\"", stream_.chains[of.index].name));
    return found->second;
  }
  static char inverted(char c, bool invert) {
    if (!invert || (c != '0' && c != '1')) return c;
    return c == '0' ? '1' : '0';
  }
  // Scan rows become cycles once all states are known: the bit of the cell before the chain's output moves
  // first. Shorter chains are loaded with leading zeros. States are what cells hold.
  void shift_rows() {
    std::vector<TestCycle> cycles;
    std::vector<std::vector<std::uint8_t>> inverses;
    for (const ScanChain& of : stream_.chains) inverses.push_back(of.inverses());
    std::size_t done = 0;
    for (const ScanRow& row : rows_) {
      for (; done < row.at; ++done) cycles.push_back(std::move(stream_.cycles[done]));
      std::size_t length = 0;
      for (const auto* list : {&row.load, &row.unload}) {
        for (const auto& [of, name] : *list)
          length = std::max(length, stream_.chains[of->index].cells.size());
      }
      if (cycles.size() + length > most_cycles_ || (cycles.size() + length) * row.states.size() > kMostStates)
        fail(row.where, "more cycles than this program takes",
             fmt::format("at most {} and {} states", most_cycles_, kMostStates));
      const std::size_t first = cycles.size();
      cycles.resize(first + length, {row.states, ""});
      cycles[first].label = row.label;
      for (const auto& [of, name] : row.load) {
        const State& loaded = state(name, *of);
        for (std::size_t cell = 0; cell < loaded.bits.size(); ++cell) {
          const char c = loaded.bits[cell];
          if (c != '0' && c != '1' && c != 'X') fail(loaded.where, fmt::format("{} to load", c), "0, 1 or X");
          cycles[first + length - 1 - cell].states[of->in] =
              state_of(of->in, inverted(c, inverses[of->index][cell]), loaded.where);
        }
      }
      for (const auto& [of, name] : row.unload) {
        const State& shown = state(name, *of);
        for (std::size_t cell = 0; cell < shown.bits.size(); ++cell)
          cycles[first + shown.bits.size() - 1 - cell].states[of->out] = state_of(
              of->out, inverted(shown.bits[cell], inverses[of->index][cell] ^ inverses[of->index].back()),
              shown.where);
      }
    }
    if (rows_.empty()) return;
    for (; done < stream_.cycles.size(); ++done) cycles.push_back(std::move(stream_.cycles[done]));
    stream_.cycles = std::move(cycles);
  }

  std::string_view text_;
  const std::string& name_;
  const std::size_t most_cycles_;
  std::uint64_t counted_ = 0;
  std::size_t at_ = 0;
  Token token_;
  std::string comment_, plate_;
  bool pattern_ = false;
  CycleStream stream_;
  std::map<std::string, std::size_t> signal_;
  std::vector<Edges> edges_;  // by signal
  UsedWaveforms waveforms_;
  std::set<std::string> cells_;
  std::map<std::string, Chain> chain_;
  std::map<std::string, State> state_;
  std::vector<ScanRow> rows_;
};

}  // namespace

CycleStream parse_wgl(std::string_view text, const std::string& name, std::size_t most_cycles) {
  return WglReader(text, name, most_cycles).read();
}

}  // namespace meltstage::dft
