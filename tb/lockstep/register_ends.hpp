// SPDX-License-Identifier: Apache-2.0
// Both ends of each holding register's range: written and taken, and written one beyond and refused.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::tb {

enum class RegisterEnd : std::uint8_t { lowest, highest, below, above };

// The word that stands for `end` of holding register `index`. SETPOINT ends below the highest T_MAX. Nothing
// where the register's 16 bits hold no such word.
std::optional<std::uint16_t> end_word(unsigned index, RegisterEnd end);

class RegisterEnds {
 public:
  // A clock, not in reset. What FC 16 writes counts where it is one word.
  void observe(const chip::Chip& now);
  // Adds what another run has seen.
  void add(const RegisterEnds& other);
  // Names of what was not met: "SETPOINT at its highest", "BAUD below its lowest refused".
  std::vector<std::string> holes() const;

  // Bit n: RegisterEnd n was met. CMD takes commands, not values, and stands empty.
  std::array<std::uint8_t, chip::spec::kHoldingCount> met{};

 private:
  void meet(unsigned index, RegisterEnd end, std::uint16_t word);
};

}  // namespace meltstage::tb
