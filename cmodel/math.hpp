// SPDX-License-Identifier: Apache-2.0
// Arithmetic that RTL and model share by name (rtl/tc_math_pkg.sv is the twin).
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "exact_int.hpp"
#include "spec.hpp"

namespace meltstage::chip {

// Narrowing to 16 bits signed with saturation.
template <class B, int W>
constexpr Int<B, 16> sat_s16(const Int<B, W>& x) {
  return clamp<-32768, 32767>(x);
}
constexpr std::int16_t sat_s16(std::int64_t x) {
  return static_cast<std::int16_t>(sat_s16(Int<PlainBits, 64>(x)).bits);
}

// Narrowing to a duty, UQ1.16 clamped to 0 .. 65536.
template <class B, int W>
constexpr Int<B, 18> sat_duty(const Int<B, W>& x) {
  return clamp<0, 65536>(x);
}

// Check bits of the (22,16) Hsiao code.
constexpr std::uint8_t secded_check(std::uint16_t data) {
  unsigned check = 0;
  for (unsigned row = 0; row < 6; ++row) {
    check |= (static_cast<unsigned>(std::popcount<std::uint16_t>(data & spec::kSecdedRows[row])) & 1u) << row;
  }
  return static_cast<std::uint8_t>(check);
}

// Code word: check bits above the data, an even number of ones in all.
constexpr std::uint32_t secded_encode(std::uint16_t data) {
  return static_cast<std::uint32_t>(secded_check(data)) << 16 | data;
}

// Wrong bit of a code word (one bit set); zero when the word is clean or can not be corrected.
constexpr std::uint32_t secded_flip(std::uint32_t code) {
  const auto syndrome =
      static_cast<std::uint8_t>(secded_check(static_cast<std::uint16_t>(code)) ^ (code >> 16));
  if (syndrome == 0) return 0;
  for (unsigned i = 0; i < 16; ++i) {
    if (syndrome == spec::kSecdedColumns[i]) return 1u << i;
  }
  return std::has_single_bit(syndrome) ? static_cast<std::uint32_t>(syndrome) << 16 : 0;
}

// Row of MEM: a register's word as stored, check bits above the data, an even number of ones in all. Of the
// check bits a register has one, those that are corrected on the way out all six.
constexpr std::uint32_t mem_row(bool corrected, std::uint16_t data) {
  if (corrected) return secded_encode(data);
  return (static_cast<std::uint32_t>(std::popcount(data)) & 1U) << 16 | data;
}

// Modbus CRC-16 (reflected 0x8005) of one more byte.
constexpr std::uint16_t crc16_byte(std::uint16_t crc, std::uint8_t data) {
  unsigned rest = crc ^ data;
  for (int bit = 0; bit < 8; ++bit) rest = rest >> 1 ^ (0xA001u & -(rest & 1u));
  return static_cast<std::uint16_t>(rest);
}

}  // namespace meltstage::chip
