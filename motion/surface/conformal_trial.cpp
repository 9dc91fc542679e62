// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/conformal_trial.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace meltstage::motion {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFirst_mm = 4.0, kSpan_mm = 32.0;  // of every line in x

Eigen::Vector3d trial_normal(double x_mm, double y_mm) {
  constexpr double kStep_mm = 1e-4;
  const double gx =
      (trial_height_mm(x_mm + kStep_mm, y_mm) - trial_height_mm(x_mm - kStep_mm, y_mm)) / (2.0 * kStep_mm);
  const double gy =
      (trial_height_mm(x_mm, y_mm + kStep_mm) - trial_height_mm(x_mm, y_mm - kStep_mm)) / (2.0 * kStep_mm);
  return Eigen::Vector3d(-gx, -gy, 1.0).normalized();
}

/// A line of the view from above, laid on the face.
ClLine laid(const std::string& name, const std::vector<Eigen::Vector2d>& plan) {
  ClLine line{name, {}};
  for (const Eigen::Vector2d& p : plan)
    line.points.push_back({{p.x(), p.y(), trial_height_mm(p.x(), p.y())}, trial_normal(p.x(), p.y()), 0});
  return line;
}

constexpr int kSteps = 320;

std::vector<Eigen::Vector2d> straight(double y_mm) {
  std::vector<Eigen::Vector2d> out;
  for (int i = 0; i <= kSteps; ++i) out.emplace_back(kFirst_mm + kSpan_mm * i / kSteps, y_mm);
  return out;
}

std::vector<Eigen::Vector2d> arc(double y_mm) {
  constexpr double kRadius_mm = 40.0;
  const double half = std::asin(0.5 * kSpan_mm / kRadius_mm);
  const double centre_y = y_mm - kRadius_mm * std::cos(half);
  std::vector<Eigen::Vector2d> out;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = half * (2.0 * i / kSteps - 1.0);
    out.emplace_back(kFirst_mm + 0.5 * kSpan_mm + kRadius_mm * std::sin(angle),
                     centre_y + kRadius_mm * std::cos(angle));
  }
  return out;
}

std::vector<Eigen::Vector2d> free_curve(double y_mm) {
  constexpr std::array kOffsets_mm{0.0, 1.2, -0.8, 1.0, -1.1, 0.7, 0.0};
  std::vector<Eigen::Vector3d> through;
  for (std::size_t i = 0; i < kOffsets_mm.size(); ++i)
    through.emplace_back(kFirst_mm + kSpan_mm * static_cast<double>(i) / (kOffsets_mm.size() - 1),
                         y_mm + kOffsets_mm[i], 0.0);
  const Nurbs curve = interpolate(through);
  const ArcLength length(curve);
  std::vector<Eigen::Vector2d> out;
  for (int i = 0; i <= kSteps; ++i)
    out.push_back(curve.position_mm(length.parameter(length.total_mm() * i / kSteps)).head<2>());
  return out;
}

}  // namespace

double trial_height_mm(double x_mm, double y_mm) {
  return 6.0 + 1.5 * std::sin(2.0 * kPi * x_mm / 31.0 + 0.6) * std::cos(2.0 * kPi * y_mm / 52.0) +
         0.6 * std::sin(2.0 * kPi * (x_mm + 0.6 * y_mm) / 17.0);
}

std::vector<ClLine> trial_lines() {
  std::vector<ClLine> lines;
  for (int i = 0; i < 9; ++i) {
    const double y_mm = 6.0 + 4.0 * i + (i >= 6 ? 6.0 : 0.0);
    const auto plan = i < 3 ? straight(y_mm) : i < 6 ? arc(y_mm) : free_curve(y_mm);
    lines.push_back(laid(fmt::format("line {}", i + 1), plan));
  }
  return lines;
}

std::vector<double> trial_heights_mm() { return {0.08, 0.10, 0.11, 0.08, 0.10, 0.11, 0.08, 0.10, 0.11}; }

FaceError::Modes FaceError::shapes(double x_mm, double y_mm) {
  Eigen::Matrix<double, kAlong, 1> along;
  Eigen::Matrix<double, 1, kAcross> across;
  for (int i = 0; i < kAlong; ++i) along[i] = std::cos(kPi * i * x_mm / 40.0);
  for (int j = 0; j < kAcross; ++j) across[j] = std::cos(kPi * j * y_mm / 60.0);
  return along * across;
}

const FaceError& paper_error() {
  // By `meltstage conformal calibrate`, um.
  static const FaceError error = [] {
    FaceError out;
    out.modes_mm << -6.448, -5.753, -8.141, 4.989, 0.229, 1.301, -4.542, 5.739, 5.119, -3.662, 9.050,  //
        -1.570, -9.508, -3.251, 9.765, 4.288, -2.279, -3.412, -3.959, -3.324, 0.350, 3.059,            //
        -5.507, 5.433, -5.810, -2.527, 4.337, -12.715, -1.647, 6.607, -2.614, 5.962, 0.533,            //
        0.847, -1.827, 5.532, 5.032, -4.455, 6.558, -0.865, -7.172, 1.391, -0.939, -1.127,             //
        -10.573, 6.505, 7.335, -6.498, 0.897, -3.534, 1.372, 0.407, -2.047, 2.490, 0.300,              //
        1.123, 5.073, 3.093, -0.806, 2.868, 0.642, -4.298, 0.007, -1.352, -1.623, 0.439,               //
        -3.165, 6.097, 0.458, -2.638, 4.022, -0.488, -2.136, -0.756, -0.756, -0.521, -0.509,           //
        -1.946, -2.919, -1.833, -1.947, -2.855, 1.510, 2.466, 1.781, 2.009, 0.345, -0.131;
    out.modes_mm *= 1e-3;
    return out;
  }();
  return error;
}

RealPart make_trial_part(const FaceError& error) {
  return {[error](double x, double y) { return trial_height_mm(x, y) + error.at_mm(x, y); }};
}

RealPart make_trial_part(const PartErrors& errors, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  struct Wave {
    double kx, ky, phase, amplitude_mm;
  };
  constexpr int kWaves = 12;
  constexpr double kLongest_mm = 40.0;
  std::vector<Wave> waves;
  for (int i = 0; i < kWaves; ++i) {
    // Wavelengths evenly in their logarithm, longer ones stronger, as errors of form are.
    const double wavelength_mm =
        errors.shortest_wave_mm * std::pow(kLongest_mm / errors.shortest_wave_mm, uniform(random));
    const double direction = 2.0 * kPi * uniform(random);
    waves.push_back({2.0 * kPi / wavelength_mm * std::cos(direction),
                     2.0 * kPi / wavelength_mm * std::sin(direction), 2.0 * kPi * uniform(random),
                     wavelength_mm * std::abs(normal(random))});
  }
  double square = 0.0;
  for (const Wave& wave : waves) square += 0.5 * wave.amplitude_mm * wave.amplitude_mm;
  for (Wave& wave : waves) wave.amplitude_mm *= errors.form_mm / std::sqrt(square);
  RealPart part;
  part.height_mm = [waves](double x, double y) {
    double z = trial_height_mm(x, y);
    for (const Wave& wave : waves) z += wave.amplitude_mm * std::sin(wave.kx * x + wave.ky * y + wave.phase);
    return z;
  };
  const Eigen::Vector3d middle(20.0, 30.0, 0.0);
  part.placement = Eigen::Translation3d(middle + Eigen::Vector3d(errors.shift_mm * normal(random),
                                                                 errors.shift_mm * normal(random),
                                                                 errors.height_mm * normal(random))) *
                   Eigen::AngleAxisd(errors.tilt_rad * normal(random), Eigen::Vector3d::UnitX()) *
                   Eigen::AngleAxisd(errors.tilt_rad * normal(random), Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(errors.tilt_rad * normal(random), Eigen::Vector3d::UnitZ()) *
                   Eigen::Translation3d(-middle);
  return part;
}

std::vector<double> gaps_mm(const RealLine& line, double height_mm, const RealPart& part) {
  constexpr double kReach_mm = 3.0;
  std::vector<double> out;
  for (std::size_t i = 0; i < line.points_mm.size(); ++i) {
    const Eigen::Vector3d tip = line.points_mm[i] + height_mm * line.normals[i];
    out.push_back((tip - surface_along(part, tip, line.normals[i], kReach_mm)).dot(line.normals[i]));
  }
  return out;
}

double largest_gap_error_mm(const RealLine& line, const RealPart& part) {
  double worst = 0.0;
  for (const double gap : gaps_mm(line, 0.0, part)) worst = std::max(worst, std::abs(gap));
  return worst;
}

std::vector<TrialLineResult> run_trial(const RealPart& part, Compensation compensation,
                                       const DepositionModel& deposition, std::uint64_t seed,
                                       double chord_error_mm) {
  constexpr double kTimingLeft = 0.1;  // of the valve's excess, with lead and lag known to a tenth
  const std::vector<double> heights = trial_heights_mm();
  const TouchProbeModel model;
  TouchProbe probe(model, seed);
  ProbeProgramOptions program;
  program.ball_radius_mm = model.ball_radius_mm;
  const ReconstructionOptions options{.ball_radius_mm = effective_radius_mm(model),
                                      .noise_mm = model.noise_mm};
  std::vector<TrialLineResult> out;
  for (const ClLine& line : trial_lines()) {
    const std::size_t i = out.size();
    TrialLineResult result;
    RealLine rebuilt;
    if (compensation == Compensation::none) {
      rebuilt = nominal_line(line);
    } else {
      const bool full = compensation == Compensation::full;
      const ProbeLine points{
          line.name, full ? choose_by_spline(line, {})
                          : measuring_points(line, choose_by_chord(positions_mm(line), chord_error_mm))};
      const std::vector<Eigen::Vector3d> touches = touch_all(part, {&points, 1}, program, probe);
      rebuilt = full ? reconstruct(line, points, touches, options)
                     : reconstruct_as_published(line, points, touches, options);
      result.touches = touches.size();
    }
    result.gaps_mm = gaps_mm(rebuilt, heights[i], part);
    for (const double gap : result.gaps_mm)
      result.gap_error_mm = std::max(result.gap_error_mm, std::abs(gap - heights[i]));
    result.deposited = deposit(deposition, rebuilt.lengths_mm, result.gaps_mm,
                               compensation == Compensation::full ? kTimingLeft : 1.0, seed * 16 + i);
    result.width = measure_widths(result.deposited);
    result.resistance_ohm = result.deposited.resistance_ohm;
    out.push_back(std::move(result));
  }
  return out;
}

}  // namespace meltstage::motion
