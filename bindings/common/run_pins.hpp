// SPDX-License-Identifier: Apache-2.0
// Pins of a scripted run, for other languages.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "bindings/common/model_chip.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/scenario/scripted_run.hpp"

namespace meltstage::bindings {

/// Levels of a change, a number each pin.
std::array<std::uint64_t, tb::kChipPinCount> levels_of(const tb::PinChange& change);

/// The chip as it is now, and the levels at its pins.
ModelChip chip_of(const tb::ScriptedRun& run);

/// All pins from power-up as a recording (.mvec). `origin`: who records. Throws UserError when the run keeps
/// not all of them, has no clock yet, or the path can't be written.
void record_pins(const tb::ScriptedRun& run, const std::filesystem::path& path, const std::string& origin);

}  // namespace meltstage::bindings
