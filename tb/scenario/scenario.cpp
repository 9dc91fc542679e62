// SPDX-License-Identifier: Apache-2.0
#include "tb/scenario/scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "base/byte_order_mark.hpp"
#include "base/number.hpp"
#include "base/place.hpp"
#include "host/register_word.hpp"
#include "tb/pins/flop_table.hpp"
#include "tb/scenario/scripted_run.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

using Words = std::vector<std::string_view>;
using Act = std::function<void(ScriptedRun&)>;

constexpr double kLongest_s = 1e6;
constexpr std::size_t kLongestFrame = 256;
constexpr double kLargestValue = 1e9;  // of any register, in its unit

Words words_of(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  Words words;
  for (std::size_t at = 0; (at = text.find_first_not_of(kBlanks, at)) != text.npos;) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

// The entry of a table that has this word; nothing for any other word.
template <class Table>
auto find(const Table& table, std::string_view word) -> decltype(&*std::begin(table)) {
  const auto found =
      std::find_if(std::begin(table), std::end(table), [&](const auto& entry) { return entry.name == word; });
  return found == std::end(table) ? nullptr : &*found;
}

struct Switch {
  std::string_view name;
  bool on;
};
constexpr std::array<Switch, 2> kOnOff{{{"on", true}, {"off", false}}};

struct SensorState {
  std::string_view name;
  SpiFaults faults;
};
constexpr std::array<SensorState, 9> kSensorStates{{
    {"sound", {}},
    {"open", {.probe = ProbeFault::open}},
    {"to_ground", {.probe = ProbeFault::short_to_ground}},
    {"to_supply", {.probe = ProbeFault::short_to_supply}},
    {"low", {.miso = MisoFault::stuck_low}},
    {"high", {.miso = MisoFault::stuck_high}},
    {"silent", {.miso = MisoFault::absent}},
    {"frozen", {.frozen = true}},
    {"wrong_bits", {.reserved_bits_wrong = true}},
}};

struct HeaterState {
  std::string_view name;
  HeaterFaults faults;
};
constexpr std::array<HeaterState, 3> kHeaterStates{{
    {"sound", {}},
    {"open", {.element_open = true}},
    {"shorted", {.switch_shorted = true}},
}};

// What a line of an event means, or the word that is wrong in it.
struct Meaning {
  Act act{};
  std::string found{}, expected{};  // both empty: the line doesn't have the words that its event takes
  bool may_fail = false;
};

Meaning wrong(std::string_view word, std::string expected) { return {{}, shown(word), std::move(expected)}; }

template <class Table>
std::string names_of(const Table& table) {
  std::string list;
  for (const auto& entry : table) list += fmt::format("{}{}", list.empty() ? "" : ", ", entry.name);
  return list;
}

Meaning send_command(const Words& words) {
  const HostCommand* command = words.size() == 1 ? find(kHostCommands, words[0]) : nullptr;
  if (command == nullptr) return {};
  return {[=](ScriptedRun& run) {
    run.send(std::string(command->name),
             write_single_register(kChipAddress, spec::kHoldingBase + spec::kRegCmd, command->code));
  }};
}

template <class Number>
std::optional<Number> hexadecimal(std::string_view digits) {
  Number value = 0;
  const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  if (problem != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

// A value in the register's unit that the register can hold. The chip judges what else it asks of it.
Meaning set_register(const Words& words) {
  if (words.size() != 3) return {};
  const std::string_view name = words[1], text = words[2];
  const spec::RegisterInfo* info = find(spec::kHolding, name);
  if (info == nullptr && find(spec::kInput, name) != nullptr)
    return wrong(name, "a register that can be written; that one is only read");
  if (info == nullptr) return wrong(name, "one of " + names_of(spec::kHolding));
  const auto value = info->unit.empty() && text.starts_with("0x")
                         ? std::optional<double>(hexadecimal<std::uint16_t>(text.substr(2)))
                         : number_in(text, -kLargestValue, kLargestValue);
  const host::RegisterWord word =
      host::register_word(*info, value.value_or(std::numeric_limits<double>::quiet_NaN()));
  if (!word.expected.empty()) return wrong(text, fmt::format("{} of {}", info->name, word.expected));
  const auto address = static_cast<std::uint16_t>(spec::kHoldingBase + (info - spec::kHolding.data()));
  std::string what =
      fmt::format("set {} {}{}{}", info->name, text, info->unit.empty() ? "" : " ", info->unit);
  return {[=](ScriptedRun& run) { run.send(what, write_single_register(kChipAddress, address, word.word)); }};
}

Meaning send_frame(const Words& words) {
  if (words.size() < 2) return {};
  if (words.size() > kLongestFrame + 1)
    return wrong(fmt::format("{} bytes", words.size() - 1),
                 fmt::format("frame of {} at most", kLongestFrame));
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const auto byte = hexadecimal<std::uint8_t>(words[i]);
    if (!byte) return wrong(words[i], "bytes from 00 to ff");
    bytes.push_back(*byte);
  }
  return {[=](ScriptedRun& run) { run.send("a frame by hand", raw_frame(bytes)); }};
}

Meaning break_sensor(const Words& words) {
  if (words.size() != 2) return {};
  const SensorState* state = find(kSensorStates, words[1]);
  if (state == nullptr) return wrong(words[1], "sensor " + names_of(kSensorStates));
  return {[=](ScriptedRun& run) { run.head().sensor().set_faults(state->faults); }};
}

Meaning break_heater(const Words& words) {
  if (words.size() != 2) return {};
  const HeaterState* state = find(kHeaterStates, words[1]);
  if (state == nullptr) return wrong(words[1], "heater " + names_of(kHeaterStates));
  return {[=](ScriptedRun& run) { run.head().plant().set_faults(run.cycle(), state->faults); }};
}

// "WORD NUMBER" within a range.
template <class Do>
Meaning with_number(const Words& words, double least, double most, std::string_view unit, Do act) {
  if (words.size() != 2) return {};
  const auto value = number_in(words[1], least, most);
  if (!value) return wrong(words[1], fmt::format("{} of {:g} to {:g}{}", words[0], least, most, unit));
  return {[=](ScriptedRun& run) { act(run, *value); }};
}

Meaning seat_sensor(const Words& words) {
  return with_number(words, 0.0, 1.0, "", [](ScriptedRun& run, double coupling) {
    run.head().plant().set_sensor_coupling(run.cycle(), coupling);
  });
}
Meaning set_supply(const Words& words) {
  return with_number(words, 0.0, 2.0, " of the nominal voltage",
                     [](ScriptedRun& run, double ratio) { run.head().set_supply_ratio(run.cycle(), ratio); });
}
Meaning set_ambient(const Words& words) {
  return with_number(words, -50.0, 100.0, " degC", [](ScriptedRun& run, double degc) {
    run.head().plant().set_ambient_degc(run.cycle(), degc);
  });
}
Meaning set_fan(const Words& words) {
  return with_number(words, 0.0, 10.0, " W/K", [](ScriptedRun& run, double loss) {
    run.head().plant().set_extra_loss_w_per_k(run.cycle(), loss);
  });
}
Meaning set_drops(const Words& words) {
  constexpr double kMostHz = 5000.0, kMostMj = 1000.0;
  if (words.size() != 3) return {};
  const auto rate_hz = number_in(words[1], 0.0, kMostHz);
  if (!rate_hz) return wrong(words[1], fmt::format("drops of 0 to {:g} Hz", kMostHz));
  const auto energy_mj = number_in(words[2], 0.0, kMostMj);
  if (!energy_mj) return wrong(words[2], fmt::format("drops of 0 to {:g} mJ each", kMostMj));
  return {[=](ScriptedRun& run) { run.drop(*rate_hz, *energy_mj * 1e-3); }};
}

// "WORD on" or "WORD off".
template <void (*kTurn)(ScriptedRun&, bool)>
Meaning turn(const Words& words) {
  if (words.size() != 2) return {};
  const Switch* position = find(kOnOff, words[1]);
  if (position == nullptr) return wrong(words[1], fmt::format("{} on or off", words[0]));
  return {[=](ScriptedRun& run) { kTurn(run, position->on); }};
}
void turn_host(ScriptedRun& run, bool on) { run.poll(on); }
void turn_clock(ScriptedRun& run, bool on) { run.run_clock(on); }
void turn_stop_button(ScriptedRun& run, bool on) { run.head().set_inhibit(on); }
void turn_reset(ScriptedRun& run, bool on) { run.head().set_reset(on); }

// A flop as flop_table.hpp names it, "guard.run_q" or "mem.staged_q[3]"; nothing for any other name.
const Flop* flop_of(std::string_view name) {
  for (const FlopBlock& block : flop_blocks()) {
    for (const FlopWords& words : block) {
      for (const Flop& flop : words) {
        if (name_of(flop) == name) return &flop;
      }
    }
  }
  return nullptr;
}

// Names to take instead of that of a flop: those of its block, else the blocks.
std::string known_flops(std::string_view name) {
  const auto block_of = [](std::string_view flop) { return flop.substr(0, flop.find('.')); };
  std::string flops, blocks;
  std::string_view last_block;
  for (const FlopBlock& block : flop_blocks()) {
    for (const FlopWords& words : block) {
      const std::string_view flop = words.front().name;
      if (block_of(flop) != last_block)
        blocks += fmt::format("{}{}", blocks.empty() ? "" : ", ", last_block = block_of(flop));
      if (block_of(flop) != block_of(name)) continue;
      flops += fmt::format("{}{}", flops.empty() ? "" : ", ", flop);
      if (words.front().is_array) flops += fmt::format("[0..{}]", words.size() - 1);
    }
  }
  return flops.empty() ? "BLOCK.FLOP with a block of " + blocks : "one of " + flops;
}

// "0", "0..7", "0, 3..5": the bits that are flops.
std::string bits_of(const Flop& flop) {
  std::string list;
  for (unsigned bit = 0; bit < 64; ++bit) {
    if ((flop.changeable >> bit & 1) == 0) continue;
    unsigned last = bit;
    while (last < 63 && (flop.changeable >> (last + 1) & 1) != 0) ++last;
    list += fmt::format("{}{}", list.empty() ? "" : ", ", bit);
    if (last > bit) list += fmt::format("..{}", last);
    bit = last;
  }
  return list;
}

Meaning flip(const Words& words) {
  if (words.size() != 3) return {};
  const Flop* flop = flop_of(words[1]);
  if (flop == nullptr) return wrong(words[1], known_flops(words[1]));
  const auto bit = number_in(words[2], 0U, 63U);
  if (!bit || (flop->changeable >> *bit & 1) == 0)
    return wrong(words[2], fmt::format("bit {} of {}", bits_of(*flop), words[1]));
  return {[=](ScriptedRun& run) {
    flop->set(run.chip(), flop->word, flop->get(run.chip(), flop->word) ^ std::uint64_t{1} << *bit);
    run.chip().mem.refresh_params();
  }};
}

Meaning try_to_ask(const Words& words);

struct Rule {
  EventUsage usage;
  Meaning (*parse)(const Words& words);
};
constexpr std::array<Rule, 22> kRules{{
    {{"set", "REGISTER VALUE", "the host writes a register, in its unit"}, set_register},
    {{"run", "", "the host switches heating on"}, send_command},
    {{"stop", "", "the host switches heating off"}, send_command},
    {{"clear", "", "the host clears latched faults"}, send_command},
    {{"hold", "", "the host takes new settings over later, all at once"}, send_command},
    {{"commit", "", "the host takes held settings over"}, send_command},
    {{"discard", "", "the host forgets held settings"}, send_command},
    {{"tune", "", "the chip tunes itself"}, send_command},
    {{"frame", "HEX HEX ...", "the host sends these bytes as they are"}, send_frame},
    {{"host", "on|off", "the host polls each second, or falls silent"}, turn<turn_host>},
    {{"sensor", "sound|open|to_ground|to_supply|low|high|silent|frozen|wrong_bits",
      "the sensor, its wires and its data line"},
     break_sensor},
    {{"seat", "0..1", "how well the sensor sits: 1 seated, 0 fallen out"}, seat_sensor},
    {{"heater", "sound|open|shorted", "the element is open, or its switch shorted"}, break_heater},
    {{"supply", "RATIO", "supply voltage over its nominal one"}, set_supply},
    {{"ambient", "DEGC", "temperature of the surroundings"}, set_ambient},
    {{"fan", "W_PER_K", "loss of the block on top of its own"}, set_fan},
    {{"drops", "HZ MILLIJOULE", "droplets a second, and the heat that each takes"}, set_drops},
    {{"estop", "on|off", "the emergency stop is pressed"}, turn<turn_stop_button>},
    {{"reset", "on|off", "the reset pin is low"}, turn<turn_reset>},
    {{"clock", "on|off", "the chip's clock runs"}, turn<turn_clock>},
    {{"flip", "FLOP BIT", "a bit of a flop is inverted, as by a particle: guard.run_q 0"}, flip},
    {{"try", "set|run|frame ...", "the host asks what may be refused, or get no answer"}, try_to_ask},
}};

bool is_asked_by_host(const Rule& rule) {
  return rule.parse == set_register || rule.parse == send_command || rule.parse == send_frame;
}

const Rule* rule_of(std::string_view word) {
  const auto* found =
      std::find_if(kRules.begin(), kRules.end(), [&](const Rule& rule) { return rule.usage.word == word; });
  return found == kRules.end() ? nullptr : found;
}

std::string usage_text(const EventUsage& usage) {
  return fmt::format("{}{}{}", usage.word, usage.arguments.empty() ? "" : " ", usage.arguments);
}

Meaning try_to_ask(const Words& words) {
  const Rule* rule = words.size() < 2 ? nullptr : rule_of(words[1]);
  if (rule == nullptr || !is_asked_by_host(*rule)) {
    std::string known;
    for (const Rule& other : kRules) {
      if (is_asked_by_host(other)) known += fmt::format("{}{}", known.empty() ? "" : ", ", other.usage.word);
    }
    return wrong(words.size() < 2 ? "nothing" : words[1], "behind try what the host asks: " + known);
  }
  Meaning meaning = rule->parse(Words(words.begin() + 1, words.end()));
  if (!meaning.act && meaning.expected.empty()) return wrong(words.back(), "try " + usage_text(rule->usage));
  meaning.may_fail = true;
  return meaning;
}

std::string all_words() {
  std::string list;
  for (const EventUsage& usage : event_usages())
    list += fmt::format("{}{}", list.empty() ? "" : ", ", usage.word);
  return list;
}

// What a line says of the head before anything happens; nothing when it is good.
std::optional<std::string> set_up(HeadConfig& head, const Words& words, Words& said) {
  const std::string_view name = words[0];
  const std::string_view value = words.size() == 2 ? words[1] : std::string_view();
  if (std::find(said.begin(), said.end(), name) != said.end()) return fmt::format("{} once", name);
  said.push_back(name);
  if (name == "head") {
    const PlantConfig* plant = find(kPlants, value);
    if (plant == nullptr) return "head " + names_of(kPlants);
    head.plant = *plant;
  } else if (name == "sensor") {
    const spec::SensorPreset* preset = find(spec::kSensorPresets, value);
    if (preset == nullptr || preset == spec::kSensorPresets.data())
      return "sensor " + names_of(std::span(spec::kSensorPresets).subspan(1));
    head.sensor = preset->name;
  } else if (name == "noise") {
    const auto sigma_degc = number_in(value, 0.0, 10.0);
    if (!sigma_degc) return "noise 0..10 degC";
    head.sensor_noise_degc = *sigma_degc;
  } else if (name == "seed") {
    const auto seed = number_in(value, std::uint64_t{0}, std::uint64_t{1} << 53);
    if (!seed) return "seed and a whole number";
    head.seed = *seed;
  } else if (name == "second_switch") {
    const Switch* position = find(kOnOff, value);
    if (position == nullptr) return "second_switch on|off";
    head.second_switch = position->on;
  } else {
    return "head, sensor, noise, seed, second_switch, or a time in seconds and what happens then";
  }
  return std::nullopt;
}

// Without blanks at its ends.
std::string_view trimmed(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(" \t\r");
  if (begin == line.npos) return {};
  return line.substr(begin, line.find_last_not_of(" \t\r") + 1 - begin);
}

}  // namespace

std::vector<EventUsage> event_usages() {
  std::vector<EventUsage> usages;
  for (const Rule& rule : kRules) usages.push_back(rule.usage);
  return usages;
}

ParsedEvent parse_event(std::string_view text, std::uint64_t cycle) {
  text = trimmed(text);
  const Words words = words_of(text);
  const Rule* rule = words.empty() ? nullptr : rule_of(words[0]);
  if (rule == nullptr) return {{}, ScenarioDefect{1, shown(text), "one of " + all_words()}};
  Meaning meaning = rule->parse(words);
  if (!meaning.expected.empty()) return {{}, ScenarioDefect{1, meaning.found, meaning.expected}};
  if (!meaning.act) return {{}, ScenarioDefect{1, shown(text), usage_text(rule->usage)}};
  return {{cycle, std::string(text), std::move(meaning.act), meaning.may_fail}, std::nullopt};
}

namespace {

// A part of the text up to a semicolon or the end of its line, and the number of that line.
struct Statement {
  std::string_view text;
  std::size_t line;
};

std::vector<Statement> statements_of(std::string_view text) {
  std::vector<Statement> statements;
  std::size_t number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = text.substr(begin, end - begin);
    line = line.substr(0, line.find('#'));
    begin = end + 1;
    ++number;
    while (!line.empty()) {
      const std::size_t semicolon = std::min(line.find(';'), line.size());
      if (const std::string_view one = trimmed(line.substr(0, semicolon)); !one.empty())
        statements.push_back({one, number});
      line.remove_prefix(std::min(semicolon + 1, line.size()));
    }
  }
  return statements;
}

bool begins_with_time(std::string_view text) {
  return text[0] == '-' || text[0] == '+' || text[0] == '.' || (text[0] >= '0' && text[0] <= '9');
}

}  // namespace

ParsedScenario parse_scenario(std::string_view text) {
  ParsedScenario parsed;
  if (text.size() > kMostScenarioBytes) {
    parsed.defect = ScenarioDefect{1, fmt::format("{} bytes", text.size()),
                                   fmt::format("a scenario of {} at most", kMostScenarioBytes)};
    return parsed;
  }
  std::vector<Event>& events = parsed.scenario.events;
  Words said;
  for (const Statement& statement : statements_of(without_byte_order_mark(text))) {
    const auto refuse = [&](std::string found, std::string expected) {
      parsed.defect = ScenarioDefect{statement.line, std::move(found), std::move(expected)};
      return parsed;
    };
    const Words words = words_of(statement.text);
    if (!begins_with_time(statement.text)) {
      if (!events.empty())
        return refuse(shown(statement.text), "a time in seconds, as the first event has one");
      if (auto expected = set_up(parsed.scenario.head, words, said))
        return refuse(shown(statement.text), *expected);
      continue;
    }
    const auto time_s = number_in(words[0], 0.0, kLongest_s);
    if (!time_s) return refuse(shown(words[0]), fmt::format("a time of 0 to {} s", kLongest_s));
    const auto cycle = static_cast<std::uint64_t>(std::llround(*time_s * spec::kClkHz));
    if (events.size() == kMostEvents)
      return refuse("another event", fmt::format("a scenario of {} at most", kMostEvents));
    ParsedEvent event = parse_event(statement.text.substr(words[0].size()), cycle);
    if (event.defect) return refuse(event.defect->found, event.defect->expected);
    event.event.line = statement.line;
    events.push_back(std::move(event.event));
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const Event& a, const Event& b) { return a.cycle < b.cycle; });
  return parsed;
}

}  // namespace meltstage::tb
