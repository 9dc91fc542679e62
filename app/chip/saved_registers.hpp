// SPDX-License-Identifier: Apache-2.0
// Registers of a chip in a file, so that they outlive its power: `meltstage chip save`, `chip restore`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "host/controller.hpp"

namespace meltstage::app {

/// What belongs to the head, its sensor and its supply: the holding registers without commands, what a job
/// sets (SETPOINT, MODE, MANUAL_DUTY, FF_EXT), LOCK, and the serial line's own (ADDRESS, BAUD, FORMAT).
std::vector<const host::Register*> kept_registers();

/// TOML: the register map's CRC, and each kept register in its unit. `words` in the order of
/// kept_registers().
std::string saved_registers_text(std::span<const std::uint16_t> words);

/// Settings of such a file. Throws UserError that names file, line and key for one of another register map,
/// with a register that is missing, unknown or out of range.
std::vector<host::Setting> read_saved_registers(const std::filesystem::path& path);

}  // namespace meltstage::app
