// SPDX-License-Identifier: Apache-2.0
// Nets through a grid of tracks: A* and negotiated congestion (McMurchie and Ebeling, PathFinder, FPGA 1995):
// every net takes the way that is cheapest for it, places that more than one net wants grow dearer from round
// to round until each has one owner.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "asic/layout/db/geometry.hpp"
#include "base/progress.hpp"

namespace meltstage::layout {

/// Crossings of vertical tracks (x0 + ix * pitch_x) and horizontal tracks, the same on every layer. Layers
/// alternate in direction and are routed in it only. A node is a crossing on a layer; nodes of one track
/// follow each other in number.
struct Grid {
  Nm x0 = 0, pitch_x = 1;
  int columns = 0;
  Nm y0 = 0, pitch_y = 1;
  int rows = 0;
  std::vector<bool> vertical;  ///< a layer each, bottom first
  /// A layer each: a wire's end, with its via's metal, leaves no room for another net on the next crossing of
  /// its track.
  std::vector<bool> ends_spread;

  int layers() const { return static_cast<int>(vertical.size()); }
  int layer_size() const { return columns * rows; }
  int nodes() const { return layers() * layer_size(); }
  int node(int layer, int ix, int iy) const {
    return layer * layer_size() +
           (vertical[static_cast<std::size_t>(layer)] ? ix * rows + iy : iy * columns + ix);
  }
  struct Crossing {
    int layer, ix, iy;
  };
  Crossing crossing(int node) const {
    const int layer = node / layer_size();
    const int rest = node % layer_size();
    if (vertical[static_cast<std::size_t>(layer)]) return {layer, rest / rows, rest % rows};
    return {layer, rest % columns, rest / columns};
  }
  Point place(int node) const {
    const Crossing at = crossing(node);
    return {x0 + at.ix * pitch_x, y0 + at.iy * pitch_y};
  }
};

constexpr std::int32_t kFreeNode = -1;
constexpr std::int32_t kBlockedNode = -2;

/// What is to be joined. A terminal is any of its nodes.
struct MazeNet {
  std::vector<std::vector<int>> terminals;
  std::vector<int> regions;  ///< where its wires should be; empty: anywhere
  int lowest_reach = -1;     ///< so many crossings from its terminals, at most, on the lowest layer; -1: any
  int highest = -1;          ///< no layer above this one; -1: any
  int via_cost = 150;        ///< hundredths of the finer pitch that a via may save
  int root = 0;              ///< the terminal that the net comes from
  int way_back =
      0;  ///< hundredths of the way back to the root that count where a terminal joins the tree
          ///< (Prim-Dijkstra's trade-off: Alpert, Hu, Huang, Kahng, Karger 1995); 0: the least wire
};

/// Edges between neighbouring nodes (of one track, or of one crossing on adjacent layers).
using MazeTree = std::vector<std::pair<int, int>>;

/// Rectangles of crossings, all layers of them: region = of_column[ix] + of_row[iy].
struct MazeRegions {
  std::vector<int> of_column;
  std::vector<int> of_row;  ///< times the regions in a row
  int columns = 0;
  int rows = 0;
};

struct MazeProblem {
  Grid grid;
  MazeRegions regions;              ///< none: nets have none, too
  std::vector<std::int32_t> owner;  ///< a node each: free_node, blocked_node, or the only net that may use it
  std::vector<MazeNet> nets;
  std::vector<MazeTree> begun;  ///< ways from before, a net each, kept where they still serve; or none at all
};

struct MazeResult {
  std::vector<MazeTree> trees;   ///< a net each
  std::vector<int> open;         ///< nets with a terminal that no way leads to
  std::vector<int> conflicting;  ///< nets that still share a place
  int rounds = 0;
};

struct MazeOptions {
  int rounds = 60;
  /// Told within each round, whose name says how many nets shared a place before it.
  Progress progress;
};

MazeResult route_maze(const MazeProblem& problem, const MazeOptions& options);

}  // namespace meltstage::layout
