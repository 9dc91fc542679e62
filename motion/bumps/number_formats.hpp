// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: what a spreadsheet's number formats say of the numbers under them
// (ECMA-376-1, 18.8.30).
#pragma once

#include <string>
#include <string_view>

namespace meltstage::motion::detail {

struct NumberFormat {
  enum class Kind { number, date, percent };
  Kind kind = Kind::number;
  std::string unit;  ///< words behind the number, such as "mil" of `0.0" mil"`, where they are a unit
};

/// Of a format's code, such as `0.00`, `dd/mm/yyyy`, `0%` or `0.0" mil"`.
NumberFormat number_format(std::string_view code);

/// The same of a format that every workbook has without a code (numFmtId below 164).
NumberFormat built_in_format(unsigned id);

}  // namespace meltstage::motion::detail
