// SPDX-License-Identifier: Apache-2.0
#include "motion/align/prp.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "motion/align/prp_parts.hpp"
#include "motion/profile/check_positive.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;

Vector2d direction(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }
Vector2d normal(double angle_rad) { return {-std::sin(angle_rad), std::cos(angle_rad)}; }

/// Unit vectors along the sliders' ways.
std::array<Vector2d, 3> ways(const PrpGeometry& geometry) {
  return {direction(geometry.beta_rad[0]), normal(geometry.beta_rad[1]), normal(geometry.beta_rad[2])};
}

std::array<Vector2d, 3> joints_mm(const PrpGeometry& geometry, const PrpTurns& turns) {
  std::array<Vector2d, 3> joints{Vector2d(0.0, geometry.d_mm[0]), Vector2d(geometry.d_mm[1], 0.0),
                                 Vector2d(geometry.d_mm[2], 0.0)};
  const auto way = ways(geometry);
  for (std::size_t i = 0; i < 3; ++i)
    joints[i] += (geometry.offset_mm[i] + geometry.lead_mm[i] * turns[static_cast<int>(i)]) * way[i];
  return joints;
}

/// A lead of 0 would ask for turns without end.
void check_leads(const PrpGeometry& geometry) {
  for (std::size_t i = 0; i < 3; ++i)
    check_positive(fmt::format("stage geometry: lead of branch {}", i + 1), geometry.lead_mm[i], "mm");
}

}  // namespace

PrpTurns prp_inverse(const PrpGeometry& geometry, const PlanarPose& pose) {
  if (!std::isfinite(pose.x_mm) || !std::isfinite(pose.y_mm) || !std::isfinite(pose.angle_rad))
    throw MotionError(fmt::format("stage pose: found ({} mm, {} mm, {} rad), expected finite numbers",
                                  pose.x_mm, pose.y_mm, pose.angle_rad));
  check_leads(geometry);
  const auto parameters = prp_parts::to_vector(geometry);
  const auto travels = prp_parts::travels_mm(parameters.data(), pose.x_mm, pose.y_mm, pose.angle_rad);
  const PrpTurns turns{travels[0] / geometry.lead_mm[0], travels[1] / geometry.lead_mm[1],
                       travels[2] / geometry.lead_mm[2]};
  if (!turns.allFinite())
    throw MotionError(fmt::format(
        "stage geometry: found turns of {}, {}, {}, expected finite numbers: a parameter isn't one, "
        "or a slider's way runs along its guide",
        turns[0], turns[1], turns[2]));
  return turns;
}

PlanarPose prp_forward(const PrpGeometry& geometry, const PrpTurns& turns) {
  if (!turns.allFinite())
    throw MotionError(fmt::format("stage motors: found {}, {}, {} turns, expected finite numbers", turns[0],
                                  turns[1], turns[2]));
  check_leads(geometry);
  const auto joints = joints_mm(geometry, turns);
  const Vector2d span = joints[2] - joints[1];
  if (std::abs(geometry.link_mm) >= span.norm())
    throw MotionError(
        fmt::format("stage geometry: found links differing by {} mm over joints {} mm apart, expected less",
                    geometry.link_mm, span.norm()));
  const double along = std::atan2(span.y(), span.x()) - std::asin(geometry.link_mm / span.norm());
  const Vector2d n1 = normal(along + geometry.alpha1_rad), n2 = normal(along);
  Eigen::Matrix2d lines;
  lines << n1.transpose(), n2.transpose();
  const Vector2d place = lines.inverse() * Vector2d(n1.dot(joints[0]), n2.dot(joints[1]));
  return {place.x(), place.y(), along - geometry.alpha2_rad};
}

Eigen::Matrix3d prp_jacobian(const PrpGeometry& geometry, const PrpTurns& turns) {
  const PlanarPose pose = prp_forward(geometry, turns);
  const auto joints = joints_mm(geometry, turns);
  const auto way = ways(geometry);
  const double along = pose.angle_rad + geometry.alpha2_rad;
  const std::array<double, 3> guide{along + geometry.alpha1_rad, along, along};
  // Guide i: g = n (A - C) - c = 0, so that dg/dpose dpose + dg/dturns dturns = 0.
  Eigen::Matrix3d by_pose, by_turns = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const auto branch = static_cast<std::size_t>(i);
    const Vector2d n = normal(guide[branch]);
    const Vector2d arm = joints[branch] - Vector2d(pose.x_mm, pose.y_mm);
    by_pose.row(i) << -n.x(), -n.y(), -direction(guide[branch]).dot(arm);
    by_turns(i, i) = n.dot(way[branch]) * geometry.lead_mm[branch];
  }
  return -by_pose.inverse() * by_turns;
}

void check_stroke(const PrpGeometry& geometry, const PrpTurns& turns) {
  check_leads(geometry);
  for (int i = 0; i < 3; ++i) {
    const double travel_mm = turns[i] * geometry.lead_mm[static_cast<std::size_t>(i)];
    if (!(std::abs(travel_mm) <= geometry.stroke_mm))
      throw MotionError(
          fmt::format("stage pose out of reach: branch {} would travel {:.4f} mm, expected at most +-{} mm; "
                      "turn or move the board less",
                      i + 1, travel_mm, geometry.stroke_mm));
  }
}

PrpTurns displaced_turns(const PrpGeometry& geometry, const PrpTurns& now, const PlanarPose& by) {
  const PrpTurns turns = prp_inverse(geometry, compose(by, prp_forward(geometry, now)));
  check_stroke(geometry, turns);
  return turns;
}

PrpGeometry seen_from(const PrpGeometry& geometry, const Vector2d& origin_mm, double angle_rad) {
  check_leads(geometry);
  const PlanarPose to_frame = inverse_of({origin_mm.x(), origin_mm.y(), angle_rad});
  PrpGeometry seen = geometry;
  const auto joints = joints_mm(geometry, PrpTurns::Zero());
  for (std::size_t i = 0; i < 3; ++i) seen.beta_rad[i] = geometry.beta_rad[i] - angle_rad;
  seen.alpha2_rad = geometry.alpha2_rad;
  const auto way = ways(seen);
  for (std::size_t i = 0; i < 3; ++i) {
    // The joint at home is base + offset * way; the base lies on the frame's own axis.
    const Vector2d joint = moved(to_frame, joints[i]);
    const int free = i == 0 ? 0 : 1;
    seen.offset_mm[i] = joint[free] / way[i][free];
    seen.d_mm[i] = joint[1 - free] - seen.offset_mm[i] * way[i][1 - free];
  }
  return seen;
}

}  // namespace meltstage::motion
