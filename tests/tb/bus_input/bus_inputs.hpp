// SPDX-License-Identifier: Apache-2.0
// What comes on the line: valid requests, every way of spoiling them, and the byte programs of the fuzzer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rng.hpp"
#include "bus_line.hpp"
#include "modbus_oracle.hpp"

namespace meltstage::tb {

// Requests to kBusUnit and to all, each function code and each kind of refusal among them; with CRC.
std::vector<Bytes> valid_requests();

// A request with each of its data bits flipped in turn, and with each bit of the line from the first start
// bit to the last stop bit inverted in turn.
std::vector<Segment> data_bit_flips(const Bytes& request);
std::vector<Segment> line_bit_flips(const Bytes& request, int char_bits);
// Cut after each byte; followed by another request without a gap; made longer than a frame may be.
std::vector<Segment> truncations(const Bytes& request);
std::vector<Segment> merged_with(const Bytes& request, const Bytes& next);
std::vector<Segment> over_long(const Bytes& request);
// A pause before each byte, of each length from nothing to just below 3.5 characters.
std::vector<Segment> wrong_gaps(const Bytes& request, int char_bits);

// Anything of the above, with random frames, bytes and line errors, for a line of register FORMAT `format`; a
// tenth are valid requests.
Segment random_segment(Rng& rng, std::uint8_t format);
// The line of a random run: any format, a host's clock up to 3.5 % off.
LineSetting random_line(Rng& rng);

// A program for the line, for libFuzzer: the first byte chooses the line, then operations follow, any bytes
// being a program. Throws Violation.
void drive(std::span<const std::uint8_t> program);
// Programs that send each valid request, whole and spoilt.
std::vector<Bytes> seed_programs();

}  // namespace meltstage::tb
