// SPDX-License-Identifier: Apache-2.0
// Numbers of the command line.
#pragma once

#include <fmt/format.h>

#include <CLI/Validators.hpp>
#include <cstdint>
#include <string>

#include "base/number.hpp"

namespace meltstage::app {

/// An option takes a number in this range; CLI::Range() lets nan through.
inline CLI::Validator number_from(double least, double most) {
  const auto refusal = [=](const std::string& text) {
    if (number_in(text, least, most)) return std::string();
    return fmt::format("found {}, expected a number from {:g} to {:g}", text, least, most);
  };
  return {refusal, fmt::format("{:g} to {:g}", least, most)};
}

/// A whole number; CLI11 itself takes -1 and what is too large for something else.
inline CLI::Validator whole_number_from(std::uint64_t least, std::uint64_t most) {
  const auto refusal = [=](const std::string& text) {
    if (number_in(text, least, most)) return std::string();
    return fmt::format("found {}, expected a whole number from {} to {}", text, least, most);
  };
  return {refusal, fmt::format("{} to {}", least, most)};
}

}  // namespace meltstage::app
