// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "app/chip/chip_play.hpp"
#include "app/chip/chip_run.hpp"
#include "app/chip/chip_serve.hpp"
#include "app/chip/chip_tune.hpp"
#include "app/chip/chip_watch.hpp"
#include "app/chip/connection_options.hpp"
#include "app/chip/saved_registers.hpp"
#include "app/json_output.hpp"
#include "app/number_range.hpp"
#include "app/verbs.hpp"
#include "base/error.hpp"
#include "base/output_file.hpp"
#include "cmodel/spec.hpp"
#include "host/controller.hpp"

namespace meltstage::app {

namespace {

// What a command of the driver may ask for.
struct Asked {
  AskedConnection line;
  std::vector<std::string> names;
  std::vector<std::string> settings;
  std::string file;
  bool json = false;
  WatchOptions watch;
  double watch_for_s = 0.0;
};

bool is_hexadecimal(std::string_view text) { return text.starts_with("0x") || text.starts_with("0X"); }

// A number as people write it: 110, -5.5, 0x1F.
std::optional<double> number(std::string_view text) {
  double value = 0.0;
  if (is_hexadecimal(text)) {
    unsigned bits = 0;
    const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), bits, 16);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return bits;
  }
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

host::Setting parse_setting(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw UserError(fmt::format("set: found \"{}\", expected NAME=VALUE such as SETPOINT=110", text));
  const host::Register& reg = host::find_register(text.substr(0, equals));
  const std::string value_text = text.substr(equals + 1);
  if (is_hexadecimal(value_text) && reg.scale != 1.0) {  // a word of the register, or a number of its unit?
    throw UserError(
        fmt::format("{}: found \"{}\", expected a decimal number{}{}: the register's word is in {:g} {}",
                    reg.name, value_text, reg.unit.empty() ? "" : " in ", reg.unit, reg.scale, reg.unit));
  }
  const auto value = number(value_text);
  if (!value) {
    throw UserError(fmt::format("{}: found \"{}\", expected a number{}{}", reg.name, value_text,
                                reg.unit.empty() ? "" : " in ", reg.unit));
  }
  host::to_raw(reg, *value);  // refused before anything is sent
  return {&reg, *value};
}

// A register without a value, such as PV before the first sample, is null.
void print_registers_json(const std::vector<const host::Register*>& registers,
                          const std::vector<std::uint16_t>& words) {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < registers.size(); ++i) {
    const host::Register& r = *registers[i];
    const bool has_value = !host::is_no_value(r, words[i]);
    list.push_back({{"name", r.name},
                    {"value", has_value ? nlohmann::ordered_json(host::to_unit(r, words[i])) : nullptr},
                    {"unit", r.unit},
                    {"word", words[i]},
                    {"meaning", host::meaning(r, words[i])}});
  }
  print_json(list);
}

int read_registers(host::Controller& controller, const std::vector<std::string>& names, bool json) {
  std::vector<const host::Register*> wanted;
  for (const std::string& name : names) wanted.push_back(&host::find_register(name));
  if (names.empty()) {
    for (const host::Register& r : host::registers()) {
      if (r.readable) wanted.push_back(&r);
    }
  }
  const std::vector<std::uint16_t> words = controller.read(wanted);
  if (json) {
    print_registers_json(wanted, words);
    return 0;
  }
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const host::Register& r = *wanted[i];
    std::string line = fmt::format("{:<19} {:>12} {:<7} {}", r.name, host::value_text(r, words[i]), r.unit,
                                   host::meaning(r, words[i]));
    line.erase(line.find_last_not_of(' ') + 1);
    fmt::print("{}\n", line);
  }
  return 0;
}

// The chip judges a set-point by the limit, and not a limit by the set-point.
void tell_limit_below_setpoint(host::Controller& controller) {
  const double setpoint_degc = controller.read(host::find_register("SETPOINT"));
  const double limit_degc = controller.read(host::find_register("T_MAX"));
  const double most_degc = limit_degc - chip::spec::kSetpointMargin * 0.1;
  if (setpoint_degc > most_degc + 1e-6)
    fmt::print(
        "SETPOINT is {:.1f} degC, too near T_MAX of {:.1f} degC: heating trips OverTemp; set SETPOINT to "
        "{:.1f} degC at most\n",
        setpoint_degc, limit_degc, std::max(most_degc, 0.0));
}

// A register holds whole steps only. Where what it holds looks as it was typed, nothing is told.
void tell_rounded(const std::vector<host::Setting>& settings) {
  for (const auto& [reg, value] : settings) {
    const std::uint16_t raw = host::to_raw(*reg, value);
    const std::string held = host::value_text(*reg, raw);
    if (std::abs(host::to_unit(*reg, raw) - value) <= 1e-6 * reg->scale || held == fmt::format("{:g}", value))
      continue;
    fmt::print("{}: {:.9g} is written as {}{}{}, the nearest that it holds\n", reg->name, value, held,
               reg->unit.empty() ? "" : " ", reg->unit);
  }
}

int set_registers(host::Controller& controller, const std::vector<host::Setting>& settings) {
  controller.check_identity();
  controller.write(settings);
  const host::Register& limit = host::find_register("T_MAX");
  if (std::any_of(settings.begin(), settings.end(), [&](const host::Setting& s) { return s.reg == &limit; }))
    tell_limit_below_setpoint(controller);
  return 0;
}

int save_registers(host::Controller& controller, const std::string& file) {
  controller.check_identity();
  write_whole(file, saved_registers_text(controller.read(kept_registers())));
  return 0;
}

int restore_registers(host::Controller& controller, const std::vector<host::Setting>& settings) {
  if (controller.status().running())
    throw UserError(
        "restore: heating is on, expected off: sensor and detectors change at once; first `chip stop`");
  return set_registers(controller, settings);
}

int clear_faults(host::Controller& controller) {
  const host::Status before = controller.status();
  controller.clear_faults();
  fmt::print("{}\n",
             before.faults == 0 ? "no fault was latched" : "cleared: " + host::fault_names(before.faults));
  return 0;
}

}  // namespace

Action add_chip_command(CLI::App& cli, const std::string& typed) {
  CLI::App* chip =
      cli.add_subcommand("chip", "Talk to the chip over Modbus, or serve a virtual one (docs/host/host.md)");
  chip->require_subcommand(1);

  const auto serve = std::make_shared<ServeOptions>();
  const auto speed = std::make_shared<std::string>("1");
  serve->command = typed;
  CLI::App* serve_command =
      chip->add_subcommand("serve", "The virtual chip on its heated head, behind a pseudo-terminal");
  show_example(serve_command, "chip serve --port /tmp/chip");
  serve_command->add_option("--port", serve->port, "Name of the link to make")->required();
  serve_command->add_flag("--rtl", serve->rtl, "The RTL, with the model beside it in lockstep");
  serve_command->add_option("--speed", *speed, "Chip time over real time, or max (default 1)");
  serve_command->add_option("--plant", serve->plant, "PH-1 (default), PH-A, PH-B, PH-C or E3D-like");
  serve_command->add_option("--vcd", serve->vcd, "Record the chip's pins as waves");

  const auto play = std::make_shared<PlayOptions>();
  CLI::App* play_command =
      chip->add_subcommand("play", "Run a scenario on the virtual chip (docs/start/chip-in-a-page.md)");
  show_example(play_command, "chip play scenario.txt --for 300 --out trace.csv");
  play_command->add_option("SCENARIO", play->scenario, "What happens to the chip and when")->required();
  play_command->add_option("--for", play->for_s, "Seconds of the chip (default 300)")
      ->check(number_from(0.1, kLongestPlay_s));
  play_command->add_option("--out", play->out, "Trace as CSV, a row each 0.1 s (default: standard output)");
  play_command->add_option("--vcd", play->vcd, "Write the pins as waves: their last two million changes");

  const auto asked = std::make_shared<Asked>();
  CLI::App* read = chip->add_subcommand("read", "Print registers in their units");
  show_example(read, "chip read PV DUTY --port /tmp/chip");
  read->add_option("NAMES", asked->names, "Registers (default: all); docs/chip/registers.md");
  read->add_flag("--json", asked->json, kJsonHelp);
  CLI::App* set = chip->add_subcommand("set", "Write registers in their units, all or none");
  show_example(set, "chip set SETPOINT=110 --port /tmp/chip");
  set->add_option("SETTINGS", asked->settings, "NAME=VALUE ...")->required();
  CLI::App* watch = chip->add_subcommand("watch", "Temperature, duty, state and faults as they go");
  show_example(watch, "chip watch --port /tmp/chip");
  watch->add_option("--period", asked->watch.period_s, "Seconds between polls (default 0.25)")
      ->check(number_from(0.01, 3600.0));
  CLI::Option* watch_for =
      watch->add_option("--for", asked->watch_for_s, "Ends after so many seconds (default: never)")
          ->check(number_from(0.0, 1e9));
  CLI::App* run = chip->add_subcommand("run", "Heating on");
  show_example(run, "chip run --port /tmp/chip");
  CLI::App* stop = chip->add_subcommand("stop", "Heater off");
  show_example(stop, "chip stop --port /tmp/chip");
  CLI::App* tune = chip->add_subcommand("tune", "Measure the head; set loop and detectors from that");
  show_example(tune, "chip tune --port /tmp/chip");
  CLI::App* clear = chip->add_subcommand("clear", "Clear latched faults");
  show_example(clear, "chip clear --port /tmp/chip");
  CLI::App* save = chip->add_subcommand("save", "Write the head's registers to a file");
  show_example(save, "chip save head.toml --port /tmp/chip");
  CLI::App* restore = chip->add_subcommand("restore", "Write the registers of such a file to the chip");
  show_example(restore, "chip restore head.toml --port /tmp/chip");
  for (CLI::App* command : {save, restore})
    command->add_option("FILE", asked->file, "TOML; docs/host/host.md")->required();
  for (CLI::App* command : {read, set, watch, run, stop, tune, clear, save, restore})
    add_connection(command, asked->line)->required();

  return [=] {
    if (*serve_command) {
      serve->speed = parse_speed(*speed);
      return serve_chip(*serve);
    }
    if (*play_command) return play_scenario(*play);
    std::vector<host::Setting> settings;
    for (const std::string& text : asked->settings) settings.push_back(parse_setting(text));
    for (const std::string& name : asked->names) host::find_register(name);
    if (*restore) settings = read_saved_registers(asked->file);
    host::Controller controller(asked->line.checked());
    if (*read) return read_registers(controller, asked->names, asked->json);
    if (*save) return save_registers(controller, asked->file);
    if (*restore) return restore_registers(controller, settings);
    if (*set) {
      const int status = set_registers(controller, settings);
      tell_rounded(settings);
      return status;
    }
    if (*watch) {
      if (*watch_for) asked->watch.for_s = asked->watch_for_s;
      return watch_chip(controller, asked->watch);
    }
    if (*tune) return tune_chip(controller);
    if (*run) run_chip(controller);
    if (*stop) controller.stop();
    return *clear ? clear_faults(controller) : 0;
  };
}

}  // namespace meltstage::app
