// SPDX-License-Identifier: Apache-2.0
// The functional vectors of the chip: its pins recorded while the model works among its devices, piece by
// piece, each labelled with what it is there for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/core/cycles.hpp"
#include "base/progress.hpp"
#include "recording/stream.hpp"

namespace meltstage::app {

struct FunctionalPiece {
  std::string requirement;
  std::uint64_t first_cycle;
};

struct FunctionalSet {
  recording::Stream stream;  // of the chip's pins
  std::vector<FunctionalPiece> pieces;
};

constexpr std::uint64_t kFunctionalSeed = 1;

enum class FunctionalLength { whole, quick };  // quick: every register is written once instead of twice

FunctionalSet functional_set(FunctionalLength length, const Progress& progress = {});
// What the chip on a small FPGA is replayed with: a host that writes SETPOINT, TS, HOST_WD and commands, and
// keeps away from self-tuning and the figures of quality (fpga/ice40).
FunctionalSet board_set();

struct PinReplay {
  std::uint64_t clocks = 0, strobes = 0, mismatches = 0;
  std::string first;  // "cycle 12: heater_o recorded 1, chip 0"
};
enum class ReplayDevice { model, rtl };
// A recording of the chip's pins run on a device. Throws UserError when pins of the chip are missing.
PinReplay replay_pins(const recording::Stream& stream, ReplayDevice device);

// Strobes of a cycle stream that are not compared, and why.
struct MaskedStrobes {
  std::uint64_t cycle;
  std::vector<std::string> outputs;
  std::string reason;
};

// The recording as a tester runs it: clock clk_i, and before it the pins of each cycle. `pieces` become
// labels. What that leaves open is masked and told. Pins of others are left out. Throws UserError that begins
// with `name` when a pin of the chip is missing.
dft::CycleStream chip_cycles(const recording::Stream& stream, const std::vector<FunctionalPiece>& pieces = {},
                             std::vector<MaskedStrobes>* masked = nullptr,
                             const std::string& name = "recording");
// Such a stream, as read back from a file, run on a device. Throws UserError when it has other signals than
// the chip has pins.
PinReplay replay_cycles_on(const dft::CycleStream& stream, ReplayDevice device,
                           const Progress& progress = {});

}  // namespace meltstage::app
