// SPDX-License-Identifier: Apache-2.0
// The 3-PRP stage as one template over the number type: doubles, and Ceres' Jets in the calibration.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "motion/align/prp.hpp"

namespace meltstage::motion::prp_parts {

constexpr int kParameters = 15;
using Parameters = Eigen::Matrix<double, kParameters, 1>;

/// Places of the parameters in a vector.
enum Place { kLead = 0, kOffset = 3, kD = 6, kBeta = 9, kLink = 12, kAlpha1 = 13, kAlpha2 = 14 };

inline Parameters to_vector(const PrpGeometry& geometry) {
  Parameters v;
  for (int i = 0; i < 3; ++i) {
    const auto branch = static_cast<std::size_t>(i);
    v[kLead + i] = geometry.lead_mm[branch];
    v[kOffset + i] = geometry.offset_mm[branch];
    v[kD + i] = geometry.d_mm[branch];
    v[kBeta + i] = geometry.beta_rad[branch];
  }
  v[kLink] = geometry.link_mm;
  v[kAlpha1] = geometry.alpha1_rad;
  v[kAlpha2] = geometry.alpha2_rad;
  return v;
}

/// The stroke is no parameter of the kinematics: it is kept from `nominal`.
inline PrpGeometry to_geometry(const Parameters& v, PrpGeometry nominal) {
  for (int i = 0; i < 3; ++i) {
    const auto branch = static_cast<std::size_t>(i);
    nominal.lead_mm[branch] = v[kLead + i];
    nominal.offset_mm[branch] = v[kOffset + i];
    nominal.d_mm[branch] = v[kD + i];
    nominal.beta_rad[branch] = v[kBeta + i];
  }
  nominal.link_mm = v[kLink];
  nominal.alpha1_rad = v[kAlpha1];
  nominal.alpha2_rad = v[kAlpha2];
  return nominal;
}

/// Travel of each slider from home, R p. The guide of branch i is the line n (A - C) = c with the slider's
/// place A = base + (offset + travel) u: one linear equation each.
template <typename T>
std::array<T, 3> travels_mm(const T* v, const T& x, const T& y, const T& angle) {
  using std::cos;
  using std::sin;
  const T along = angle + v[kAlpha2], across = along + v[kAlpha1];
  const T c1 = cos(across), s1 = sin(across), c = cos(along), s = sin(along);
  // n = (-sin, cos) of the guide; u of the branches: (cos, sin), (-sin, cos), (-sin, cos) of beta.
  const T first = (-s1 * x + c1 * (y - v[kD])) / (-s1 * cos(v[kBeta]) + c1 * sin(v[kBeta]));
  const T second = (-s * (x - v[kD + 1]) + c * y) / (s * sin(v[kBeta + 1]) + c * cos(v[kBeta + 1]));
  const T third = (-s * (x - v[kD + 2]) + c * y + v[kLink]) / (s * sin(v[kBeta + 2]) + c * cos(v[kBeta + 2]));
  return {first - v[kOffset], second - v[kOffset + 1], third - v[kOffset + 2]};
}

}  // namespace meltstage::motion::prp_parts
