// SPDX-License-Identifier: Apache-2.0
// `meltstage chip serve`: the virtual chip on its heated head, behind a pseudo-terminal that any Modbus
// master can open.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace meltstage::app {

struct ServeOptions {
  std::filesystem::path port;         // name of the link to the pseudo-terminal
  bool rtl = false;                   // the RTL answers, the model beside it in lockstep
  std::optional<double> speed = 1.0;  // chip time over real time; nothing: as fast as it goes
  std::string plant = "PH-1";
  std::filesystem::path vcd;  // the chip's pins; empty: none
  std::string command;        // as typed, for the report of a mismatch
};

// "4", "0.5" or "max"; throws UserError for anything else.
std::optional<double> parse_speed(const std::string& text);

// Serves until SIGINT or SIGTERM. Returns the exit status: 0 then, 1 when RTL and model differ. Throws
// UserError for wrong input.
int serve_chip(const ServeOptions& options);

}  // namespace meltstage::app
