// SPDX-License-Identifier: Apache-2.0
#include "tb/scenario/scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "base/number.hpp"
#include "base/place.hpp"
#include "tb/pins/flop_table.hpp"
#include "tb/scenario/scripted_run.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

using Words = std::vector<std::string_view>;
using Act = std::function<void(ScriptedRun&)>;

constexpr double kLongest_s = 1e6;
constexpr std::size_t kLongestFrame = 256;

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

struct Command {
  std::string_view name;
  spec::Cmd code;
};
constexpr std::array<Command, 7> kCommands{{{"run", spec::kCmdRun},
                                            {"stop", spec::kCmdStop},
                                            {"clear", spec::kCmdClearFault},
                                            {"hold", spec::kCmdHold},
                                            {"tune", spec::kCmdTune},
                                            {"commit", spec::kCmdCommit},
                                            {"discard", spec::kCmdDiscard}}};

Act send_command(const Words& words) {
  const Command* command = words.size() == 1 ? find(kCommands, words[0]) : nullptr;
  if (command == nullptr) return {};
  return [=](ScriptedRun& run) {
    run.send(std::string(command->name),
             write_single_register(kChipAddress, spec::kHoldingBase + spec::kRegCmd, command->code));
  };
}

// A value in the register's unit. The chip judges its range; here it must fit the word.
Act set_register(const Words& words) {
  const spec::RegisterInfo* info = words.size() == 3 ? find(spec::kHolding, words[1]) : nullptr;
  if (info == nullptr) return {};
  const double largest = (info->is_signed ? 32767 : 65535) * info->scale;
  const auto value = number_in(words[2], info->is_signed ? -32768 * info->scale : 0.0, largest);
  if (!value) return {};
  const auto word = static_cast<std::uint16_t>(std::lround(*value / info->scale));
  const auto address = static_cast<std::uint16_t>(spec::kHoldingBase + (info - spec::kHolding.data()));
  std::string what =
      fmt::format("set {} {}{}{}", info->name, words[2], info->unit.empty() ? "" : " ", info->unit);
  return [=](ScriptedRun& run) { run.send(what, write_single_register(kChipAddress, address, word)); };
}

std::optional<std::uint8_t> hexadecimal_byte(std::string_view word) {
  unsigned value = 0;
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value, 16);
  if (problem != std::errc() || end != word.data() + word.size() || value > 255) return std::nullopt;
  return static_cast<std::uint8_t>(value);
}

Act send_frame(const Words& words) {
  if (words.size() < 2 || words.size() > kLongestFrame + 1) return {};
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const auto byte = hexadecimal_byte(words[i]);
    if (!byte) return {};
    bytes.push_back(*byte);
  }
  return [=](ScriptedRun& run) { run.send("a frame by hand", raw_frame(bytes)); };
}

Act break_sensor(const Words& words) {
  const SensorState* state = words.size() == 2 ? find(kSensorStates, words[1]) : nullptr;
  if (state == nullptr) return {};
  return [=](ScriptedRun& run) { run.head().sensor().set_faults(state->faults); };
}

Act break_heater(const Words& words) {
  const HeaterState* state = words.size() == 2 ? find(kHeaterStates, words[1]) : nullptr;
  if (state == nullptr) return {};
  return [=](ScriptedRun& run) { run.head().plant().set_faults(run.cycle(), state->faults); };
}

// "WORD NUMBER" within a range.
std::optional<double> only_number(const Words& words, double least, double most) {
  return words.size() == 2 ? number_in(words[1], least, most) : std::nullopt;
}

Act seat_sensor(const Words& words) {
  const auto coupling = only_number(words, 0.0, 1.0);
  if (!coupling) return {};
  return [=](ScriptedRun& run) { run.head().plant().set_sensor_coupling(run.cycle(), *coupling); };
}
Act set_supply(const Words& words) {
  const auto ratio = only_number(words, 0.0, 2.0);
  if (!ratio) return {};
  return [=](ScriptedRun& run) { run.head().set_supply_ratio(run.cycle(), *ratio); };
}
Act set_ambient(const Words& words) {
  const auto degc = only_number(words, -50.0, 100.0);
  if (!degc) return {};
  return [=](ScriptedRun& run) { run.head().plant().set_ambient_degc(run.cycle(), *degc); };
}
Act set_fan(const Words& words) {
  const auto loss = only_number(words, 0.0, 10.0);
  if (!loss) return {};
  return [=](ScriptedRun& run) { run.head().plant().set_extra_loss_w_per_k(run.cycle(), *loss); };
}
Act set_drops(const Words& words) {
  if (words.size() != 3) return {};
  const auto rate_hz = number_in(words[1], 0.0, 5000.0);
  const auto energy_mj = number_in(words[2], 0.0, 1000.0);
  if (!rate_hz || !energy_mj) return {};
  return [=](ScriptedRun& run) { run.drop(*rate_hz, *energy_mj * 1e-3); };
}

// "WORD on" or "WORD off".
template <void (*kTurn)(ScriptedRun&, bool)>
Act turn(const Words& words) {
  const Switch* position = words.size() == 2 ? find(kOnOff, words[1]) : nullptr;
  if (position == nullptr) return {};
  return [=](ScriptedRun& run) { kTurn(run, position->on); };
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

Act flip(const Words& words) {
  const Flop* flop = words.size() == 3 ? flop_of(words[1]) : nullptr;
  const auto bit = words.size() == 3 ? number_in(words[2], 0U, 63U) : std::nullopt;
  if (flop == nullptr || !bit || (flop->changeable >> *bit & 1) == 0) return {};
  return [=](ScriptedRun& run) {
    flop->set(run.chip(), flop->word, flop->get(run.chip(), flop->word) ^ std::uint64_t{1} << *bit);
    run.chip().mem.refresh_params();
  };
}

struct Rule {
  EventUsage usage;
  Act (*parse)(const Words& words);
};
constexpr std::array<Rule, 21> kRules{{
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
}};

const Rule* rule_of(std::string_view word) {
  const auto* found =
      std::find_if(kRules.begin(), kRules.end(), [&](const Rule& rule) { return rule.usage.word == word; });
  return found == kRules.end() ? nullptr : found;
}

std::string usage_text(const EventUsage& usage) {
  return fmt::format("{}{}{}", usage.word, usage.arguments.empty() ? "" : " ", usage.arguments);
}

std::string all_words() {
  std::string list;
  for (const EventUsage& usage : event_usages())
    list += fmt::format("{}{}", list.empty() ? "" : ", ", usage.word);
  return list;
}

template <class Table>
std::string names_of(const Table& table) {
  std::string list;
  for (const auto& entry : table) list += fmt::format("{}{}", list.empty() ? "" : ", ", entry.name);
  return list;
}

// What a line says of the head before anything happens; nothing when it is good.
std::optional<std::string> set_up(HeadConfig& head, const Words& words) {
  const std::string_view name = words[0];
  const std::string_view value = words.size() == 2 ? words[1] : std::string_view();
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
  Act act = rule->parse(words);
  if (!act) return {{}, ScenarioDefect{1, shown(text), usage_text(rule->usage)}};
  return {{cycle, std::string(text), std::move(act)}, std::nullopt};
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
  std::vector<Event>& events = parsed.scenario.events;
  for (const Statement& statement : statements_of(text)) {
    const auto refuse = [&](std::string found, std::string expected) {
      parsed.defect = ScenarioDefect{statement.line, std::move(found), std::move(expected)};
      return parsed;
    };
    const Words words = words_of(statement.text);
    if (!begins_with_time(statement.text)) {
      if (!events.empty())
        return refuse(shown(statement.text), "a time in seconds, as the first event has one");
      if (auto expected = set_up(parsed.scenario.head, words))
        return refuse(shown(statement.text), *expected);
      continue;
    }
    const auto time_s = number_in(words[0], 0.0, kLongest_s);
    if (!time_s) return refuse(shown(words[0]), fmt::format("a time of 0 to {} s", kLongest_s));
    const auto cycle = static_cast<std::uint64_t>(std::llround(*time_s * spec::kClkHz));
    ParsedEvent event = parse_event(statement.text.substr(words[0].size()), cycle);
    if (event.defect) return refuse(event.defect->found, event.defect->expected);
    events.push_back(std::move(event.event));
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const Event& a, const Event& b) { return a.cycle < b.cycle; });
  return parsed;
}

}  // namespace meltstage::tb
