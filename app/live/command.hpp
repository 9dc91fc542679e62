// SPDX-License-Identifier: Apache-2.0
// What a page asks to be done, and what became of it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "host/register_map.hpp"

namespace meltstage::app::live {

struct Set {
  const host::Register* reg;
  double value;  // in its unit
};
struct Run {};
struct Stop {};
struct ClearFaults {};
struct Tune {};
/// What happens to a virtual head, in the words of a scenario: "sensor open".
struct BenchEvent {
  std::string text;
};
/// Chip time over real time of a virtual chip; 0 holds it.
inline constexpr double kFastest = 1000.0;
struct Speed {
  double ratio;
};

struct Command {
  std::string id;  // the asker's own; what bears the same one is the same command
  std::variant<Set, Run, Stop, ClearFaults, Tune, BenchEvent, Speed> what;
  std::string text;  // for people: "set SETPOINT 110 degC"
};

inline bool is_stop(const Command& command) { return std::holds_alternative<Stop>(command.what); }

/// The command in a JSON object such as {"id":"a1","do":"set","register":"SETPOINT","value":110}. `do` is
/// set, run, stop, clear, tune, event (with "event") or speed (with "ratio"). Throws UserError for anything
/// else, for a register or value that the chip doesn't have, and for one that would take the chip off this
/// line.
Command parse_command(std::string_view json);

enum class Outcome : std::uint8_t {
  waiting,
  done,
  refused,  // nothing was changed
  unknown   // the chip fell silent: it may have been done
};

struct Answer {
  std::string id;
  std::string asked;  // the command's text
  Outcome outcome;
  std::string text;  // what was done, or why not
};

std::string_view outcome_name(Outcome outcome);

}  // namespace meltstage::app::live
