// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <utility>

#include "asic/dft/files/stil.hpp"
#include "asic/dft/files/stil_file.hpp"
#include "base/byte_order_mark.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::dft::stil {

namespace {

constexpr std::size_t kMostNested = 16;        // Loop and Shift in each other
constexpr std::size_t kMostMembers = 100'000;  // of a group
constexpr std::size_t kMostCharacters = 62;    // of a waveform: letters and digits
constexpr double kMostTime = 1e9;              // in any unit
constexpr std::array<std::pair<std::string_view, double>, 6> kTimeUnits = {
    {{"s", 1e9}, {"ms", 1e6}, {"us", 1e3}, {"ns", 1}, {"ps", 1e-3}, {"fs", 1e-6}}};  // in ns

// Characters of the number at the beginning: "1.5", "2e-3".
std::size_t length_of_number(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789";
  std::size_t length = std::min(text.find_first_not_of("0123456789."), text.size());
  if (length == 0 || length == text.size() || (text[length] != 'e' && text[length] != 'E')) return length;
  std::size_t exponent = length + 1;
  if (exponent < text.size() && (text[exponent] == '+' || text[exponent] == '-')) ++exponent;
  const std::size_t end = std::min(text.find_first_not_of(kDigits, exponent), text.size());
  return end > exponent ? end : length;
}

// Words of a ScanChain; the last four change nothing that a tester plays.
constexpr std::array<std::string_view, 9> kChainWords = {"ScanLength",      "ScanIn",         "ScanOut",
                                                         "ScanInversion",   "ScanCells",      "ScanOutLength",
                                                         "ScanMasterClock", "ScanSlaveClock", "ScanCellType"};

// Events of a waveform as letters. IEEE 1450 gives each a long name, too: "ForceDown/ForceUp" is "DU".
std::string event_letters(std::string_view events) {
  constexpr std::array<std::pair<std::string_view, char>, 12> kLetters = {{{"ForceDown", 'D'},
                                                                           {"ForceUp", 'U'},
                                                                           {"ForceOff", 'Z'},
                                                                           {"ForcePrior", 'P'},
                                                                           {"ForceUnknown", 'N'},
                                                                           {"CompareLow", 'L'},
                                                                           {"CompareHigh", 'H'},
                                                                           {"CompareUnknown", 'X'},
                                                                           {"CompareOff", 'T'},
                                                                           {"CompareLowWindow", 'l'},
                                                                           {"CompareHighWindow", 'h'},
                                                                           {"CompareOffWindow", 't'}}};
  std::string letters;
  while (!events.empty()) {
    const std::size_t end = std::min(events.find('/'), events.size());
    const std::string_view event = events.substr(0, end);
    const auto named =
        std::find_if(kLetters.begin(), kLetters.end(), [&](const auto& l) { return l.first == event; });
    if (named != kLetters.end())
      letters += named->second;
    else
      letters += event;
    events.remove_prefix(std::min(end + 1, events.size()));
  }
  return letters;
}

struct Token {
  enum class Kind { word, string, time, punctuation, end };
  Kind kind = Kind::end;
  std::string text;
  std::size_t where = 0;
};

struct Lexer {
  const File& file;
  std::size_t at = 0;
  std::size_t end = 0;  // of the source

  std::string_view source() const { return std::string_view(file.text).substr(0, end); }

  void skip() {
    const std::string_view text = source();
    while (at < text.size()) {
      if (text.substr(at, 2) == "//") {
        at = std::min(text.find('\n', at), text.size());
      } else if (text.substr(at, 2) == "/*" || text.substr(at, 2) == "{*") {
        const std::string_view close = text[at] == '/' ? "*/" : "*}";
        const std::size_t closed = text.find(close, at + 2);
        if (closed == std::string_view::npos) file.fail(at, "a comment left open", std::string(close));
        at = closed + 2;
      } else if (std::isspace(static_cast<unsigned char>(text[at])) != 0) {
        ++at;
      } else {
        return;
      }
    }
  }
  Token next() {
    skip();
    const std::string_view text = source();
    Token token{Token::Kind::end, "", at};
    if (at >= text.size()) return token;
    const char c = text[at];
    if (c == '"' || c == '\'') {
      const std::size_t closed = text.find(c, at + 1);
      if (closed == std::string_view::npos)
        file.fail(at, fmt::format("a string left open with {}", c), std::string(1, c));
      token.kind = c == '"' ? Token::Kind::string : Token::Kind::time;
      token.text = text.substr(at + 1, closed - at - 1);
      at = closed + 1;
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
    const std::string_view text = source();
    const std::size_t semicolon = text.find_first_of(";}", at);
    if (semicolon == std::string_view::npos || text[semicolon] == '}')
      file.fail(at, "vector data without an end", "\";\"");
    std::string result(text.substr(at, semicolon - at));
    at = semicolon + 1;
    return result;
  }
};

class Reader {
 public:
  // Of the file's last source. `including`: the paths of the files that led here.
  Reader(File& file, const Include& include, std::vector<std::filesystem::path> including)
      : file_(file),
        include_(include),
        including_(std::move(including)),
        lexer_{file, file.sources.back().begin, file.text.size()} {
    advance();
  }

  void read() {
    if (including_.size() == 1 || is_word("STIL")) read_version();
    while (token_.kind != Token::Kind::end) top_block();
  }

 private:
  void read_version() {
    expect_word("STIL");
    const std::size_t where = token_.where;
    const std::string version = take_word();
    if (!version.starts_with("0.") && !version.starts_with("1."))
      fail(where, fmt::format("version {}", shown(version)), "STIL 1.0");
    if (is("{"))
      skip_block();
    else
      expect(";");
  }
  [[noreturn]] void fail(std::size_t where, const std::string& found, const std::string& expected) const {
    file_.fail(where, found, expected);
  }
  void advance() { token_ = lexer_.next(); }
  bool is(std::string_view punctuation) const {
    return token_.kind == Token::Kind::punctuation && token_.text == punctuation;
  }
  bool is_word(std::string_view word) const {
    return token_.kind == Token::Kind::word && token_.text == word;
  }
  std::string found() const {
    return token_.kind == Token::Kind::end ? "the end of the file"
                                           : fmt::format("\"{}\"", shown(token_.text));
  }
  void expect(std::string_view punctuation) {
    if (!is(punctuation)) fail(token_.where, found(), fmt::format("\"{}\"", punctuation));
    advance();
  }
  void expect_word(std::string_view word) {
    if (!is_word(word)) fail(token_.where, found(), std::string(word));
    advance();
  }
  std::string take_word() {
    if (token_.kind != Token::Kind::word) fail(token_.where, found(), "a word");
    std::string word = token_.text;
    advance();
    return word;
  }
  std::string take_name() {
    if (token_.kind != Token::Kind::word && token_.kind != Token::Kind::string)
      fail(token_.where, found(), "a name");
    std::string word = token_.text;
    advance();
    return word;
  }
  // What a signal or group says of itself. Base and WFCMap give its data another meaning.
  void read_attributes() {
    const std::size_t where = token_.where;
    expect("{");
    for (std::size_t depth = 1; depth != 0; advance()) {
      if (token_.kind == Token::Kind::end) fail(where, "a block left open", "\"}\"");
      if (is_word("Base") || is_word("WFCMap"))
        fail(token_.where, found(), "data that has a waveform character a signal");
      if (is("{")) ++depth;
      if (is("}") && --depth == 0) break;
    }
    expect("}");
  }
  void skip_block() {
    const std::size_t where = token_.where;
    expect("{");
    for (std::size_t depth = 1; depth != 0; advance()) {
      if (token_.kind == Token::Kind::end) fail(where, "a block left open", "\"}\"");
      if (is("{")) ++depth;
      if (is("}") && --depth == 0) break;
    }
    expect("}");
  }

  void top_block() {
    const std::size_t where = token_.where;
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
      if (!file_.bursts.emplace(name, read_burst()).second)
        fail(where, fmt::format("PatternBurst \"{}\" again", shown(name)), "each once");
    } else if (word == "PatternExec") {
      if (!is("{")) take_name();
      read_exec(where);
    } else if (word == "Procedures" || word == "MacroDefs") {
      const std::string name = is("{") ? std::string() : take_name();
      if (word == "Procedures")
        read_routines("procedure", file_.procedures[name]);
      else
        read_routines("macro", file_.macros[name]);
    } else if (word == "Pattern") {
      const std::string name = take_name();
      expect("{");
      if (!file_.patterns.emplace(name, statements()).second)
        fail(where, fmt::format("pattern \"{}\" again", shown(name)), "each once");
    } else if (word == "Header") {
      read_header();
    } else if (word == "Include") {
      read_include();
    } else if (word == "Ann" || word == "UserKeywords" || word == "Spec" || word == "Selector" ||
               word == "Environment") {
      while (!is("{") && !is(";") && token_.kind != Token::Kind::end) advance();
      if (is("{"))
        skip_block();
      else
        expect(";");
    } else {
      fail(where, fmt::format("\"{}\"", word),
           "a block of STIL (Signals, SignalGroups, Timing, Pattern ...)");
    }
  }

  // Include "file" IfNeed BLOCK; the condition is left to what can't be defined twice.
  void read_include() {
    const std::size_t where = token_.where;
    const std::string name = take_name();
    while (!is(";") && token_.kind != Token::Kind::end) advance();
    expect(";");
    if (!include_)
      fail(where, fmt::format("Include \"{}\"", shown(name)), "no other file to be needed by this text");
    const std::filesystem::path path =
        (std::filesystem::path(file_.source_of(where).name).parent_path() / name).lexically_normal();
    if (std::find(including_.begin(), including_.end(), path) != including_.end())
      fail(where, fmt::format("Include of \"{}\" from within itself", shown(name)), "another file");
    if (including_.size() >= kMostNested)
      fail(where, fmt::format("Include {} deep", including_.size()), fmt::format("at most {}", kMostNested));
    std::string text;
    try {
      text = include_(path);
    } catch (const UserError& error) {
      fail(where, error.what(), "a file that can be read");
    }
    file_.sources.push_back({file_.text.size(), path.string()});
    file_.text += without_byte_order_mark(text);
    std::vector<std::filesystem::path> including = including_;
    including.push_back(path);
    Reader(file_, include_, std::move(including)).read();
  }

  void read_header() {
    expect("{");
    while (!is("}")) {
      if (token_.kind == Token::Kind::end) fail(token_.where, found(), "\"}\"");
      const bool title = is_word("Title");
      advance();
      if (title && token_.kind == Token::Kind::string) file_.title = shown(token_.text);
      if (is("{")) skip_block();
    }
    expect("}");
  }

  void read_signals() {
    if (!file_.tables.empty()) fail(token_.where, "Signals after Timing", "all signals before it");
    expect("{");
    while (!is("}")) {
      const std::size_t where = token_.where;
      const std::string name = take_name();
      if (!is_plain_name(name))
        fail(where, fmt::format("signal \"{}\"", shown(name)), "a name without blanks, quotes, \\, % and `");
      const std::string direction = take_word();
      if (direction != "In" && direction != "Out")
        fail(where, fmt::format("signal \"{}\" {}", name, direction), "In or Out");
      if (!file_.signal.emplace(name, file_.signals.size()).second)
        fail(where, fmt::format("signal \"{}\" again", name), "each signal once");
      file_.groups[name] = {file_.signals.size()};
      file_.signals.push_back({name, direction == "In"});
      if (is("{"))
        read_attributes();
      else
        expect(";");
    }
    expect("}");
  }

  // Signals of an expression 'a + b - c'.
  std::vector<std::size_t> expression(const std::string& text, std::size_t where) const {
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
        for (const std::size_t s : file_.members(text.substr(begin, end - begin), where)) {
          if (sign == '+')
            result.push_back(s);
          else
            result.erase(std::remove(result.begin(), result.end(), s), result.end());
        }
        if (result.size() > kMostMembers)
          fail(where, "a group of more signals than this program takes",
               fmt::format("at most {}", kMostMembers));
        i = quote ? end + 1 : end;
      }
    }
    return result;
  }
  void read_groups() {
    expect("{");
    while (!is("}")) {
      const std::size_t where = token_.where;
      const std::string name = take_name();
      expect("=");
      if (token_.kind != Token::Kind::time) fail(token_.where, found(), "signals in single quotes");
      const auto [group, is_new] = file_.groups.emplace(name, expression(token_.text, where));
      if (!is_new && group->second != expression(token_.text, where))
        fail(where, fmt::format("group \"{}\" again with other signals", shown(name)), "each once");
      advance();
      if (is("{"))
        read_attributes();
      else
        expect(";");
    }
    expect("}");
  }

  // '100ns', '5 ns + 0.1us': times that are added and subtracted.
  double time_ns(const Token& token) const {
    std::string_view rest = token.text;
    const auto skip_blanks = [&] {
      rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
    };
    skip_blanks();
    double sum = 0.0;
    double sign = 1.0;
    for (bool more = true; more;) {
      const std::size_t digits = length_of_number(rest);
      const auto value = number_in(rest.substr(0, digits), 0.0, kMostTime);
      rest.remove_prefix(digits);
      skip_blanks();
      const std::size_t letters = std::min(rest.find_first_of(" \t\r\n+-"), rest.size());
      const auto unit = std::find_if(kTimeUnits.begin(), kTimeUnits.end(),
                                     [&](const auto& u) { return u.first == rest.substr(0, letters); });
      if (token.kind != Token::Kind::time || !value || unit == kTimeUnits.end()) fail_time(token);
      sum += sign * *value * unit->second;
      rest.remove_prefix(letters);
      skip_blanks();
      more = !rest.empty();
      if (more && rest[0] != '+' && rest[0] != '-') fail_time(token);
      if (more) {
        sign = rest[0] == '-' ? -1.0 : 1.0;
        rest.remove_prefix(1);
        skip_blanks();
      }
    }
    return sum;
  }
  [[noreturn]] void fail_time(const Token& token) const {
    fail(token.where,
         fmt::format("{} '{}'", token.kind == Token::Kind::time ? "time" : "no time", shown(token.text)),
         "numbers with s, ms, us, ns, ps or fs in single quotes, as '100ns' or '5ns + 20ns'");
  }

  void read_timing() {
    expect("{");
    while (!is("}")) {
      const std::size_t at_table = token_.where;
      expect_word("WaveformTable");
      const std::string name = take_name();
      WaveformTable table;
      table.of_signal.resize(file_.signals.size());
      expect("{");
      while (!is("}")) {
        const std::size_t where = token_.where;
        const std::string word = take_word();
        if (word == "Period") {
          table.period_ns = time_ns(token_);
          advance();
          expect(";");
        } else if (word == "Waveforms") {
          read_waveforms(table);
        } else {
          fail(where, fmt::format("\"{}\"", word), "Period or Waveforms");
        }
      }
      expect("}");
      if (table.period_ns <= 0)
        fail(token_.where, fmt::format("no Period in WaveformTable \"{}\"", name), "one above 0");
      for (const Waveform& waveform : table.waveforms) {
        for (const PinEvent& event : waveform.events) {
          if (event.ns >= table.period_ns)
            fail(waveform.where,
                 fmt::format("an edge at {} ns in waveform {} of \"{}\"", event.ns, waveform.character, name),
                 fmt::format("one within the period of {} ns", table.period_ns));
        }
      }
      if (!file_.tables.emplace(name, std::move(table)).second)
        fail(at_table, fmt::format("WaveformTable \"{}\" again", shown(name)),
             "each once in all Timing blocks");
    }
    expect("}");
  }
  void read_waveforms(WaveformTable& table) {
    expect("{");
    while (!is("}")) {
      const std::size_t where = token_.where;
      const std::vector<std::size_t> signals = file_.members(take_name(), where);
      expect("{");
      while (!is("}")) {
        const std::size_t at_characters = token_.where;
        const std::string characters = take_word();
        if (characters.size() > kMostCharacters)
          fail(where, fmt::format("{} waveform characters", characters.size()),
               fmt::format("at most {}", kMostCharacters));
        expect("{");
        std::vector<std::vector<PinEvent>> lists(characters.size());
        while (!is("}")) {
          const double at = time_ns(token_);
          advance();
          const std::string events = event_letters(take_word());
          if (events.size() != 1 && events.size() != characters.size())
            fail(token_.where, fmt::format("events {} for characters {}", events, characters),
                 "one event, or one a character");
          for (std::size_t i = 0; i < characters.size(); ++i) {
            const char event = events[events.size() == 1 ? 0 : i];
            if (std::string_view("DUZPNLHXTlhxt").find(event) == std::string_view::npos)
              fail(token_.where, fmt::format("event {}", event), "D U Z P N, or L H X T");
            if (!lists[i].empty() && at < lists[i].back().ns)
              fail(token_.where, fmt::format("an edge at {} ns after a later one", at), "rising times");
            lists[i].push_back({at, event});
          }
          expect(";");
        }
        expect("}");
        for (std::size_t i = 0; i < characters.size(); ++i) {
          for (const std::size_t s : signals) table.of_signal[s][characters[i]] = table.waveforms.size();
          table.waveforms.push_back({characters[i], std::move(lists[i]), at_characters + i});
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
      const std::size_t where = token_.where;
      expect("{");
      while (!is("}")) {
        if (token_.kind == Token::Kind::end) fail(where, "ScanChain left open", "\"}\"");
        const std::size_t at_word = token_.where;
        const std::string word = take_word();
        if (std::find(kChainWords.begin(), kChainWords.end(), word) == kChainWords.end())
          fail(at_word, fmt::format("\"{}\"", shown(word)),
               "a word of ScanChain (ScanLength, ScanIn, ScanOut, ScanInversion, ScanCells ...)");
        if (word == "ScanLength") length = number("ScanLength");
        if (word == "ScanIn") in = take_name();
        if (word == "ScanOut") out = take_name();
        if (word == "ScanInversion") inversion = take_word();
        if (word == "ScanCells")
          read_cells(cells, inversions);
        else if (word == "ScanCellType")
          skip_to_block_or_end();
        else
          skip_to_end();
      }
      expect("}");
      if (!cells.empty() && cells.size() != length)
        fail(where, fmt::format("{} cells in ScanChain \"{}\"", cells.size(), name),
             fmt::format("{}, its ScanLength", length));
      const std::string_view parity = inversions.size() % 2 == 0 ? "0" : "1";
      if (!cells.empty() && !inversion.empty() && inversion != parity)
        fail(where,
             fmt::format("ScanInversion {} and {} marks in the ScanCells of \"{}\"", inversion,
                         inversions.size(), name),
             fmt::format("ScanInversion {}", parity));
      for (const std::string& port : {in, out}) {
        if (!port.empty()) file_.members(port, where);
      }
      file_.longest_chain = std::max(file_.longest_chain, length);
      file_.chains.push_back({name, in, out, std::move(cells), std::move(inversions)});
    }
    expect("}");
  }
  // Names and marks, as "a" ! "b"; or { "a"; ! "b"; } - and in braces an end is not asked for.
  void read_cells(std::vector<std::string>& cells, std::vector<std::size_t>& inversions) {
    const bool braces = is("{");
    if (braces) advance();
    for (; !is("}") && token_.kind != Token::Kind::end && (braces || !is(";")); advance()) {
      if (is(";")) continue;
      if (token_.kind == Token::Kind::word && token_.text == "!")
        inversions.push_back(cells.size());
      else if (token_.kind == Token::Kind::word || token_.kind == Token::Kind::string)
        cells.push_back(token_.text);
      else
        fail(token_.where, found(), "the name of a cell or !");
    }
    expect(braces ? "}" : ";");
    if (braces && is(";")) advance();
  }
  void skip_to_end() {
    while (!is(";") && !is("}") && token_.kind != Token::Kind::end) advance();
    expect(";");
  }
  // TYPE { ... } or TYPE;
  void skip_to_block_or_end() {
    while (!is(";") && !is("{") && !is("}") && token_.kind != Token::Kind::end) advance();
    if (is("{"))
      skip_block();
    else
      expect(";");
  }
  std::size_t number(std::string_view of) {
    const std::size_t where = token_.where;
    const std::string text = take_word();
    const auto value = number_in<std::size_t>(text, 0, kMostCounted);
    if (!value)
      fail(where, fmt::format("{} \"{}\"", of, shown(text)),
           fmt::format("a whole number of at most {}", kMostCounted));
    return *value;
  }

  // One statement of a PatternBurst or of an entry of its PatList, but for the PatList.
  void read_choice(Choice& choice) {
    const std::size_t where = token_.where;
    const std::string word = take_word();
    if (word == "Procedures" || word == "MacroDefs") {
      const std::size_t at_name = token_.where;
      (word == "Procedures" ? choice.procedures : choice.macros).push_back({take_name(), "", at_name});
      expect(";");
    } else if (word == "SignalGroups" || word == "ScanStructures" || word == "Start" || word == "Stop") {
      take_name();  // all groups and chains are there for all; a tester's marks
      expect(";");
    } else if (word == "Termination") {
      skip_block();
    } else {
      fail(where, fmt::format("\"{}\"", shown(word)),
           "PatList, Procedures, MacroDefs, SignalGroups, ScanStructures, Start, Stop or Termination");
    }
  }
  Burst read_burst() {
    Burst burst;
    expect("{");
    while (!is("}")) {
      if (!is_word("PatList")) {
        read_choice(burst.choice);
        continue;
      }
      advance();
      expect("{");
      while (!is("}")) {
        BurstEntry entry;
        entry.where = token_.where;
        entry.pattern = take_name();
        if (is("{")) {
          advance();
          while (!is("}")) read_choice(entry.choice);
          advance();
        } else {
          expect(";");
        }
        burst.entries.push_back(std::move(entry));
      }
      expect("}");
    }
    expect("}");
    return burst;
  }
  // IEEE 1450-1999: a PatternExec is one test, with one PatternBurst. A file may hold several;
  // which one is run is chosen outside of it.
  void read_exec(std::size_t at_exec) {
    if (file_.has_exec)
      fail(at_exec, "a second PatternExec", "one: a file runs as one test; take the others out");
    file_.has_exec = true;
    expect("{");
    while (!is("}")) {
      const std::size_t where = token_.where;
      const std::string word = take_word();
      const std::string name = take_name();
      if (word == "PatternBurst") {
        if (!file_.executed.empty())
          fail(where, fmt::format("a second PatternBurst \"{}\" in the PatternExec", shown(name)), "one");
        file_.executed.push_back({name, "", where});
      }
      expect(";");
    }
    expect("}");
  }

  void read_routines(std::string_view kind, Routines& into) {
    expect("{");
    while (!is("}")) {
      const std::size_t where = token_.where;
      const std::string name = take_name();
      expect("{");
      if (!into.emplace(name, statements()).second)
        fail(where, fmt::format("{} \"{}\" again", kind, shown(name)), "each once in its block");
    }
    expect("}");
  }

  // Up to and with the closing brace.
  std::vector<Statement> statements(std::size_t depth = 0) {
    std::vector<Statement> list;
    std::string label;
    const std::size_t opened = token_.where;
    if (depth > kMostNested)
      fail(opened, fmt::format("statements {} deep", depth), fmt::format("at most {}", kMostNested));
    while (!is("}")) {
      if (token_.kind == Token::Kind::end) fail(opened, "a block left open", "\"}\"");
      const std::size_t where = token_.where;
      const bool string = token_.kind == Token::Kind::string;
      const std::string word = take_name();
      if (is(":")) {
        advance();
        label = word;
        continue;
      }
      if (string) fail(where, fmt::format("\"{}\"", word), "a statement or a label with \":\"");
      Statement statement;
      statement.where = where;
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
        statement.body = statements(depth + 1);
      } else if (word == "Loop") {
        statement.kind = Statement::Kind::loop;
        statement.count = number("Loop");
        expect("{");
        statement.body = statements(depth + 1);
      } else if (word == "Stop") {
        statement.kind = Statement::Kind::stop;
        expect(";");
      } else if (word == "Ann" || word == "IddqTestPoint" || word == "BreakPoint") {
        statement.kind = Statement::Kind::note;
        if (is(";")) advance();
        if (is("{")) skip_block();
      } else {
        fail(where, fmt::format("\"{}\"", word), "W, C, F, V, Call, Macro, Shift, Loop or Stop");
      }
      list.push_back(std::move(statement));
    }
    expect("}");
    return list;
  }
  void assignments(Statement& statement) {
    expect("{");
    while (!is("}")) {
      Assignment assignment{"", "", token_.where};
      assignment.signals = take_name();
      if (!is("=")) fail(token_.where, found(), "\"=\"");
      assignment.data = lexer_.data();  // the lexer stands right behind the "="
      advance();
      statement.assignments.push_back(std::move(assignment));
    }
    expect("}");
  }

  File& file_;
  const Include& include_;
  std::vector<std::filesystem::path> including_;
  Lexer lexer_;
  Token token_;
};

}  // namespace

const std::vector<std::size_t>& File::members(const std::string& signal_or_group, std::size_t where) const {
  const auto found = groups.find(signal_or_group);
  if (found == groups.end())
    fail(where, fmt::format("signal or group \"{}\"", shown(signal_or_group)),
         "one that is defined in Signals or SignalGroups");
  return found->second;
}

const Source& File::source_of(std::size_t where) const {
  const auto behind =
      std::upper_bound(sources.begin(), sources.end(), where,
                       [](std::size_t at, const Source& source) { return at < source.begin; });
  return *std::prev(behind);
}

namespace {

// Where `where` lies in its own file. A place at the end of a file that another one follows is the other's
// first.
Place place_in(const File& file, std::size_t where) {
  const std::size_t begin = file.source_of(where).begin;
  return place_of(std::string_view(file.text).substr(begin), where - begin);
}

}  // namespace

std::string File::defect(std::size_t where, std::string_view found, std::string_view expected) const {
  return defect_at(source_of(where).name, place_in(*this, where), found, expected);
}

void File::fail(std::size_t where, const std::string& found, const std::string& expected) const {
  throw StilError(defect(where, found, expected), place_in(*this, where).line);
}

File parse(std::string_view text, const std::string& name, const Include& include) {
  File file;
  file.text = without_byte_order_mark(text);
  file.sources = {{0, name}};
  Reader(file, include, {std::filesystem::path(name).lexically_normal()}).read();
  return file;
}

}  // namespace meltstage::dft::stil
