// SPDX-License-Identifier: Apache-2.0
// The chip's registers by name and in their units (docs/chip/registers.md), from the generated map.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace meltstage::host {

struct Register {
  std::string_view name;
  std::string_view unit;  ///< empty: a plain number, or bits
  std::uint16_t address;  ///< Modbus PDU address
  double scale;           ///< value of one LSB in the unit
  bool is_signed;
  bool readable;
  bool writable;
  std::int32_t min;  ///< raw, of a writable one
  std::int32_t max;
};

/// All registers by rising address: input registers, then holding registers.
std::span<const Register> registers();

/// The register of that name, in capitals or not; throws UserError that names near ones.
const Register& find_register(std::string_view name);

/// True for the word that stands for no value: that of PV before the first sample.
bool is_no_value(const Register& reg, std::uint16_t raw);

/// Value of a register word in its unit. A word that is_no_value() has none; -3276.8 comes out.
double to_unit(const Register& reg, std::uint16_t raw);

/// Register word of a value in the unit, rounded to the nearest LSB. Throws UserError when the register
/// can't be written, the value is outside its range, or rounding would change its meaning: a fraction in a
/// register of bits or counts, a value that becomes 0, a baud rate more than 2.5 % off.
std::uint16_t to_raw(const Register& reg, double value);

/// The value with as many digits as the register resolves, without unit: "110.0", "0x0401" for bits.
std::string value_text(const Register& reg, std::uint16_t raw);

/// What the word of a coded register (STATUS, FAULT, CAUSE, FIRST_FAULT) says: "run, PID segment, sensor ok".
/// "no sample yet" for one that is_no_value(); empty for all others.
std::string meaning(const Register& reg, std::uint16_t raw);

/// Names of the faults in a word of FAULT or CAUSE: "OverTemp, Inhibit"; empty when there is none.
std::string fault_names(std::uint16_t faults);

}  // namespace meltstage::host
