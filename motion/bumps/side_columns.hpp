// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: the columns of a table that tell on which side of a board its bumps lie.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {

class SideColumns {
 public:
  explicit SideColumns(const std::filesystem::path& path) : path_(path) {}

  /// Watches the columns of a table whose coordinates are in the columns `x` and `y`. `names` is the row that
  /// names them; where none does, `names` is the first row of numbers.
  void take_names(const TableRow& names, std::size_t x, std::size_t y);
  void take_nameless(const TableRow& first, std::size_t x, std::size_t y);

  /// A line above the table, which may tell the side of all of it: "# Side: bottom". Whether it did.
  bool take_above(const TableRow& row);

  /// A row that holds a bump. Throws the CoordinateError for a word that names no side where one has to
  /// stand.
  void take(const TableRow& row);

  /// Says of each bump of the table, in the order of the rows taken, on which side it lies. Throws the
  /// CoordinateError where two columns contradict each other.
  void tell(RawPoints& table) const;

  /// Side, Mirror: no other words stand there. Bottom, Location: perhaps a side in each row, perhaps another
  /// thing. Rotation: sides where a turn in it is mirrored. A column of any other name: told by its words
  /// alone.
  enum class Trust { sides, sides_or_others, mirrored_turns, words_alone };

  using Reading = std::optional<Side> (*)(const Cell&);

 private:
  struct Seen {
    std::size_t row = 0;
    std::string word;
  };
  /// `unmistakable`: one of the words names a side in any column. `sides`: of each row that has been taken.
  /// `letter_b`: the first B.
  struct Column {
    std::size_t index = 0;
    std::string name = {};
    Trust trust = Trust::sides;
    Reading side_of = nullptr;
    std::string_view expected;
    Seen other = {}, empty = {};
    std::size_t last_top = 0, last_bottom = 0;  // rows
    bool unmistakable = false;
    bool letters = true;  // each cell is T, F or B alone
    Seen letter_b = {};
    std::vector<std::optional<Side>> sides = {};
  };

  static void take_cell(Column& column, const TableRow& row);
  std::string place(const Column& column, std::size_t row) const;
  bool tells(const Column& column) const;
  std::vector<const Column*> telling() const;

  const std::filesystem::path& path_;
  std::vector<Column> columns_;
  std::optional<Side> above_;
  Seen words_above_;  // that name a side and tell none
};

}  // namespace meltstage::motion::detail
