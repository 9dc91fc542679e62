// SPDX-License-Identifier: Apache-2.0
// What a Modbus slave may make of the characters on its line: written from the standard, not from the chip.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tb/devices/uart.hpp"

namespace meltstage::tb {

using Bytes = std::vector<std::uint8_t>;

// A bit of the line inverted for its whole length: bit 0 of a character is its start bit.
struct BitFlip {
  std::size_t character;
  int bit;
};

// Characters with silence before and after them. A pause inside is a character's gap_bits.
struct Segment {
  std::vector<UartChar> chars;
  std::vector<BitFlip> flips;
};

Segment segment_of(std::span<const std::uint8_t> bytes);
std::string describe(const Segment& segment);

// CRC of Modbus over Serial Line V1.02, 6.2.2, by the bit.
std::uint16_t crc_of(std::span<const std::uint8_t> bytes);
Bytes sealed(Bytes body);

// A sound frame: 4 to 256 bytes, CRC right, addressed to the unit or to all.
struct SoundFrame {
  Bytes bytes;
  bool broadcast() const { return bytes[0] == 0; }
  std::uint8_t function() const { return bytes[1]; }
  // Registers it asks to be written, in order; empty when it asks for none.
  std::uint16_t first_register() const;
  std::vector<std::uint16_t> values() const;
  bool writes(std::uint16_t address) const;
};

// Certain: the segment is this one frame. Possible: it holds pauses between 1.5 and 3.5 characters, for which
// the standard leaves open whether they end a frame; these are the frames that then may have been meant.
struct Meaning {
  std::vector<SoundFrame> certain;
  std::vector<SoundFrame> possible;
};

// `char_bits`: bits of a character, start and stop bits included.
Meaning meaning_of(const Segment& segment, std::uint8_t unit, int char_bits);

// Empty when `reply` answers the request as the standard has it: an exception, or the form that the function
// wants; else what is wrong.
std::string fault_of_reply(const SoundFrame& request, std::span<const std::uint8_t> reply);
bool is_exception(std::span<const std::uint8_t> reply);

}  // namespace meltstage::tb
