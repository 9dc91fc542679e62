// SPDX-License-Identifier: Apache-2.0
// Shapes found by layer and place.
#pragma once

#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "asic/layout/db/technology.hpp"

namespace meltstage::layout {

class ShapeIndex {
 public:
  void add(const Shape& shape) {
    const std::size_t index = shapes_.size();
    shapes_.push_back(shape);
    for_each_bin(shape, [&](const Bin& bin) { bins_[bin].push_back(index); });
  }

  /// visit(index) of each shape that overlaps `area` on its layer, in the order in which they were added.
  template <typename Visit>
  void for_each_in(const Shape& area, Visit visit) const {
    std::set<std::size_t> found;
    for_each_bin(area, [&](const Bin& bin) {
      const auto here = bins_.find(bin);
      if (here != bins_.end()) found.insert(here->second.begin(), here->second.end());
    });
    for (const std::size_t index : found)
      if (shapes_[index].rect.overlaps(area.rect)) visit(index);
  }

  const Shape& operator[](std::size_t index) const { return shapes_[index]; }

 private:
  static constexpr Nm kBin = 20'000;
  using Bin = std::tuple<int, Nm, Nm>;

  template <typename Visit>
  static void for_each_bin(const Shape& shape, Visit visit) {
    const auto floored = [](Nm v) { return v >= 0 ? v / kBin : -((-v + kBin - 1) / kBin); };
    for (Nm x = floored(shape.rect.x0); x <= floored(shape.rect.x1); ++x)
      for (Nm y = floored(shape.rect.y0); y <= floored(shape.rect.y1); ++y) visit(Bin{shape.layer, x, y});
  }

  std::vector<Shape> shapes_;
  std::map<Bin, std::vector<std::size_t>> bins_;
};

}  // namespace meltstage::layout
