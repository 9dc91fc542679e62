// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: what a regular grid of sites says about the shortest tour before any search.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "motion/tour/path_costs.hpp"

namespace meltstage::motion::detail {

/// Sites at whole multiples of a pitch from a corner, columns along x.
struct Lattice {
  Site corner;
  double pitch_x = 0.0, pitch_y = 0.0;  ///< mm, 0 where all sites share the coordinate
  std::size_t columns = 1, rows = 1;
};

/// The coarsest lattice that holds all sites; nothing if there is none of less than a million steps a side.
std::optional<Lattice> find_lattice(std::span<const Site> sites);

/// True if every place of the lattice is taken by one site, and none by two.
bool is_full(const Lattice& lattice, std::span<const Site> sites);

/// Serpentine orders of a full lattice as indices into the sites: open ones from every corner in both
/// directions, or the closed ones of lattices with an even side.
std::vector<std::vector<std::size_t>> serpentines(const Lattice& lattice, std::span<const Site> sites,
                                                  bool closed);

/// The common pitch of both axes, if the lattice has one.
std::optional<double> common_pitch(const Lattice& lattice);

/// Lower bound of the Manhattan length, by colours: a hop over one pitch changes the colour of a chessboard,
/// so every site that one colour has more costs a pitch more. Sites of one place count once.
double colour_bound_mm(const Lattice& lattice, std::span<const Site> sites, bool closed);

}  // namespace meltstage::motion::detail
