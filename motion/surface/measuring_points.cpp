// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/measuring_points.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "motion/profile/profile.hpp"
#include "motion/surface/nurbs.hpp"

namespace meltstage::motion {

namespace {

/// Quantile of the standard normal distribution, by Newton on its distribution function.
double normal_quantile(double probability) {
  double z = 0.0;
  for (int i = 0; i < 100; ++i) {
    const double density = std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
    const double step = (0.5 * std::erfc(-z / std::numbers::sqrt2) - probability) / density;
    z -= std::clamp(step, -1.0, 1.0);
    if (std::abs(step) < 1e-14) break;
  }
  return z;
}

void check_choice(std::size_t points, double chord_error_mm) {
  if (points < 2)
    throw MotionError(fmt::format("measuring points: found {} points, expected at least 2", points));
  if (!(chord_error_mm > 0.0) || !std::isfinite(chord_error_mm))
    throw MotionError(
        fmt::format("chord error: found {} mm, expected a finite number above 0", chord_error_mm));
}

/// Goes along the points as the paper does; `holds(i, j)`: no point between them is too far from their chord.
template <class Holds>
std::vector<std::size_t> greedy(std::size_t points, const Holds& holds) {
  std::vector<std::size_t> chosen{0};
  for (std::size_t i = 0, j = 2; j < points; ++j) {
    if (holds(i, j)) continue;
    i = j - 1;
    chosen.push_back(i);
    j = i + 1;  // the loop goes on with i + 2
  }
  chosen.push_back(points - 1);
  return chosen;
}

/// A binary tree over the points in their order. Each node has a capsule: all its points lie within `radius`
/// of the segment from..to. Distance from a chord is a convex function, so on the segment it is largest at
/// one of its ends, and no point of the node can be farther than that plus the radius.
class CapsuleTree {
 public:
  explicit CapsuleTree(std::span<const Eigen::Vector3d> points) : points_(points) { build(0, points.size()); }

  /// Whether a point of begin..end (not included) is farther than `limit` from the chord.
  bool any_beyond(std::size_t begin, std::size_t end, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                  double limit) const {
    return beyond(0, {begin, end}, from, to, limit);
  }

 private:
  static constexpr std::size_t kLeaf = 8;
  struct Span {
    std::size_t begin = 0, end = 0;
  };
  struct Node {
    Span span;
    std::size_t second = 0;  ///< its second child; the first follows the node, 0: a leaf
    Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
    double radius = 0.0;
  };

  void build(std::size_t begin, std::size_t end) {
    const std::size_t at = nodes_.size();
    nodes_.emplace_back();
    nodes_[at].span = {begin, end};
    fit_capsule(nodes_[at]);
    if (end - begin <= kLeaf) return;
    const std::size_t middle = (begin + end) / 2;
    build(begin, middle);
    nodes_[at].second = nodes_.size();
    build(middle, end);
  }

  /// Along the points' main direction, through their centre.
  void fit_capsule(Node& node) const {
    const auto [begin, end] = node.span;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (std::size_t i = begin; i < end; ++i) centre += points_[i];
    centre /= static_cast<double>(end - begin);
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3d d = points_[i] - centre;
      spread += d * d.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(spread);
    const Eigen::Vector3d along = solver.eigenvectors().col(2).normalized();
    double low = 0.0, high = 0.0;
    for (std::size_t i = begin; i < end; ++i) {
      const double way = (points_[i] - centre).dot(along);
      low = std::min(low, way), high = std::max(high, way);
    }
    node.from = centre + low * along, node.to = centre + high * along;
    for (std::size_t i = begin; i < end; ++i)
      node.radius = std::max(node.radius, distance_to_segment_mm(points_[i], node.from, node.to));
  }

  bool beyond(std::size_t at, const Span& asked, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
              double limit) const {
    const Node& node = nodes_[at];
    const std::size_t begin = std::max(node.span.begin, asked.begin),
                      end = std::min(node.span.end, asked.end);
    if (begin >= end) return false;
    const double reach =
        std::max(distance_to_segment_mm(node.from, from, to), distance_to_segment_mm(node.to, from, to));
    // The margin covers rounding, so that a decision is always that of the points themselves.
    if (reach + node.radius <= limit * (1.0 - 1e-9)) return false;
    if (node.second == 0) {
      for (std::size_t k = begin; k < end; ++k)
        if (distance_to_segment_mm(points_[k], from, to) > limit) return true;
      return false;
    }
    // The farthest point is likelier near the chord's middle, which lies in the later part as the chord
    // grows.
    return beyond(node.second, asked, from, to, limit) || beyond(at + 1, asked, from, to, limit);
  }

  std::span<const Eigen::Vector3d> points_;
  std::vector<Node> nodes_;
};

}  // namespace

double distance_to_segment_mm(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
                              const Eigen::Vector3d& to) {
  const Eigen::Vector3d way = to - from;
  const double square = way.squaredNorm();
  const double share = square > 0.0 ? std::clamp((point - from).dot(way) / square, 0.0, 1.0) : 0.0;
  return (point - from - share * way).norm();
}

std::size_t measuring_point_count(double capability, double confidence) {
  if (!(capability > 1.0) || !std::isfinite(capability))
    throw MotionError(
        fmt::format("process capability: found {}, expected a finite number above 1", capability));
  if (!(confidence > 0.5 && confidence < 1.0))
    throw MotionError(fmt::format("confidence: found {}, expected a number between 0.5 and 1", confidence));
  const double root = (1.0 + capability) / (1.0 - capability) * normal_quantile(confidence);
  const double count = std::ceil(0.5 * root * root);
  if (count > static_cast<double>(kMaxPoints))
    throw MotionError(
        fmt::format("process capability: {} with confidence {} asks for {:.3g} points, expected at "
                    "most {}",
                    capability, confidence, count, kMaxPoints));
  return std::max<std::size_t>(2, static_cast<std::size_t>(count));
}

std::vector<std::size_t> choose_by_chord_as_published(std::span<const Eigen::Vector3d> points_mm,
                                                      double chord_error_mm) {
  check_choice(points_mm.size(), chord_error_mm);
  return greedy(points_mm.size(), [&](std::size_t i, std::size_t j) {
    double error_mm = 0.0;
    for (std::size_t k = i + 1; k < j; ++k)
      error_mm = std::max(error_mm, distance_to_segment_mm(points_mm[k], points_mm[i], points_mm[j]));
    return error_mm <= chord_error_mm;
  });
}

std::vector<std::size_t> choose_by_chord(std::span<const Eigen::Vector3d> points_mm, double chord_error_mm) {
  check_choice(points_mm.size(), chord_error_mm);
  const CapsuleTree tree(points_mm);
  return greedy(points_mm.size(), [&](std::size_t i, std::size_t j) {
    return !tree.any_beyond(i + 1, j, points_mm[i], points_mm[j], chord_error_mm);
  });
}

std::vector<std::size_t> choose_evenly(std::span<const Eigen::Vector3d> points_mm, std::size_t count) {
  check_choice(points_mm.size(), 1.0);
  if (count < 2)
    throw MotionError(fmt::format("measuring points: found count {}, expected at least 2", count));
  count = std::min(count, points_mm.size());
  const std::vector<double> lengths = polygon_lengths_mm(points_mm);
  std::vector<std::size_t> chosen{0};
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const double wanted = lengths.back() * static_cast<double>(i) / static_cast<double>(count - 1);
    auto at =
        static_cast<std::size_t>(std::lower_bound(lengths.begin(), lengths.end(), wanted) - lengths.begin());
    if (at > 0 && wanted - lengths[at - 1] < lengths[at] - wanted) --at;
    if (at > chosen.back() && at + 1 < points_mm.size()) chosen.push_back(at);
  }
  chosen.push_back(points_mm.size() - 1);
  return chosen;
}

std::vector<MeasuringPoint> measuring_points(const ClLine& line, std::span<const std::size_t> chosen) {
  require_no_wall(line);
  const std::vector<double> lengths = polygon_lengths_mm(positions_mm(line));
  std::vector<MeasuringPoint> out;
  for (const std::size_t i : chosen) {
    if (i >= line.points.size())
      throw MotionError(
          fmt::format("measuring points: found point {}, expected 0 to {}", i, line.points.size() - 1));
    out.push_back({line.points[i].position_mm, line.points[i].axis, lengths[i]});
  }
  return out;
}

namespace {

/// Lengths within a face at which the line has a corner, and both of its ends.
std::vector<double> corners_mm(const ClLine& line, const std::vector<double>& lengths, double from,
                               double to) {
  std::vector<double> out{from};
  const auto first = std::upper_bound(lengths.begin(), lengths.end(), from);
  for (auto at = first; at != lengths.end() && *at < to; ++at)
    if (is_corner(line, static_cast<std::size_t>(at - lengths.begin()))) out.push_back(*at);
  out.push_back(to);
  return out;
}

/// Directions across the line, in the plane of line and tool axis, at every point.
std::vector<Eigen::Vector3d> directions_across(const ClLine& line, const std::vector<double>& lengths) {
  const std::size_t n = line.points.size();
  std::vector<Eigen::Vector3d> out;
  if (line.axes_by_line) {
    for (const double length : lengths) out.push_back(place_on(line, lengths, length).axis);
    return out;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d along =
        (line.points[std::min(i + 1, n - 1)].position_mm - line.points[i == 0 ? 0 : i - 1].position_mm)
            .normalized();
    const Eigen::Vector3d& axis = line.points[i].axis;
    const Eigen::Vector3d across = axis - axis.dot(along) * along;
    out.push_back(across.norm() > 1e-6 ? across.normalized() : axis);
  }
  return out;
}

/// Splits every gap of a smooth piece in which a spline through the directions at the chosen places departs
/// from them by more than `allowed` (rad), until none does.
std::vector<double> refine(const ClLine& line, const std::vector<Eigen::Vector3d>& across,
                           const std::vector<double>& lengths, std::vector<double> at, double allowed) {
  constexpr double kShortest_mm = 0.05;
  const auto value_at = [&](double place) -> Eigen::Vector3d {
    if (line.axes_by_line) return place_on(line, lengths, place).axis;
    const auto after = std::upper_bound(lengths.begin() + 1, lengths.end() - 1, place);
    const auto i = static_cast<std::size_t>(after - lengths.begin());
    const double share = (place - lengths[i - 1]) / (lengths[i] - lengths[i - 1]);
    return (1.0 - share) * across[i - 1] + share * across[i];
  };
  const double first = at.front(), scale = 1.0 / (at.back() - at.front());
  while (true) {
    std::vector<Eigen::Vector3d> values;
    std::vector<double> u;
    for (const double place : at) {
      values.push_back(value_at(place));
      u.push_back(place == at.back() ? 1.0 : (place - first) * scale);
    }
    const Nurbs spline = interpolate(values, u);
    std::vector<double> finer{first};
    auto inner = std::upper_bound(lengths.begin(), lengths.end(), first);
    for (std::size_t i = 1; i < at.size(); ++i) {
      double worst = 0.0;
      for (; inner != lengths.end() && *inner < at[i]; ++inner)
        worst = std::max(worst, (spline.position_mm((*inner - first) * scale) -
                                 across[static_cast<std::size_t>(inner - lengths.begin())])
                                    .norm());
      if (worst > allowed && at[i] - at[i - 1] > 2.0 * kShortest_mm)
        finer.push_back(0.5 * (at[i - 1] + at[i]));
      finer.push_back(at[i]);
    }
    if (finer.size() == at.size()) return at;
    at = std::move(finer);
  }
}

/// Places from one to another, so many that no gap is longer.
std::vector<double> evenly(double from, double to, double gap_mm) {
  const auto gaps = std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil((to - from) / gap_mm)));
  std::vector<double> out;
  for (std::size_t i = 0; i <= gaps; ++i)
    out.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(gaps));
  return out;
}

/// How far from a fold a face is touched: wherever the part lies, the ball touches this face alone.
double clear_mm(const Fold& fold, const SplineChoice& choice) {
  return fold.shadow_mm(choice.ball_radius_mm) + choice.placement_mm;
}

/// Where a line is so ragged that no face is long enough to be touched by itself, it is touched all the same.
void bridge_small_faces(const std::vector<double>& borders, double gap_mm, double small_mm,
                        std::vector<double>& at) {
  const auto is_small = [&](double place) {
    const auto end = std::upper_bound(borders.begin() + 1, borders.end() - 1, place);
    return *end - *(end - 1) < small_mm;
  };
  std::vector<double> out;
  double last = borders.front();
  const auto bridge = [&](double to) {
    for (const double place : evenly(last, to, gap_mm))
      if (place > last && place < to && is_small(place)) out.push_back(place);
  };
  for (const double place : at) {
    bridge(place);
    out.push_back(place);
    last = place;
  }
  bridge(borders.back());
  if (out.size() < 2) out = evenly(borders.front(), borders.back(), gap_mm);
  at = std::move(out);
}

}  // namespace

std::vector<MeasuringPoint> choose_by_spline(const ClLine& line, const SplineChoice& choice) {
  check_choice(line.points.size(), choice.tolerance_mm);
  const auto check = [](const char* what, double value_mm) {
    if (!(value_mm > 0.0) || !std::isfinite(value_mm))
      throw MotionError(fmt::format("{}: found {} mm, expected a finite number above 0", what, value_mm));
  };
  check("form wavelength", choice.form_wavelength_mm);
  check("placement", choice.placement_mm);
  check("ball radius", choice.ball_radius_mm);
  require_no_wall(line);
  const std::vector<Eigen::Vector3d> points = positions_mm(line);
  const std::vector<double> lengths = polygon_lengths_mm(points);
  const double gap_mm = choice.form_wavelength_mm / 5.0;
  if (lengths.back() / gap_mm > static_cast<double>(kMaxPoints))
    throw MotionError(
        fmt::format("form wavelength: {} mm asks for {:.3g} points on {:.6g} mm, expected at most {}",
                    choice.form_wavelength_mm, lengths.back() / gap_mm, lengths.back(), kMaxPoints));
  const std::vector<Eigen::Vector3d> across = directions_across(line, lengths);
  const std::vector<Fold> folds = folds_of(line, lengths);
  const std::vector<double> borders = face_borders_mm(folds, lengths.back());
  std::vector<double> at;
  for (std::size_t face = 0; face + 1 < borders.size(); ++face) {
    const double from_clear = face == 0 ? 0.0 : clear_mm(folds[face - 1], choice),
                 to_clear = face == folds.size() ? 0.0 : clear_mm(folds[face], choice);
    const double from = borders[face] + from_clear, to = borders[face + 1] - to_clear;
    if (to < from) continue;
    // From two touches so close the way to the fold couldn't be told.
    if (to - from < std::max(from_clear, to_clear)) {
      at.push_back(0.5 * (from + to));
      continue;
    }
    const std::vector<double> corners = corners_mm(line, lengths, from, to);
    for (std::size_t piece = 0; piece + 1 < corners.size(); ++piece) {
      const std::vector<double> on_piece =
          refine(line, across, lengths, evenly(corners[piece], corners[piece + 1], gap_mm),
                 0.5 * choice.tolerance_mm / choice.placement_mm);
      at.insert(at.end(), on_piece.begin() + (piece == 0 ? 0 : 1), on_piece.end());
    }
  }
  bridge_small_faces(borders, gap_mm, 2.0 * choice.placement_mm, at);
  std::vector<MeasuringPoint> out;
  for (const double place : at) out.push_back(place_on(line, lengths, place));
  return out;
}

}  // namespace meltstage::motion
