// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: what a spreadsheet's number formats say of the numbers under them
// (ECMA-376-1, 18.8.30).
#pragma once

#include <string>
#include <string_view>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {

struct NumberFormat {
  /// `rescaled`: what is shown is another number, as 1500 under `0.000," mm"`, or its unit depends on the
  /// value.
  enum class Kind { number, date, percent, rescaled };
  Kind kind = Kind::number;
  std::string unit;  ///< words beside the number, such as "mil" of `0.0" mil"`, known as a unit or not
};

/// Of a format's code, such as `0.00`, `dd/mm/yyyy`, `0%` or `0.0" mil"`.
NumberFormat number_format(std::string_view code);

/// The cell of a number as a person sees it: no number under a date, a percentage or another scale, and with
/// its unit.
Cell as_shown(Cell cell, const NumberFormat& format);

/// The same of a format that every workbook has without a code (numFmtId below 164).
NumberFormat built_in_format(unsigned id);

}  // namespace meltstage::motion::detail
