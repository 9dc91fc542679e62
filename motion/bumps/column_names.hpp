// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: what the names and cells of a table's columns say.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {

bool is_blank(const Cell& cell);

bool begins_like_number(std::string_view text);

/// In small letters, without the '#' that some write before their header.
std::string plain_name(const Cell& cell);

/// The words of a column's name, in small letters.
std::vector<std::string> words_of_name(const Cell& cell);

/// The unit in the name of a column of coordinates, which names its axis alone or as placement tables do:
/// PosX, Mid X, Center-X(mm), X Coord, Pos. X, "x in mm". Empty for a name without a unit, nothing for the
/// name of another column.
std::optional<std::string> unit_behind_axis(std::string_view name, char axis);

struct Unit {
  std::string_view name;
  double mm;
};

/// The unit of length of this name, in small letters; null for any other word.
const Unit* find_unit(std::string_view name);

/// For messages.
inline constexpr std::string_view kUnitsExpected = "mm, um, cm, m, mil or in";

/// A unit that a line above a table tells. `of_all`: it says so, "Units: mm"; another one, "Dimensions (mm)",
/// is of the columns below it.
struct UnitTold {
  std::string name;
  bool of_all = false;
};

/// The unit in a line above a table: "Units used: mil" of Altium Designer, "Unit = mm", "Dimensions in mm",
/// in one cell or in two (`next`). Nothing if it tells none; not always a known one.
std::optional<UnitTold> unit_told(std::string_view line, std::string_view next);

/// The unit that a word of a sentence is; null for "m" and "in", which are other words, too.
const Unit* unit_in_sentence(std::string_view word);

/// A unit of another length than `unit` that the line has as a word by itself; null without one.
const Unit* other_unit_in(std::string_view line, const Unit& unit);

/// Unit, Units, Coordinate Unit, Einheit.
bool names_column_of_units(const Cell& cell);

/// Whether this stands before a row of totals: Total, "Sum: 12", Average.
bool is_total(const Cell& cell);

/// "10.5mm" or "1000 mil": the number and its unit.
struct Length {
  double value = 0.0;
  const Unit* unit = nullptr;
};

/// Nothing if the cell isn't both.
std::optional<Length> length_of(const Cell& cell);

}  // namespace meltstage::motion::detail
