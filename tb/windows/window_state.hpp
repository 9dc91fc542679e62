// SPDX-License-Identifier: Apache-2.0
// The chip's whole state at a clock, by the names of its flops, as text with a hash. Format:
// docs/verify/windows.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "base/sha256.hpp"
#include "cmodel/chip.hpp"
#include "tb/pins/dut.hpp"

namespace meltstage::tb {

// What made a file: files of different builds or specs are not mixed.
struct BuildIdentity {
  std::string build;  // SHA-256 of the executable
  std::string spec;   // version and CRC of the register map

  friend bool operator==(const BuildIdentity&, const BuildIdentity&) = default;
};

// Of the running executable.
const BuildIdentity& this_build();
// Throws UserError naming which of build and spec differs from this_build().
void require_this_build(const std::filesystem::path& file, const BuildIdentity& made_by);

struct SavedState {
  std::uint64_t cycle = 0;                 // clock edges so far
  chip::Inputs before = {.rst_n = false};  // input pins of the last of them
  chip::Chip chip;
};

// SHA-256 of cycle, pins and flops.
std::string state_hash(const SavedState& state);

// The file appears whole or not at all.
void write_state(const std::filesystem::path& path, const SavedState& state);
// Throws UserError.
SavedState read_state(const std::filesystem::path& path);

// Flops whose values differ; `dut` is a's value, `model` b's.
std::vector<FlopDifference> flop_differences(chip::Chip dut, chip::Chip model);

// What read_file() is told to expect.
inline constexpr std::string_view kPlanFile = "a file of a window plan; plan again";

}  // namespace meltstage::tb
