// SPDX-License-Identifier: Apache-2.0
// What happens to a virtual chip on its heated head, and when: a text of lines that a person writes, and that
// the address of the chip's page carries. docs/start/chip-in-a-page.md has the words.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cmodel/spec.hpp"
#include "tb/pins/head.hpp"

namespace meltstage::tb {

class ScriptedRun;

// Bounds of what a scenario can make its reader keep.
inline constexpr std::size_t kMostScenarioBytes = std::size_t{4} << 20;
inline constexpr std::size_t kMostEvents = 100'000;

/// A word for a command of register CMD.
struct HostCommand {
  std::string_view name;
  chip::spec::Cmd code;
};
inline constexpr std::array<HostCommand, 7> kHostCommands{{{"run", chip::spec::kCmdRun},
                                                           {"stop", chip::spec::kCmdStop},
                                                           {"clear", chip::spec::kCmdClearFault},
                                                           {"hold", chip::spec::kCmdHold},
                                                           {"tune", chip::spec::kCmdTune},
                                                           {"commit", chip::spec::kCmdCommit},
                                                           {"discard", chip::spec::kCmdDiscard}}};

/// Something that is done to the chip or what stands around it.
struct Event {
  std::uint64_t cycle;  ///< of the chip, when it is done
  std::string text;     ///< as written, without its time
  std::function<void(ScriptedRun&)> act;
  bool may_fail = false;  ///< asked of the chip with `try`: a refusal or no answer is as good
  std::size_t line = 0;   ///< of the scenario, from 1; 0 for what stands in none
};

/// The head and what happens to it, in the order of time, whatever that of the lines.
struct Scenario {
  HeadConfig head;
  std::vector<Event> events;
};

/// What is wrong in a line.
struct ScenarioDefect {
  std::size_t line;  ///< from 1
  std::string found, expected;
};

// A page has no exceptions, so a defect is a value here.
struct ParsedScenario {
  Scenario scenario;
  std::optional<ScenarioDefect> defect;  ///< the first one
};
/// Lines end with a line feed or a semicolon. What stands behind #, up to the line feed, is not looked at.
ParsedScenario parse_scenario(std::string_view text);

struct ParsedEvent {
  Event event;
  std::optional<ScenarioDefect> defect;
};
/// One thing to do at `cycle`: "set SETPOINT 110", "sensor open".
ParsedEvent parse_event(std::string_view text, std::uint64_t cycle);

/// Words that an event begins with, and what follows them.
struct EventUsage {
  std::string_view word, arguments, summary;
};
std::vector<EventUsage> event_usages();

}  // namespace meltstage::tb
