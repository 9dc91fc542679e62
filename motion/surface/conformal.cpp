// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/conformal.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "motion/profile/check_positive.hpp"
#include "motion/profile/profile.hpp"
#include "motion/surface/smoothing.hpp"

namespace meltstage::motion {

namespace {

void check_touches(const ProbeLine& points, std::size_t touches) {
  if (points.points.size() < 2 || touches != points.points.size())
    throw MotionError(
        fmt::format("{}: found {} touches for {} measuring points, expected one each and 2 at least",
                    called(points.name), touches, points.points.size()));
}

void check_options(const ReconstructionOptions& options) {
  check_positive("ball radius", options.ball_radius_mm, "mm");
  check_positive("tolerance", options.tolerance_mm, "mm");
  check_positive("step", options.step_mm, "mm");
  if (!(options.noise_mm >= 0.0) || !std::isfinite(options.noise_mm))
    throw MotionError(
        fmt::format("noise of a touch: found {} mm, expected a finite number, 0 or more", options.noise_mm));
}

/// Normals across the line's own direction.
void square_normals(RealLine& line) {
  const std::size_t n = line.points_mm.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d along =
        (line.points_mm[std::min(i + 1, n - 1)] - line.points_mm[i == 0 ? 0 : i - 1]).normalized();
    line.normals[i] = (line.normals[i] - line.normals[i].dot(along) * along).normalized();
  }
}

void require_a_count(std::string_view name, double step_mm, double count) {
  if (!(count <= static_cast<double>(kMostLinePoints)))
    throw MotionError(
        fmt::format("{}: found a step of {} mm, which makes {:.6g} points of the line, expected at most {}",
                    called(name), step_mm, count, kMostLinePoints));
}

/// Places along a line, `step_mm` apart at most, the CAM system's points among them.
std::vector<double> places_mm(std::string_view name, const std::vector<double>& lengths, double step_mm) {
  const auto parts_of = [&](std::size_t i) {
    return std::max(1.0, std::ceil((lengths[i] - lengths[i - 1]) / step_mm - 1e-9));
  };
  double count = 1.0;
  for (std::size_t i = 1; i < lengths.size(); ++i) count += parts_of(i);
  require_a_count(name, step_mm, count);
  std::vector<double> out{0.0};
  for (std::size_t i = 1; i < lengths.size(); ++i) {
    const double gap = lengths[i] - lengths[i - 1], parts = parts_of(i);
    for (double k = 1.0; k <= parts; ++k)
      out.push_back(k == parts ? lengths[i] : lengths[i - 1] + gap * k / parts);
  }
  return out;
}

/// A cubic spline of one value over rising places.
class ValueSpline {
 public:
  ValueSpline(const std::vector<double>& at, const std::vector<double>& values)
      : first_(at.front()), scale_(1.0 / (at.back() - at.front())), curve_(make(at, values)) {}
  double operator()(double place) const { return curve_.position_mm((place - first_) * scale_).x(); }

 private:
  Nurbs make(const std::vector<double>& at, const std::vector<double>& values) const {
    std::vector<Eigen::Vector3d> points;
    std::vector<double> u;
    for (std::size_t i = 0; i < at.size(); ++i) {
      points.emplace_back(values[i], 0.0, 0.0);
      u.push_back(i + 1 == at.size() ? 1.0 : (at[i] - first_) * scale_);
    }
    return interpolate(points, u);
  }
  double first_, scale_;
  Nurbs curve_;
};

/// How far a spline is off that knows every second value only; a cubic spline with twice the points is about
/// 16 times better. Below five values nothing can be told.
std::optional<double> estimated_error(const std::vector<double>& at, const std::vector<double>& values) {
  if (at.size() < 5) return std::nullopt;
  std::vector<double> half_at, half_values;
  for (std::size_t i = 0; i < at.size(); i += 2) half_at.push_back(at[i]), half_values.push_back(values[i]);
  if (at.size() % 2 == 0) half_at.push_back(at.back()), half_values.push_back(values.back());
  const ValueSpline half(half_at, half_values);
  double worst = 0.0;
  for (std::size_t i = 1; i < at.size(); i += 2) worst = std::max(worst, std::abs(half(at[i]) - values[i]));
  return worst / 15.0;
}

void note_shifts(RealLine& line, const std::vector<double>& shifts) {
  for (const double shift : shifts) {
    line.shift_mean_mm += shift / static_cast<double>(shifts.size());
    line.shift_largest_mm = std::max(line.shift_largest_mm, std::abs(shift));
  }
}

/// A touch on a fold may be suspect on both faces; it is noted once.
void note_suspects(RealLine& line, const std::vector<SuspectTouch>& suspects) {
  for (const SuspectTouch& suspect : suspects) {
    const auto at =
        std::lower_bound(line.suspects.begin(), line.suspects.end(), suspect.touch,
                         [](const SuspectTouch& s, std::size_t touch) { return s.touch < touch; });
    if (at == line.suspects.end() || at->touch != suspect.touch) line.suspects.insert(at, suspect);
  }
}

std::vector<double> lengths_of(const ProbeLine& points) {
  std::vector<double> out;
  for (const MeasuringPoint& point : points.points) out.push_back(point.length_mm);
  return out;
}

/// Shifts along the normals if the ball touched on them: exact for a surface parallel to the nominal one.
std::vector<double> raw_shifts(const ProbeLine& points, std::span<const Eigen::Vector3d> touches,
                               double ball_radius_mm) {
  std::vector<double> out;
  for (std::size_t i = 0; i < touches.size(); ++i)
    out.push_back((touches[i] - points.points[i].position_mm).dot(points.points[i].axis) - ball_radius_mm);
  return out;
}

/// Lagrange's weights: the polynomial through values at these places has at `place` their sum by these
/// weights.
std::vector<double> polynomial_weights(std::span<const double> at, double place) {
  std::vector<double> out;
  for (const double a : at) {
    double weight = 1.0;
    for (const double b : at)
      if (b != a) weight *= (place - b) / (a - b);
    out.push_back(weight);
  }
  return out;
}

/// Touches of one face of the surface, and the shifts along its normals.
struct FaceTouches {
  std::vector<double> at_mm, shifts_mm;
  std::vector<std::size_t> touches;  // indices among the line's; none for a face that is bridged
};

/// Touches beside each other that are judged together: one, or two that the same dust lifted.
struct Group {
  std::size_t first = 0, size = 1;
};

/// What a group's neighbours say of it: two on each side, at an end the next three.
struct LeftOut {
  double off_mm;  ///< of its touch that is farthest off: the shift less the polynomial through the neighbours
  double size;    ///< the same in a measure of its own: in multiples of what noise makes of that difference
};

LeftOut left_out(const FaceTouches& face, const Group& group) {
  const std::size_t n = face.at_mm.size(), behind = group.first + group.size;
  const bool at_begin = group.first == 0, at_end = behind == n;
  const std::size_t count = at_begin || at_end ? 3 : 4;
  std::size_t first = std::min(group.first < 2 ? 0 : group.first - 2, n - count - group.size);
  if (at_end) first = n - count - group.size;
  std::vector<double> at, shifts;
  for (std::size_t k = first; at.size() < count; ++k)
    if (k < group.first || k >= behind) at.push_back(face.at_mm[k]), shifts.push_back(face.shifts_mm[k]);
  LeftOut worst{0.0, 0.0};
  for (std::size_t i = group.first; i < behind; ++i) {
    double said_mm = 0.0, squares = 1.0;
    const std::vector<double> weights = polynomial_weights(at, face.at_mm[i]);
    for (std::size_t k = 0; k < count; ++k) {
      said_mm += weights[k] * shifts[k];
      squares += weights[k] * weights[k];
    }
    const double off_mm = face.shifts_mm[i] - said_mm, size = std::abs(off_mm) / std::sqrt(squares);
    if (size >= worst.size) worst = {off_mm, size};
  }
  return worst;
}

/// How far each group of so many touches is off what its neighbours say.
std::vector<double> sizes_off(const FaceTouches& face, std::size_t group_size) {
  std::vector<double> out;
  for (std::size_t i = 0; i + group_size <= face.at_mm.size(); ++i)
    out.push_back(left_out(face, {i, group_size}).size);
  return out;
}

FaceTouches without(FaceTouches face, const Group& group) {
  const auto erase = [&](auto& list) {
    const auto at = list.begin() + static_cast<std::ptrdiff_t>(group.first);
    list.erase(at, at + static_cast<std::ptrdiff_t>(group.size));
  };
  erase(face.at_mm);
  erase(face.shifts_mm);
  erase(face.touches);
  return face;
}

/// The group without which the others agree best: a wrong one makes its neighbours look wrong too.
Group most_wrong(const FaceTouches& face, std::size_t group_size) {
  Group best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + group_size <= face.at_mm.size(); ++i) {
    const Group group{i, group_size};
    const std::vector<double> sizes = sizes_off(without(face, group), 1);
    const double largest = *std::max_element(sizes.begin(), sizes.end());
    if (largest < least) least = largest, best = group;
  }
  return best;
}

/// Whether a group is so far off the others that it is no part of their form and noise.
bool stands_out(const FaceTouches& face, const Group& group, double tolerance_mm) {
  constexpr double kDeviations = 8.0;   // standard deviations of the others
  constexpr double kOfMedian = 1.4826;  // a standard deviation by the median of normal values
  // Without it: a wrong touch spoils what its neighbours say of each other, on a short face the median of
  // them.
  std::vector<double> sizes = sizes_off(without(face, group), group.size);
  const LeftOut it = left_out(face, group);
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return it.size > kDeviations * kOfMedian * *middle && std::abs(it.off_mm) > tolerance_mm;
}

bool any_stands_out(const FaceTouches& face, std::size_t group_size, double tolerance_mm) {
  for (std::size_t i = 0; i + group_size <= face.at_mm.size(); ++i)
    if (stands_out(face, {i, group_size}, tolerance_mm)) return true;
  return false;
}

/// Touches that stand out from the others of their face, alone or two beside each other.
std::vector<SuspectTouch> suspects_of(const FaceTouches& face, double tolerance_mm) {
  constexpr std::size_t kFewestLeft = 6;
  const auto with = [&](FaceTouches sound, std::size_t touch) {
    const auto at = std::find(face.touches.begin(), face.touches.end(), touch) - face.touches.begin();
    const auto place =
        std::lower_bound(sound.touches.begin(), sound.touches.end(), touch) - sound.touches.begin();
    sound.at_mm.insert(sound.at_mm.begin() + place, face.at_mm[static_cast<std::size_t>(at)]);
    sound.shifts_mm.insert(sound.shifts_mm.begin() + place, face.shifts_mm[static_cast<std::size_t>(at)]);
    sound.touches.insert(sound.touches.begin() + place, touch);
    return std::pair{sound, Group{static_cast<std::size_t>(place)}};
  };
  FaceTouches sound = face;
  std::vector<std::size_t> taken;
  for (const std::size_t group_size : {std::size_t{2}, std::size_t{1}}) {
    while (sound.at_mm.size() >= kFewestLeft + group_size &&
           any_stands_out(sound, group_size, tolerance_mm)) {
      const Group group = most_wrong(sound, group_size);
      for (std::size_t i = group.first; i < group.first + group.size; ++i) taken.push_back(sound.touches[i]);
      sound = without(std::move(sound), group);
    }
  }
  // One that was taken for another one's sake comes back.
  std::vector<SuspectTouch> out;
  for (const std::size_t touch : taken) {
    auto [all, it] = with(sound, touch);
    if (sound.at_mm.size() < kFewestLeft || stands_out(all, it, tolerance_mm))
      out.push_back({touch, left_out(all, it).off_mm});
    else
      sound = std::move(all);
  }
  return out;
}

/// A face's shift by place: a spline through its touches, beyond them straight on.
class FaceShift {
 public:
  explicit FaceShift(const FaceTouches& face)
      : face_(face), first_(face.at_mm.front()), last_(face.at_mm.back()), at_first_(face.shifts_mm.front()) {
    if (face.at_mm.size() < 2) return;
    spline_.emplace(face.at_mm, face.shifts_mm);
    const double step = std::min(0.05, last_ - first_);
    at_last_ = face.shifts_mm.back();
    slope_first_ = ((*spline_)(first_ + step) - at_first_) / step;
    slope_last_ = (at_last_ - (*spline_)(last_ - step)) / step;
  }
  double operator()(double place) const {
    if (!spline_) return at_first_;
    if (place < first_) return at_first_ + slope_first_ * (place - first_);
    if (place > last_) return at_last_ + slope_last_ * (place - last_);
    return (*spline_)(place);
  }
  /// How far off it may be at a place beyond the touches: what a parabola and a cubic through the next of
  /// them say there.
  double error_beyond(double place) const {
    if (place >= first_ && place <= last_) return 0.0;
    double worst = 0.0;
    for (const std::size_t wanted : {std::size_t{3}, std::size_t{4}}) {
      const std::size_t count = std::min(wanted, face_.at_mm.size());
      const std::size_t begin = place < first_ ? 0 : face_.at_mm.size() - count;
      const auto weights = polynomial_weights(std::span(face_.at_mm).subspan(begin, count), place);
      const double said = std::inner_product(
          weights.begin(), weights.end(), face_.shifts_mm.begin() + static_cast<std::ptrdiff_t>(begin), 0.0);
      worst = std::max(worst, std::abs((*this)(place)-said));
    }
    return worst;
  }

 private:
  FaceTouches face_;
  double first_, last_, at_first_, at_last_ = 0.0, slope_first_ = 0.0, slope_last_ = 0.0;
  std::optional<ValueSpline> spline_;
};

/// The ball touches beside the normal where the real surface is steeper or flatter along the line than the
/// nominal one: seen along the normal its radius counts as radius / cos(angle between them).
void allow_for_slope(FaceTouches& face, double ball_radius_mm) {
  const std::vector<double>& at = face.at_mm;
  if (at.size() < 2) return;
  const ValueSpline spline(at, face.shifts_mm);
  constexpr double kStep_mm = 0.05;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double low = std::max(at.front(), at[i] - kStep_mm), high = std::min(at.back(), at[i] + kStep_mm);
    const double slope = (spline(high) - spline(low)) / (high - low);
    face.shifts_mm[i] -= ball_radius_mm * (std::sqrt(1.0 + slope * slope) - 1.0);
  }
}

/// Shift of both faces from a touch on their fold, on the axis between them: in a valley the ball rests on
/// both, on a ridge it meets the ridge.
double shift_at_fold(const Fold& fold, double shift_mm, double ball_radius_mm) {
  return fold.is_hollow() ? (shift_mm + ball_radius_mm) * fold.half_cosine() - ball_radius_mm
                          : shift_mm * fold.half_cosine();
}

/// Deals the touches out to the faces; one that lies so close to a valley's bottom that the ball met the
/// other face tells nothing of its own.
std::vector<FaceTouches> deal_out(const std::vector<Fold>& folds, const std::vector<double>& at,
                                  const std::vector<double>& shifts, double ball_radius_mm) {
  constexpr double kSame_mm = 1e-6;
  std::vector<FaceTouches> out(folds.size() + 1);
  const auto add = [&](std::size_t face, std::size_t touch, double place, double shift) {
    out[face].at_mm.push_back(place);
    out[face].shifts_mm.push_back(shift);
    out[face].touches.push_back(touch);
  };
  for (std::size_t i = 0; i < at.size(); ++i) {
    const auto behind = std::partition_point(
        folds.begin(), folds.end(), [&](const Fold& fold) { return fold.length_mm < at[i] - kSame_mm; });
    const auto face = static_cast<std::size_t>(behind - folds.begin());
    if (behind != folds.end() && behind->length_mm < at[i] + kSame_mm) {
      const double shift = shift_at_fold(*behind, shifts[i], ball_radius_mm);
      add(face, i, behind->length_mm, shift);
      add(face + 1, i, behind->length_mm, shift);
      continue;
    }
    const bool shadowed =
        (behind != folds.end() && behind->length_mm - at[i] < behind->shadow_mm(ball_radius_mm)) ||
        (face > 0 && at[i] - folds[face - 1].length_mm < folds[face - 1].shadow_mm(ball_radius_mm));
    if (!shadowed) add(face, i, at[i], shifts[i]);
  }
  return out;
}

/// A face that wasn't touched goes evenly from the shift of the one before to that of the one behind; how far
/// they differ at most.
double bridge_untouched(std::vector<FaceTouches>& faces, const std::vector<double>& borders,
                        std::size_t& untouched) {
  double widest_mm = 0.0;
  std::optional<double> before_mm;
  for (std::size_t face = 0; face < faces.size(); ++face) {
    if (!faces[face].at_mm.empty()) {
      before_mm = faces[face].shifts_mm.back();
      continue;
    }
    std::size_t next = face;
    while (next < faces.size() && faces[next].at_mm.empty()) ++next;
    if (next == faces.size() && !before_mm) return widest_mm;  // no touch at all
    const double behind_mm = next == faces.size() ? *before_mm : faces[next].shifts_mm.front();
    const double from_mm = before_mm.value_or(behind_mm);
    widest_mm = std::max(widest_mm, std::abs(behind_mm - from_mm));
    const auto shift_at = [&](double place) {
      return from_mm + (behind_mm - from_mm) * (place - borders[face]) / (borders[next] - borders[face]);
    };
    const std::size_t first = face;
    untouched += next - first;
    std::vector<FaceTouches> bridge;
    for (std::size_t i = first; i < next; ++i)
      bridge.push_back({{borders[i], borders[i + 1]}, {shift_at(borders[i]), shift_at(borders[i + 1])}, {}});
    std::move(bridge.begin(), bridge.end(), faces.begin() + static_cast<std::ptrdiff_t>(first));
    face = next - 1;
  }
  return widest_mm;
}

/// Where two faces meet that are shifted by these; in their middle if that is farther along the line than
/// `farthest_mm`.
Eigen::Vector3d shifted_fold(const Fold& fold, double before_mm, double behind_mm, double farthest_mm) {
  const double cosine = fold.normal_before.dot(fold.normal_behind), square = 1.0 - cosine * cosine;
  const Eigen::Vector3d meet = ((before_mm - cosine * behind_mm) * fold.normal_before +
                                (behind_mm - cosine * before_mm) * fold.normal_behind) /
                               square;
  if (std::abs(meet.dot(fold.way_before)) <= farthest_mm &&
      std::abs(meet.dot(fold.way_behind)) <= farthest_mm)
    return fold.position_mm + meet;
  return fold.position_mm + 0.5 * (before_mm + behind_mm) * fold.axis();
}

/// How far off the fold may be where the shifts of its faces may be off by these.
double fold_error_mm(const Fold& fold, double before_error_mm, double behind_error_mm) {
  double worst_mm = 0.0;
  for (const double sign : {-1.0, 1.0})
    worst_mm = std::max(worst_mm, (shifted_fold(fold, before_error_mm, sign * behind_error_mm,
                                                std::numeric_limits<double>::infinity()) -
                                   fold.position_mm)
                                      .norm());
  return worst_mm;
}

/// Adds a shifted face to the line so far, whose last face begins at a point of it; both end where they meet:
/// the index of that point.
std::size_t join(RealLine& line, std::size_t face_begin, const Fold& fold, const Eigen::Vector3d& at_mm,
                 const RealLine& face) {
  constexpr double kSame_mm = 1e-3;
  const auto beyond = [&](const Eigen::Vector3d& point, const Eigen::Vector3d& way) {
    return (at_mm - point).dot(way) < kSame_mm;
  };
  while (line.points_mm.size() > face_begin + 1 && beyond(line.points_mm.back(), fold.way_before)) {
    line.points_mm.pop_back();
    line.normals.pop_back();
  }
  std::size_t first = 0;
  while (first + 1 < face.points_mm.size() && beyond(face.points_mm[first], -fold.way_behind)) ++first;
  const std::size_t out = line.points_mm.size();
  line.points_mm.push_back(at_mm);
  line.normals.push_back(fold.axis());
  line.points_mm.insert(line.points_mm.end(), face.points_mm.begin() + static_cast<std::ptrdiff_t>(first),
                        face.points_mm.end());
  line.normals.insert(line.normals.end(), face.normals.begin() + static_cast<std::ptrdiff_t>(first),
                      face.normals.end());
  return out;
}

}  // namespace

RealLine reconstruct_as_published(const ClLine& line, const ProbeLine& points,
                                  std::span<const Eigen::Vector3d> touches,
                                  const ReconstructionOptions& options) {
  require_two_points(line.name, line.points.size());
  check_touches(points, touches.size());
  check_options(options);
  RealLine out{.name = line.name, .points_mm = {}, .normals = {}, .lengths_mm = {}};
  const std::vector<double> shifts = raw_shifts(points, touches, options.ball_radius_mm);
  note_shifts(out, shifts);
  std::vector<Eigen::Vector3d> real;
  for (std::size_t i = 0; i < touches.size(); ++i)
    real.push_back(touches[i] - options.ball_radius_mm * points.points[i].axis);
  const std::vector<double> u = point_parameters(real, Parameters::chord_length);
  const Nurbs curve = interpolate(real, u);
  const ArcLength length(curve);
  const std::vector<double> lengths = polygon_lengths_mm(positions_mm(line));
  const double parts = std::ceil(length.total_mm() / options.step_mm);
  require_a_count(line.name, options.step_mm, parts + 1.0);
  const auto steps = static_cast<std::size_t>(parts);
  std::size_t gap = 1;
  for (std::size_t i = 0; i <= steps; ++i) {
    const double at =
        length.parameter(length.total_mm() * static_cast<double>(i) / static_cast<double>(steps));
    while (gap + 1 < u.size() && u[gap] < at) ++gap;
    const double share = (at - u[gap - 1]) / (u[gap] - u[gap - 1]);
    const double nominal_mm = points.points[gap - 1].length_mm +
                              share * (points.points[gap].length_mm - points.points[gap - 1].length_mm);
    out.points_mm.push_back(curve.position_mm(at));
    out.normals.push_back(place_on(line, lengths, nominal_mm).axis);
  }
  out.lengths_mm = polygon_lengths_mm(out.points_mm);
  square_normals(out);
  return out;
}

namespace {

/// What a face may be off between its touches; smooths them where the noise asks for it.
std::optional<double> face_error(FaceTouches& face, const ReconstructionOptions& options, bool& smoothed) {
  if (3.0 * options.noise_mm <= 0.25 * options.tolerance_mm || face.at_mm.size() < 4)
    return estimated_error(face.at_mm, face.shifts_mm);
  std::vector<double>& shifts = face.shifts_mm;
  const Eigen::MatrixXd measured =
      Eigen::Map<const Eigen::VectorXd>(shifts.data(), static_cast<Eigen::Index>(shifts.size()));
  const SmoothedValues smooth_shifts = smooth(face.at_mm, measured, options.noise_mm);
  std::copy(smooth_shifts.values.data(), smooth_shifts.values.data() + shifts.size(), shifts.begin());
  smoothed = true;
  const std::optional<double> between_mm = estimated_error(face.at_mm, shifts);
  if (!between_mm) return std::nullopt;
  return *between_mm + smooth_shifts.standard_error.maxCoeff();
}

/// The line's points, each face shifted along its normals, and normals square to what comes out. How far off
/// the folds may be, to which the touches don't reach.
double append_faces(const ClLine& line, const std::vector<double>& lengths, const std::vector<Fold>& folds,
                    const std::vector<double>& borders, const std::vector<FaceTouches>& faces, double step_mm,
                    RealLine& out) {
  const std::vector<double> places = places_mm(line.name, lengths, step_mm);
  std::vector<std::size_t> fold_at;
  double end_shift_mm = 0.0, end_error_mm = 0.0, worst_fold_mm = 0.0;
  auto first = places.begin();
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const FaceShift shift(faces[i]);
    const auto last =
        i == folds.size() ? places.end() - 1 : std::lower_bound(first, places.end(), folds[i].length_mm);
    RealLine face{.name = {}, .points_mm = {}, .normals = {}, .lengths_mm = {}};
    for (auto at = first; at <= last; ++at) {
      const MeasuringPoint place = place_on(line, lengths, *at);
      const Eigen::Vector3d normal = i > 0 && at == first             ? folds[i - 1].normal_behind
                                     : i < folds.size() && at == last ? folds[i].normal_before
                                                                      : place.axis;
      face.points_mm.push_back(place.position_mm + shift(*at) * normal);
      face.normals.push_back(normal);
    }
    if (i == 0) {
      out.points_mm = std::move(face.points_mm);
      out.normals = std::move(face.normals);
    } else {
      const double shorter_mm = std::min(borders[i + 1] - borders[i], borders[i] - borders[i - 1]);
      const Eigen::Vector3d at_mm =
          shifted_fold(folds[i - 1], end_shift_mm, shift(*first), std::min(1.0, 0.5 * shorter_mm));
      fold_at.push_back(join(out, fold_at.empty() ? 0 : fold_at.back(), folds[i - 1], at_mm, face));
      worst_fold_mm =
          std::max(worst_fold_mm, fold_error_mm(folds[i - 1], end_error_mm, shift.error_beyond(*first)));
    }
    end_shift_mm = shift(*last);
    end_error_mm = shift.error_beyond(*last);
    first = last;
  }
  square_normals(out);
  for (std::size_t i = 0; i < folds.size(); ++i) out.normals[fold_at[i]] = folds[i].axis();
  return worst_fold_mm;
}

}  // namespace

RealLine reconstruct(const ClLine& line, const ProbeLine& points, std::span<const Eigen::Vector3d> touches,
                     const ReconstructionOptions& options) {
  require_two_points(line.name, line.points.size());
  check_touches(points, touches.size());
  check_options(options);
  const std::vector<double> lengths = polygon_lengths_mm(positions_mm(line));
  const std::vector<Fold> folds = folds_of(line, lengths);
  const std::vector<double> borders = face_borders_mm(folds, lengths.back());
  std::vector<FaceTouches> faces = deal_out(
      folds, lengths_of(points), raw_shifts(points, touches, options.ball_radius_mm), options.ball_radius_mm);
  RealLine out{.name = line.name, .points_mm = {}, .normals = {}, .lengths_mm = {}};
  std::vector<double> all_shifts;
  for (FaceTouches& face : faces) {
    allow_for_slope(face, options.ball_radius_mm);
    all_shifts.insert(all_shifts.end(), face.shifts_mm.begin(), face.shifts_mm.end());
    note_suspects(out, suspects_of(face, options.tolerance_mm));
    const std::optional<double> error_mm = face_error(face, options, out.smoothed);
    if (error_mm)
      out.estimated_error_mm = std::max(out.estimated_error_mm.value_or(0.0), *error_mm);
    else if (!face.at_mm.empty())
      ++out.unjudged_faces;
  }
  if (all_shifts.empty())
    throw MotionError(
        fmt::format("{}: no touch lies on one face alone, expected points beside the valleys; choose other "
                    "points, or a smaller ball",
                    called(line.name)));
  note_shifts(out, all_shifts);
  for (const SuspectTouch& suspect : out.suspects)
    out.estimated_error_mm = std::max(out.estimated_error_mm.value_or(0.0), std::abs(suspect.off_mm));
  const double bridged_mm = bridge_untouched(faces, borders, out.untouched_faces);
  if (out.untouched_faces > 0)
    out.estimated_error_mm = std::max(out.estimated_error_mm.value_or(0.0), bridged_mm);
  const double fold_mm = append_faces(line, lengths, folds, borders, faces, options.step_mm, out);
  if (out.estimated_error_mm) out.estimated_error_mm = std::max(*out.estimated_error_mm, fold_mm);
  out.lengths_mm = polygon_lengths_mm(out.points_mm);
  return out;
}

RealLine nominal_line(const ClLine& line, double step_mm) {
  require_two_points(line.name, line.points.size());
  check_positive("step", step_mm, "mm");
  RealLine out{.name = line.name, .points_mm = {}, .normals = {}, .lengths_mm = {}};
  const std::vector<double> lengths = polygon_lengths_mm(positions_mm(line));
  for (const double place : places_mm(line.name, lengths, step_mm)) {
    const MeasuringPoint point = place_on(line, lengths, place);
    out.points_mm.push_back(point.position_mm);
    out.normals.push_back(point.axis);
  }
  out.lengths_mm = polygon_lengths_mm(out.points_mm);
  return out;
}

}  // namespace meltstage::motion
