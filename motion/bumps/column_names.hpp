// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: what the names and cells of a table's columns say.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {

bool is_blank(const Cell& cell);

bool begins_like_number(std::string_view text);

/// In small letters, without the '#' that some write before their header.
std::string plain_name(const Cell& cell);

/// What may stand between the words of a column's name.
inline constexpr std::string_view kNameSeparators = " \t_()[]/.,:";

/// Where a column's name goes on behind the axis that it names, alone or as placement tables do: PosX, Mid X,
/// Center-X(mm). Nothing if it names another column.
std::optional<std::size_t> behind_axis(std::string_view name, char axis);

struct Unit {
  std::string_view name;
  double mm;
};

/// The unit of length of this name, in small letters; null for any other word.
const Unit* find_unit(std::string_view name);

/// "10.5mm" or "1000 mil": the number and its unit.
struct Length {
  double value = 0.0;
  const Unit* unit = nullptr;
};

/// Nothing if the cell isn't both.
std::optional<Length> length_of(const Cell& cell);

/// Side, Board Side, BoardSide, Layer, layer_name, T/B, TB, Seite.
bool names_column_of_sides(const Cell& cell);

/// Mirror, Mirrored, SYM_MIRROR.
bool names_column_of_mirrors(const Cell& cell);

/// The side that a cell of a column Mirror means, whose rows are on the bottom where they are mirrored.
std::optional<Side> side_by_mirror(const Cell& cell);

}  // namespace meltstage::motion::detail
