// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <limits>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "base/place.hpp"
#include "bindings/c/handles.hpp"
#include "bindings/c/status.hpp"
#include "cmodel/host_access.hpp"
#include "host/exception_text.hpp"
#include "host/register_word.hpp"
#include "tb/pins/flop_table.hpp"
#include "tb/scenario/scenario.hpp"

using namespace meltstage;
using c::guarded;
using c::required;
namespace spec = chip::spec;

namespace {

std::uint32_t pin_number(const char* name, std::uint32_t count) {
  const std::string_view wanted = &required(name, "pin");
  std::string known;
  for (std::uint32_t pin = 0; pin < count; ++pin) {
    if (spec::kPins[pin].name == wanted) return pin;
    known += fmt::format("{}{}", pin == 0 ? "" : ", ", spec::kPins[pin].name);
  }
  throw UserError(fmt::format("pin: found \"{}\", expected one of {}", shown(wanted), known));
}

// An input register, or else a holding one.
struct Found {
  const spec::InputInfo* input = nullptr;
  const spec::RegisterInfo* holding = nullptr;
  std::uint16_t address = 0;
};

Found find_register(const char* name) {
  const std::string_view wanted = &required(name, "register");
  for (std::uint16_t i = 0; i < spec::kInputCount; ++i) {
    if (spec::kInput[i].name == wanted) return {&spec::kInput[i], nullptr, i};
  }
  for (std::uint16_t i = 0; i < spec::kHoldingCount; ++i) {
    if (spec::kHolding[i].name == wanted)
      return {nullptr, &spec::kHolding[i], static_cast<std::uint16_t>(spec::kHoldingBase + i)};
  }
  throw UserError(
      fmt::format("register: found \"{}\", expected a name of docs/chip/registers.md", shown(wanted)));
}

Found find_readable(const char* name) {
  const Found found = find_register(name);
  if (found.holding != nullptr && !found.holding->readable)
    throw UserError(fmt::format("register: found {}, expected one that can be read", name));
  return found;
}

double value_of(const Found& reg, std::uint16_t word) {
  if (reg.address == spec::kInPv && word == spec::kPvNone) return std::numeric_limits<double>::quiet_NaN();
  const bool is_signed = reg.input != nullptr ? reg.input->is_signed : reg.holding->is_signed;
  const double scale = reg.input != nullptr ? reg.input->scale : reg.holding->scale;
  return (is_signed ? static_cast<std::int16_t>(word) : static_cast<std::int32_t>(word)) * scale;
}

void require_done(spec::Exception answer, const char* verb, std::string_view reg) {
  if (answer == spec::kExcNone) return;
  throw c::StatusError(MS_REFUSED, fmt::format("{} {}: the chip refuses with exception {}: {}", verb, reg,
                                               static_cast<int>(answer), host::exception_text(answer)));
}

void write(ms_chip& chip, std::uint16_t address, std::uint16_t word, std::string_view reg) {
  require_done(chip::host_write(chip.model.chip, address, std::array{word}), "write", reg);
}

const tb::Flop& find_flop(const char* name) {
  const std::string_view wanted = &required(name, "flop");
  for (const tb::Flop* flop : tb::flops_in_order()) {
    if (flop != nullptr && tb::name_of(*flop) == wanted) return *flop;
  }
  throw UserError(fmt::format("flop: found \"{}\", expected a name such as guard.run_q or mem.active_q[3]",
                              shown(wanted)));
}

}  // namespace

extern "C" {

ms_status ms_chip_new(ms_chip** chip) {
  return guarded([&] {
    ms_chip*& made = required(chip, "chip");
    made = new ms_chip;
  });
}

ms_status ms_chip_copy(const ms_chip* chip, ms_chip** copy) {
  return guarded([&] {
    ms_chip*& made = required(copy, "copy");
    made = new ms_chip(required(chip, "chip"));
  });
}

void ms_chip_free(ms_chip* chip) { delete chip; }

ms_status ms_chip_step(ms_chip* chip, uint64_t clocks) {
  return guarded([&] { required(chip, "chip").model.step(clocks); });
}

ms_status ms_chip_advance(ms_chip* chip, uint64_t clocks) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 62;
  return guarded([&] {
    ms_chip& found = required(chip, "chip");
    if (clocks > kMost) throw UserError(fmt::format("clocks: found {}, expected 0 to {}", clocks, kMost));
    found.model.advance(clocks);
  });
}

ms_status ms_chip_cycle(const ms_chip* chip, uint64_t* cycle) {
  return guarded([&] { required(cycle, "cycle") = required(chip, "chip").model.cycle; });
}

ms_status ms_chip_pin(const ms_chip* chip, const char* pin, uint64_t* level) {
  return guarded([&] {
    const ms_chip& found = required(chip, "chip");
    required(level, "level") = found.model.pin(pin_number(pin, spec::kPins.size()));
  });
}

ms_status ms_chip_set_pin(ms_chip* chip, const char* pin, uint64_t level) {
  return guarded([&] {
    ms_chip& found = required(chip, "chip");
    const std::uint32_t number = pin_number(pin, spec::kInputPins);
    const std::uint64_t most = tb::ones(spec::kPins[number].width);
    if (level > most) throw UserError(fmt::format("{}: found {}, expected 0 to {}", pin, level, most));
    found.model.set_pin(number, level);
  });
}

ms_status ms_chip_peek(const ms_chip* chip, const char* reg, double* value) {
  return guarded([&] {
    const ms_chip& found = required(chip, "chip");
    const Found which = find_readable(reg);
    required(value, "value") = value_of(which, found.model.chip.read_register(which.address));
  });
}

ms_status ms_chip_read(ms_chip* chip, const char* reg, double* value) {
  return guarded([&] {
    ms_chip& found = required(chip, "chip");
    const Found which = find_readable(reg);
    double& out = required(value, "value");
    std::array<std::uint16_t, 1> word{};
    require_done(chip::host_read(found.model.chip, which.address, word), "read", reg);
    out = value_of(which, word[0]);
  });
}

ms_status ms_chip_write(ms_chip* chip, const char* reg, double value) {
  return guarded([&] {
    ms_chip& found = required(chip, "chip");
    const Found which = find_register(reg);
    if (which.holding == nullptr)
      throw UserError(fmt::format("register: found {}, expected one that can be written", reg));
    const host::RegisterWord word = host::register_word(*which.holding, value);
    if (!word.expected.empty())
      throw UserError(fmt::format("{}: found {:g}, expected {}", reg, value, word.expected));
    write(found, which.address, word.word, reg);
  });
}

ms_status ms_chip_command(ms_chip* chip, const char* word) {
  return guarded([&] {
    ms_chip& found = required(chip, "chip");
    const std::string_view wanted = &required(word, "command");
    std::string known;
    for (const tb::HostCommand& command : tb::kHostCommands) {
      if (command.name == wanted)
        return write(found, spec::kHoldingBase + spec::kRegCmd, command.code, wanted);
      known += fmt::format("{}{}", known.empty() ? "" : ", ", command.name);
    }
    throw UserError(fmt::format("command: found \"{}\", expected one of {}", shown(wanted), known));
  });
}

ms_status ms_chip_flop(const ms_chip* chip, const char* flop, uint64_t* value) {
  return guarded([&] {
    const ms_chip& found = required(chip, "chip");
    const tb::Flop& which = find_flop(flop);
    required(value, "value") = which.get(found.model.chip, which.word);
  });
}

ms_status ms_chip_set_flop(ms_chip* chip, const char* flop, uint64_t value) {
  return guarded([&] {
    ms_chip& found = required(chip, "chip");
    const tb::Flop& which = find_flop(flop);
    if ((value & ~which.changeable) != 0)
      throw UserError(
          fmt::format("{}: found {:#x}, expected bits of {:#x} alone", flop, value, which.changeable));
    which.set(found.model.chip, which.word, value);
    found.model.chip.mem.refresh_params();
  });
}

ms_status ms_chip_state(const ms_chip* chip, const char** name) {
  return guarded([&] {
    // the names are literals, so a 0 stands behind each
    required(name, "name") = spec::state_name(required(chip, "chip").model.chip.sysctrl.state_q).data();
  });
}

}  // extern "C"
