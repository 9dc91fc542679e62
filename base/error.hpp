// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace meltstage {

/// What a person can put right: a wrong file, value, option or place. what() is one line: what, where (file,
/// row, column), found, expected, what to do. A program shows it and ends with exit status 2.
class UserError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace meltstage
