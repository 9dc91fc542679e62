// SPDX-License-Identifier: Apache-2.0
// A host's register access while the chip's clock stands still: what a valid Modbus frame does, without its
// serial time. For transaction-level models (systemc/chip_tlm.hpp) and for software that has the chip's model
// but no serial line.
#pragma once

#include <cstdint>
#include <span>

#include "chip.hpp"

namespace meltstage::chip {

// Reads out.size() (1..32) registers from PDU address `address` on, as a frame with FC 03 or 04 would: it
// counts as a message, reloads the host watchdog and wakes the chip from Idle. `out` is left alone unless the
// result is spec::kExcNone. Chip::read_register looks without being a host. Returns spec::kExcNone or the
// exception code of the chip's answer: spec::kExcAddress outside the map, spec::kExcValue for a wrong count;
// spec::kExcDevice while the chip is in reset, where it would not answer.
spec::Exception host_read(Chip& chip, std::uint16_t address, std::span<std::uint16_t> out);

// Writes values.size() (1..16) holding registers from PDU address `address` on, as a frame with FC 16 (for
// one register also FC 06) would: all values are checked (range, lock, pending commit), then all are staged
// and the command word, if written, is carried out; or nothing is changed but the message counter, the
// watchdog and the state Idle. Staged values read back at once. Heating starts or stops, and a fault is
// cleared, at the chip's next clock; staged values become active at the next control tick, as always. Returns
// spec::kExcNone or the exception code of the chip's answer (docs/chip/registers.md), and besides it
// spec::kExcBusy
// - while a command of the serial line is being carried out or staged values are just being made active (some
// clocks);
// - for Run in the very clock of a Stop or a ClearFault, whose order would be lost.
// Both pass when the clock moves. A frame of nothing but Stop is never refused, except in reset
// (spec::kExcDevice).
spec::Exception host_write(Chip& chip, std::uint16_t address, std::span<const std::uint16_t> values);

}  // namespace meltstage::chip
