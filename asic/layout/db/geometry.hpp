// SPDX-License-Identifier: Apache-2.0
// Points and rectangles of a layout. All lengths are whole nanometres.
#pragma once

#include <algorithm>
#include <cstdint>

namespace meltstage::layout {

using Nm = std::int64_t;

struct Point {
  Nm x = 0;
  Nm y = 0;
  friend bool operator==(const Point&, const Point&) = default;
};

struct Rect {
  Nm x0 = 0;
  Nm y0 = 0;
  Nm x1 = 0;
  Nm y1 = 0;
  Nm width() const { return x1 - x0; }
  Nm height() const { return y1 - y0; }
  Point middle() const { return {(x0 + x1) / 2, (y0 + y1) / 2}; }
  Rect moved(Point by) const { return {x0 + by.x, y0 + by.y, x1 + by.x, y1 + by.y}; }
  Rect grown(Nm by) const { return {x0 - by, y0 - by, x1 + by, y1 + by}; }
  /// True when the inner parts overlap; touching edges don't.
  bool overlaps(const Rect& o) const { return x0 < o.x1 && o.x0 < x1 && y0 < o.y1 && o.y0 < y1; }
  bool touches(const Rect& o) const { return x0 <= o.x1 && o.x0 <= x1 && y0 <= o.y1 && o.y0 <= y1; }
  bool contains(const Rect& o) const { return x0 <= o.x0 && o.x1 <= x1 && y0 <= o.y0 && o.y1 <= y1; }
  friend bool operator==(const Rect&, const Rect&) = default;
};

/// The least rectangle that holds both.
inline Rect hull(const Rect& a, const Rect& b) {
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

/// Distance between two rectangles, squared; 0 when they touch.
inline Nm distance_squared(const Rect& a, const Rect& b) {
  const Nm dx = std::max({Nm{0}, a.x0 - b.x1, b.x0 - a.x1});
  const Nm dy = std::max({Nm{0}, a.y0 - b.y1, b.y0 - a.y1});
  return dx * dx + dy * dy;
}
inline bool nearer_than(const Rect& a, const Rect& b, Nm spacing) {
  return distance_squared(a, b) < spacing * spacing;
}

}  // namespace meltstage::layout
