// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "asic/dft/files/stil_blocks.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::dft::stil {

namespace {

constexpr std::size_t kMostCharacters = 62;  // of a waveform: letters and digits
constexpr double kMostTime = 1e9;            // in any unit
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

}  // namespace

double Reader::time_ns(const Token& token) const {
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

void Reader::fail_time(const Token& token) const {
  fail(token.where,
       fmt::format("{} '{}'", token.kind == Token::Kind::time ? "time" : "no time", shown(token.text)),
       "numbers with s, ms, us, ns, ps or fs in single quotes, as '100ns' or '5ns + 20ns'");
}

void Reader::read_timing() {
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

void Reader::read_waveforms(WaveformTable& table) {
  expect("{");
  while (!is("}")) {
    const std::size_t where = token_.where;
    const std::vector<std::size_t> signals = file_.members(take_signals(), where);
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

}  // namespace meltstage::dft::stil
