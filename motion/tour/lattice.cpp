// SPDX-License-Identifier: Apache-2.0
#include "motion/tour/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace meltstage::motion::detail {
namespace {

constexpr double kMostSteps = 1e6;
constexpr double kRelativeTolerance = 1e-6;  // of a pitch

struct Axis {
  double origin = 0.0, pitch = 0.0;
  std::size_t count = 1;
};

/// Common divisor of lengths that are known to within rounding.
double common_divisor(double a, double b, double least) {
  while (b > least) {
    const double rest = std::abs(std::remainder(a, b));
    a = std::exchange(b, rest);
  }
  return a;
}

std::optional<Axis> find_axis(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const double extent = values.back() - values.front();
  if (extent == 0.0) return Axis{values.front(), 0.0, 1};
  // Differences below this are the rounding of equal coordinates.
  const double least = extent / kMostSteps * 0.5;
  double pitch = 0.0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = values[i] - values[i - 1];
    if (step <= least) continue;
    pitch = pitch == 0.0 ? step : common_divisor(step, pitch, least);
  }
  if (pitch == 0.0 || extent / pitch > kMostSteps) return std::nullopt;
  pitch = extent / std::round(extent / pitch);
  for (const double value : values) {
    const double steps = (value - values.front()) / pitch;
    if (std::abs(steps - std::round(steps)) > kRelativeTolerance) return std::nullopt;
  }
  return Axis{values.front(), pitch, static_cast<std::size_t>(std::llround(extent / pitch)) + 1};
}

struct Cell {
  std::size_t column, row;
  bool operator==(const Cell&) const = default;
  auto operator<=>(const Cell&) const = default;
};

Cell cell_of(const Lattice& lattice, const Site& site) {
  const auto steps = [](double distance, double pitch) {
    return pitch == 0.0 ? std::size_t{0} : static_cast<std::size_t>(std::llround(distance / pitch));
  };
  return {steps(site.x - lattice.corner.x, lattice.pitch_x),
          steps(site.y - lattice.corner.y, lattice.pitch_y)};
}

/// Walks the columns of one row after the other, there and back; `first` columns are left out.
std::vector<Cell> walk_rows(std::size_t columns, std::size_t rows, std::size_t first) {
  std::vector<Cell> cells;
  cells.reserve(columns * rows);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t k = first; k < columns; ++k)
      cells.push_back({row % 2 == 0 ? k : columns - 1 - (k - first), row});
  return cells;
}

}  // namespace

std::optional<Lattice> find_lattice(std::span<const Site> sites) {
  if (sites.empty()) return std::nullopt;
  std::vector<double> x, y;
  for (const Site& site : sites) {
    x.push_back(site.x);
    y.push_back(site.y);
  }
  const auto across = find_axis(std::move(x)), along = find_axis(std::move(y));
  if (!across || !along) return std::nullopt;
  return Lattice{{across->origin, along->origin}, across->pitch, along->pitch, across->count, along->count};
}

bool is_full(const Lattice& lattice, std::span<const Site> sites) {
  if (sites.size() != lattice.columns * lattice.rows) return false;
  std::vector<bool> taken(sites.size(), false);
  for (const Site& site : sites) {
    const Cell cell = cell_of(lattice, site);
    const std::size_t at = cell.row * lattice.columns + cell.column;
    if (taken[at]) return false;
    taken[at] = true;
  }
  return true;
}

std::vector<std::vector<std::size_t>> serpentines(const Lattice& lattice, std::span<const Site> sites,
                                                  bool closed) {
  std::vector<std::size_t> at(sites.size());
  for (std::size_t i = 0; i < sites.size(); ++i) {
    const Cell cell = cell_of(lattice, sites[i]);
    at[cell.row * lattice.columns + cell.column] = i;
  }
  std::vector<std::vector<std::size_t>> found;
  const auto add = [&](const std::vector<Cell>& cells, bool swapped, bool flip_x, bool flip_y) {
    std::vector<std::size_t> order;
    order.reserve(cells.size());
    for (Cell cell : cells) {
      if (swapped) std::swap(cell.column, cell.row);
      if (flip_x) cell.column = lattice.columns - 1 - cell.column;
      if (flip_y) cell.row = lattice.rows - 1 - cell.row;
      order.push_back(at[cell.row * lattice.columns + cell.column]);
    }
    found.push_back(std::move(order));
  };
  for (const bool swapped : {false, true}) {
    const std::size_t columns = swapped ? lattice.rows : lattice.columns;
    const std::size_t rows = swapped ? lattice.columns : lattice.rows;
    if (closed) {
      // To and fro over all columns but the first, back along the first: an even number of rows ends beside
      // it.
      if (rows % 2 != 0 || columns < 2) continue;
      std::vector<Cell> cells = walk_rows(columns, rows, 1);
      for (std::size_t row = rows; row-- > 0;) cells.push_back({0, row});
      add(cells, swapped, false, false);
      continue;
    }
    const std::vector<Cell> cells = walk_rows(columns, rows, 0);
    for (const bool flip_x : {false, true})
      for (const bool flip_y : {false, true}) add(cells, swapped, flip_x, flip_y);
  }
  return found;
}

std::optional<double> common_pitch(const Lattice& lattice) {
  if (lattice.pitch_x == 0.0 || lattice.pitch_y == 0.0) {
    const double pitch = std::max(lattice.pitch_x, lattice.pitch_y);
    return pitch > 0.0 ? std::optional(pitch) : std::nullopt;
  }
  const double least = std::max(lattice.pitch_x, lattice.pitch_y) * kRelativeTolerance;
  const double pitch = common_divisor(lattice.pitch_x, lattice.pitch_y, least);
  // A divisor far below both pitches is what rounding leaves of pitches that have none.
  constexpr double kFinest = 1000.0;
  if (pitch * kFinest < std::max(lattice.pitch_x, lattice.pitch_y)) return std::nullopt;
  return pitch;
}

double colour_bound_mm(const Lattice& lattice, std::span<const Site> sites, bool closed) {
  const auto pitch = common_pitch(lattice);
  if (!pitch) return 0.0;
  const auto steps_x = std::llround(lattice.pitch_x / *pitch),
             steps_y = std::llround(lattice.pitch_y / *pitch);
  std::vector<Cell> cells;
  cells.reserve(sites.size());
  for (const Site& site : sites) cells.push_back(cell_of(lattice, site));
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  long long excess = 0;
  for (const Cell& cell : cells) {
    const auto colour =
        static_cast<long long>(cell.column) * steps_x + static_cast<long long>(cell.row) * steps_y;
    excess += colour % 2 == 0 ? 1 : -1;
  }
  excess = std::llabs(excess);
  const auto count = static_cast<long long>(cells.size());
  if (count < 2) return 0.0;
  const long long hops = closed ? count : count - 1;
  const long long same_colour = closed ? excess : std::max(0LL, excess - 1);
  return *pitch * static_cast<double>(hops + same_colour);
}

}  // namespace meltstage::motion::detail
