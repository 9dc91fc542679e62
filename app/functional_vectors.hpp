// SPDX-License-Identifier: Apache-2.0
// The functional vectors of the chip: its pins recorded while the model works among its devices, piece by
// piece, each labelled with what it is there for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/functional.hpp"
#include "vectors/stream.hpp"

namespace meltstage::app {

struct FunctionalPiece {
  std::string requirement;
  std::uint64_t first_cycle;
};

struct FunctionalSet {
  vectors::Stream
      stream;  // of the chip's pins; in a cycle stand the inputs before its clock and the outputs behind it
  std::vector<FunctionalPiece> pieces;
};

enum class FunctionalLength { whole, quick };  // quick: every register is written once instead of twice

FunctionalSet functional_set(FunctionalLength length);

struct PinReplay {
  std::uint64_t clocks = 0, strobes = 0, mismatches = 0;
  std::string first;  // "cycle 12: heater_o recorded 1, chip 0"
};
enum class ReplayDevice { model, rtl };
// A recording of the chip's pins run on a device. Throws std::runtime_error when its pins are not the chip's.
PinReplay replay_pins(const vectors::Stream& stream, ReplayDevice device);

// A recording for a netlist with these port bits; the clock is at 0. Without output ports nothing is
// compared. Throws std::runtime_error that names a port which the recording lacks.
std::vector<dft::FunctionalStretch> functional_stretches(const vectors::Stream& stream,
                                                         const std::vector<std::string>& input_ports,
                                                         const std::string& clock,
                                                         const std::vector<std::string>& output_ports = {});

}  // namespace meltstage::app
