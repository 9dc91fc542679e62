// SPDX-License-Identifier: Apache-2.0
#include "tb/regress/failing_case.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/pins/flop_table.hpp"
#include "tb/stimulus/any_state.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "meltstage-case";
constexpr std::size_t kMostClocks = 1'000'000;

std::array<std::uint64_t, kChipPinCount> levels(const chip::Inputs& in) { return pin_levels(in, {}); }

// Calls `visit(pin)` for each input pin.
template <class Visit>
void for_inputs(const Visit& visit) {
  for (std::size_t pin = 0; pin < chip::spec::kInputPins; ++pin) visit(pin);
}

std::vector<std::string> difference(const chip::Chip& model, const chip::Outputs& expected,
                                    const chip::Outputs& got, const VerilatedRtl& rtl) {
  std::vector<std::string> names;
  const auto of_model = pin_levels({}, expected), of_rtl = pin_levels({}, got);
  for (std::size_t pin = chip::spec::kInputPins; pin < kChipPinCount; ++pin)
    if (of_model[pin] != of_rtl[pin]) names.emplace_back(chip::spec::kPins[pin].name);
  for (const FlopDifference& flop : rtl.differences(model)) names.push_back(flop.name);
  return names;
}

// Makes one case smaller, change by change; each is kept when the mismatch stays.
class Smaller {
 public:
  Smaller(FailingCase failing, VerilatedRtl& rtl) : case_(std::move(failing)), rtl_(rtl) {}

  FailingCase make() && {
    for (const FlopBlock& block : flop_blocks())
      if (!try_state([&](chip::Chip& chip) { reset(block, chip); }))
        for (const FlopWords& words : block) reset_words(words);
    for_inputs([&](std::size_t pin) { try_idle(pin); });
    return std::move(case_);
  }

 private:
  static void reset(const FlopWords& words, chip::Chip& chip) {
    static const chip::Chip fresh;
    for (const Flop& flop : words) flop.set(chip, flop.word, flop.get(fresh, flop.word));
  }
  static void reset(const FlopBlock& block, chip::Chip& chip) {
    for (const FlopWords& words : block) reset(words, chip);
  }

  void reset_words(const FlopWords& words) {
    if (try_state([&](chip::Chip& chip) { reset(words, chip); }) || words.size() == 1) return;
    for (const Flop& flop : words) try_state([&](chip::Chip& chip) { reset(FlopWords{flop}, chip); });
  }

  // The same flops and pins differ, in the same clock.
  bool fails(const FailingCase& changed) {
    const CaseVerdict verdict = replay(changed, rtl_);
    return verdict.clock + 1 == case_.inputs.size() && verdict.differs == case_.differs;
  }

  template <class Change>
  bool try_state(const Change& change) {
    FailingCase changed = case_;
    change(changed.state);
    changed.state.mem.refresh_params();
    if (!holds_invariants(changed.state) || !fails(changed)) return false;
    case_.state = changed.state;
    return true;
  }

  void try_idle(std::size_t pin) {
    FailingCase changed = case_;
    const std::uint64_t idle = levels({})[pin];
    for (chip::Inputs& in : changed.inputs) {
      auto values = levels(in);
      values[pin] = idle;
      in = inputs_of(values);
    }
    if (fails(changed)) case_.inputs = changed.inputs;
  }

  FailingCase case_;
  VerilatedRtl& rtl_;
};

// ---- Files ----

Json pins_json(const chip::Inputs& in) {
  static const auto idle = levels({});
  const auto now = levels(in);
  Json pins = Json::object();
  for_inputs([&](std::size_t pin) {
    if (now[pin] != idle[pin]) pins[std::string(chip::spec::kPins[pin].name)] = now[pin];
  });
  return pins;
}

// "found X, expected Y" of a file's key.
[[noreturn]] void refuse(const fs::path& path, const std::string& key, const std::string& found,
                         std::string_view expected) {
  throw UserError(
      fmt::format("{}: {}: found {}, expected {}", path.string(), shown(key), shown(found), expected));
}

std::uint64_t number_of(const fs::path& path, const std::string& key, const Json& value, std::uint64_t most) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > most)
    refuse(path, key, value.dump(), fmt::format("0 to {}", most));
  return value.get<std::uint64_t>();
}

chip::Inputs pins_from(const fs::path& path, const Json& json) {
  if (!json.is_object())
    refuse(path, "clocks", json.dump(), "a list of objects, a pin's name and level each");
  auto values = levels({});
  for (const auto& [name, level] : json.items()) {
    const auto* const end = chip::spec::kPins.begin() + chip::spec::kInputPins;
    const auto* const pin =
        std::find_if(chip::spec::kPins.begin(), end, [&n = name](const auto& p) { return p.name == n; });
    if (pin == end) refuse(path, "clocks", name, "the name of an input pin");
    values[static_cast<std::size_t>(pin - chip::spec::kPins.begin())] =
        number_of(path, name, level, ones(pin->width));
  }
  return inputs_of(values);
}

const Flop* find_flop(const std::string& name) {
  for (const FlopBlock& block : flop_blocks())
    for (const FlopWords& words : block)
      for (const Flop& flop : words)
        if (name_of(flop) == name) return &flop;
  return nullptr;
}

std::string text_of(const fs::path& path, const std::string& key, const Json& value) {
  if (!value.is_string()) refuse(path, key, value.dump(), "a text");
  return value.get<std::string>();
}

// "u_uartc.u_rx.bit_q[2]" of the RTL is "uartc.rx.bit_q" of the model, but for the word.
bool is_flop_of_rtl(std::string name) {
  name.resize(std::min(name.find('['), name.size()));
  for (std::size_t at = 0; at != std::string::npos; at = name.find('.', at + 1)) {
    const std::size_t begin = at == 0 ? 0 : at + 1;
    if (name.compare(begin, 2, "u_") == 0) name.erase(begin, 2);
  }
  for (const FlopBlock& block : flop_blocks())
    for (const FlopWords& words : block)
      for (const Flop& flop : words)
        if (flop.name == name) return true;
  return false;
}

// The name of a flop, as the RTL has it, or of an output pin.
std::string differing_name(const fs::path& path, const Json& json) {
  std::string name = text_of(path, "differs", json);
  const bool is_output =
      std::any_of(chip::spec::kPins.begin() + chip::spec::kInputPins, chip::spec::kPins.end(),
                  [&](const auto& pin) { return pin.name == name; });
  if (!is_output && !is_flop_of_rtl(name))
    refuse(path, "differs", name, "the name of a flop such as u_guard.fault_q, or of an output pin");
  return name;
}

void check_keys(const fs::path& path, const Json& json) {
  constexpr std::array<std::string_view, 5> kKeys{"format", "origin", "flops", "clocks", "differs"};
  for (const auto& [key, value] : json.items())
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end())
      refuse(path, key, "a key that no case has", fmt::format("one of: {}", fmt::join(kKeys, ", ")));
}

FailingCase case_from(const fs::path& path, const Json& json) {
  check_keys(path, json);
  FailingCase failing;
  failing.origin = text_of(path, "origin", json.value("origin", Json("")));
  const Json flops = json.value("flops", Json::object());
  if (!flops.is_object()) refuse(path, "flops", flops.dump(), "an object, a flop's name and value each");
  for (const auto& [name, value] : flops.items()) {
    const Flop* flop = find_flop(name);
    if (flop == nullptr)
      refuse(path, "flops", name, "the name of a flop such as guard.fault_q or mem.active_q[3]");
    flop->set(failing.state, flop->word, number_of(path, name, value, ones(flop->width)));
  }
  failing.state.mem.refresh_params();
  const Json clocks = json.value("clocks", Json::array());
  if (!clocks.is_array() || clocks.empty() || clocks.size() > kMostClocks)
    refuse(path, "clocks", fmt::format("{} clocks", clocks.size()), fmt::format("1 to {}", kMostClocks));
  for (const Json& clock : clocks) failing.inputs.push_back(pins_from(path, clock));
  const Json differs = json.value("differs", Json::array());
  if (!differs.is_array()) refuse(path, "differs", differs.dump(), "a list of names");
  for (const Json& name : differs) failing.differs.push_back(differing_name(path, name));
  return failing;
}

// The file's JSON, which has no key of an object twice: the parser alone would take the last of them.
Json parse(const fs::path& path, const std::string& text) {
  bool too_deep = false;
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  const auto check = [&](int depth, Json::parse_event_t event, Json& value) {
    using Event = Json::parse_event_t;
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(value.get<std::string>()).second)
      refuse(path, value.get<std::string>(), "this key twice in one object", "once");
    too_deep = too_deep || depth > static_cast<int>(kMostNested);
    return !too_deep;
  };
  const Json json = Json::parse(text, check, false);
  if (too_deep || !json.is_object() || !json.contains("format") || json["format"] != kFormat)
    throw UserError(
        fmt::format("{}: not a case, expected JSON as meltstage regress writes it", path.string()));
  return json;
}

}  // namespace

CaseVerdict replay(const FailingCase& failing, VerilatedRtl& rtl) {
  chip::Chip model = failing.state;
  rtl.load(model, failing.inputs.front());
  for (std::size_t clock = 0; clock < failing.inputs.size(); ++clock) {
    const chip::Outputs expected = model.step(failing.inputs[clock]);
    const chip::Outputs got = rtl.step(failing.inputs[clock]);
    if (got != expected || !rtl.flops_equal(model)) return {difference(model, expected, got, rtl), clock};
  }
  return {};
}

std::optional<FailingCase> shrink(const FailedStretch& stretch, const std::string& origin,
                                  VerilatedRtl& rtl) {
  rtl.set_assertions(false);  // they speak of states that a sound chip has
  const std::size_t all = stretch.inputs.size();
  for (std::size_t tail = 1;; tail = std::min(2 * tail, all)) {
    FailingCase failing{origin,
                        stretch.start,
                        {stretch.inputs.end() - static_cast<std::ptrdiff_t>(tail), stretch.inputs.end()},
                        {}};
    for (std::size_t clock = 0; clock < all - tail; ++clock) failing.state.step(stretch.inputs[clock]);
    CaseVerdict verdict = replay(failing, rtl);
    if (!verdict.differs.empty()) {
      failing.inputs.resize(verdict.clock + 1);
      failing.differs = std::move(verdict.differs);
      return Smaller(std::move(failing), rtl).make();
    }
    if (tail == all) return std::nullopt;
  }
}

std::string describe(const FailingCase& failing) {
  std::string flops = list_differences(chip::Chip{}, failing.state);
  const auto count = std::count(flops.begin(), flops.end(), '\n');
  std::string text =
      fmt::format("{} clock{} from a state that differs from reset in {} flop{}\n{}", failing.inputs.size(),
                  failing.inputs.size() == 1 ? "" : "s", count, count == 1 ? "" : "s", flops);
  constexpr std::size_t kShown = 20;
  for (std::size_t clock = 0; clock < failing.inputs.size() && clock < kShown; ++clock)
    text += fmt::format("  pins before clock {}: {}\n", clock, pins_json(failing.inputs[clock]).dump());
  if (failing.inputs.size() > kShown)
    text += fmt::format("  ... {} clocks more\n", failing.inputs.size() - kShown);
  return text;
}

void write_case(const fs::path& path, const FailingCase& failing) {
  Json flops = Json::object(), clocks = Json::array();
  const chip::Chip fresh;
  for (const FlopBlock& block : flop_blocks())
    for (const FlopWords& words : block)
      for (const Flop& flop : words)
        if (const std::uint64_t value = flop.get(failing.state, flop.word);
            value != flop.get(fresh, flop.word))
          flops[name_of(flop)] = value;
  for (const chip::Inputs& in : failing.inputs) clocks.push_back(pins_json(in));
  const Json json = {{"format", kFormat},
                     {"origin", failing.origin},
                     {"flops", flops},
                     {"clocks", clocks},
                     {"differs", failing.differs}};
  write_whole(path, json.dump(1) + "\n");
}

FailingCase read_case(const fs::path& path) {
  const std::string text = read_file(path, "a case of meltstage regress (JSON)");
  try {
    return case_from(path, parse(path, text));
  } catch (const nlohmann::json::exception& error) {
    throw UserError(fmt::format("{}: unexpected content ({})", path.string(), error.what()));
  }
}

}  // namespace meltstage::tb
