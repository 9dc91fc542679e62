// SPDX-License-Identifier: Apache-2.0
#include "app/live/command.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::app::live {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kLongestId = 64;
constexpr std::size_t kLongestEvent = 1024;

// The chip would speak otherwise on its line, and this server's next poll would find nobody.
constexpr std::array<std::string_view, 3> kOfTheLine{"ADDRESS", "BAUD", "FORMAT"};

const std::string& text_of(const Json& object, const char* key, std::size_t longest) {
  const auto at = object.find(key);
  if (at == object.end() || !at->is_string())
    throw UserError(
        fmt::format("command: found no text \"{0}\", expected one such as \"{0}\": \"...\"", key));
  const auto& text = at->get_ref<const std::string&>();
  if (text.empty() || text.size() > longest)
    throw UserError(fmt::format("command: {}: found {} bytes, expected 1 to {}", key, text.size(), longest));
  return text;
}

double number_of(const Json& object, const char* key) {
  const auto at = object.find(key);
  if (at == object.end() || !at->is_number() || !std::isfinite(at->get<double>()))
    throw UserError(fmt::format("command: found no number \"{0}\", expected one such as \"{0}\": 110", key));
  return at->get<double>();
}

void allow_keys(const Json& object, std::span<const std::string_view> known) {
  for (const auto& [key, value] : object.items())
    if (key != "id" && key != "do" && std::find(known.begin(), known.end(), key) == known.end())
      throw UserError(
          fmt::format("command: found \"{}\", expected {}", shown(key),
                      known.empty() ? "id and do alone" : fmt::format("id, do, {}", fmt::join(known, ", "))));
}

Command set_command(const Json& object) {
  allow_keys(object, std::array<std::string_view, 2>{"register", "value"});
  const host::Register& reg = host::find_register(text_of(object, "register", kLongestId));
  if (std::find(kOfTheLine.begin(), kOfTheLine.end(), reg.name) != kOfTheLine.end())
    throw UserError(
        fmt::format("{}: would take the chip off this line, expected another register; use "
                    "`meltstage chip set`, then start `meltstage live` anew",
                    reg.name));
  if (reg.name == "CMD") throw UserError("CMD: is the command word, expected run, stop, clear or tune");
  const double value = number_of(object, "value");
  host::to_raw(reg, value);  // refused before anything is sent
  return {"", Set{&reg, value},
          fmt::format("set {} {:g}{}{}", reg.name, value, reg.unit.empty() ? "" : " ", reg.unit)};
}

template <class What>
Command plain_command(const Json& object, std::string_view word) {
  allow_keys(object, {});
  return {"", What{}, std::string(word)};
}

Command event_command(const Json& object) {
  allow_keys(object, std::array<std::string_view, 1>{"event"});
  const std::string& event = text_of(object, "event", kLongestEvent);
  return {"", BenchEvent{event}, shown(event)};
}

Command speed_command(const Json& object) {
  allow_keys(object, std::array<std::string_view, 1>{"ratio"});
  const double ratio = number_of(object, "ratio");
  if (!(ratio >= 0.0 && ratio <= kFastest))
    throw UserError(fmt::format("speed: found {:g}, expected 0 (held) to {:g}", ratio, kFastest));
  return {"", Speed{ratio}, ratio == 0.0 ? "hold the time" : fmt::format("speed {:g}", ratio)};
}

Command without_id(const Json& object) {
  const std::string& word = text_of(object, "do", kLongestId);
  if (word == "set") return set_command(object);
  if (word == "run") return plain_command<Run>(object, word);
  if (word == "stop") return plain_command<Stop>(object, word);
  if (word == "clear") return plain_command<ClearFaults>(object, word);
  if (word == "tune") return plain_command<Tune>(object, word);
  if (word == "event") return event_command(object);
  if (word == "speed") return speed_command(object);
  throw UserError(fmt::format(
      "command: found do \"{}\", expected one of: set, run, stop, clear, tune, event, speed", shown(word)));
}

}  // namespace

Command parse_command(std::string_view json) {
  std::set<std::string> keys;
  const auto each_once = [&](int depth, Json::parse_event_t event, const Json& parsed) {
    if (depth == 1 && event == Json::parse_event_t::key && !keys.insert(parsed.get<std::string>()).second)
      throw UserError(fmt::format("command: found \"{}\" twice, expected it once",
                                  shown(parsed.get_ref<const std::string&>())));
    return true;
  };
  const Json object = Json::parse(json, each_once, false);
  if (!object.is_object())
    throw UserError(
        fmt::format("command: found {}, expected a JSON object such as {{\"id\":\"1\",\"do\":\"run\"}}",
                    object.is_discarded() ? "no JSON" : object.type_name()));
  const std::string& id = text_of(object, "id", kLongestId);
  Command command = without_id(object);
  command.id = id;
  return command;
}

std::string_view outcome_name(Outcome outcome) {
  switch (outcome) {
    case Outcome::waiting:
      return "waiting";
    case Outcome::done:
      return "done";
    case Outcome::refused:
      return "refused";
    case Outcome::unknown:
      return "unknown";
  }
  return "";
}

}  // namespace meltstage::app::live
