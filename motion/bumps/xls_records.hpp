// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: the cells of a workbook (.xls) that freexl leaves out or takes for plain numbers:
// formulas, truth values and errors, and numbers whose format shows something else.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {

/// The name of the first sheet of cells that is shown; empty where there is none, or for a file that is no
/// compound file of Excel 97-2003. ([MS-XLS] 2.4.28.)
std::string first_shown_sheet(std::string_view file);

/// Of that sheet, by row and column from 0: the number that the formula had when the file was saved,
/// what stands in the cell, such as "#N/A", or the number as_shown(). Empty for a file that is no compound
/// file of Excel 97-2003; what is damaged ends the reading there. ([MS-CFB] 2.2-2.6;
/// [MS-XLS] 2.4.28, 2.4.127, 2.4.24; 2.4.126, 2.4.353, 2.4.180, 2.4.220, 2.4.175.)
std::map<std::pair<std::size_t, std::size_t>, Cell> cells_read_apart(std::string_view file);

}  // namespace meltstage::motion::detail
