// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/error.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::python {

/// A line of a scenario that is not understood: meltstage.UserError with its parts.
class ScenarioError : public UserError {
 public:
  ScenarioError(const std::string& message, std::size_t scenario_line, std::string what_found,
                std::string what_expected)
      : UserError(message),
        line(scenario_line),
        found(std::move(what_found)),
        expected(std::move(what_expected)) {}
  std::size_t line;
  std::string found, expected;
};

/// The chip answered with an exception code: meltstage.Refused.
class Refused : public std::runtime_error {
 public:
  Refused(const std::string& message, chip::spec::Exception answer)
      : std::runtime_error(message), code(answer) {}
  chip::spec::Exception code;
};

}  // namespace meltstage::python
