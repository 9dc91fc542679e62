// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/trial_calibration.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "motion/surface/cl_points.hpp"

namespace meltstage::motion {

namespace {

/// What is assumed of a number of the deposition model: log-normal. The paper's nozzle is conical. Flow in
/// series through a cone (half angle b, opening d) and the radial slit under its face (outer radius q times
/// the inner one): both resist alike at a gap of (36 tan b ln q / 128)^(1/3) d, which is 57 um for 10
/// degrees, 1.6 and 0.2 mm.
struct Assumed {
  double DepositionModel::*number;
  double median, log_deviation;
};
constexpr std::array<Assumed, 10> kAssumed{{{&DepositionModel::section_mm2, 0.045, 1.0},
                                            {&DepositionModel::slit_gap_mm, 0.057, 0.3},
                                            {&DepositionModel::stringing_gap_mm, 0.13, 0.06},
                                            {&DepositionModel::stringing_mm, 0.006, 0.7},
                                            {&DepositionModel::least_share, 0.01, 1.0},
                                            {&DepositionModel::thinning, 0.25, 0.3},
                                            {&DepositionModel::resistivity_ohm_mm, 1e-3, 1.0},
                                            {&DepositionModel::end_excess, 0.4, 0.5},
                                            {&DepositionModel::end_mm, 2.0, 0.3},
                                            {&DepositionModel::width_noise_mm, 0.025, 0.5}}};

constexpr double kErrorRms_mm = 0.045, kSmooth_mm = 14.0;
constexpr int kModes = FaceError::kAlong * FaceError::kAcross;
constexpr int kNumbers = kModes + static_cast<int>(kAssumed.size());

struct StrungPlace {
  std::size_t line;
  double from_mm, to_mm;
};
constexpr std::array<StrungPlace, 5> kStrung{{{1, 5, 8}, {1, 17, 19}, {5, 14, 18}, {8, 11, 13}, {8, 29, 31}}};

/// Standard deviations of the modes before: even for long waves, falling with the fourth power of the wave
/// number for short ones.
FaceError assumed_error() {
  FaceError out;
  double square = 0.0;
  for (int i = 0; i < FaceError::kAlong; ++i)
    for (int j = 0; j < FaceError::kAcross; ++j) {
      const double waves = kSmooth_mm * std::hypot(i / 80.0, j / 120.0);
      const double share = 1.0 / (1.0 + std::pow(waves, 4));
      out.modes_mm(i, j) = share;
      square += share * share * (i == 0 ? 1.0 : 0.5) * (j == 0 ? 1.0 : 0.5);
    }
  out.modes_mm *= kErrorRms_mm / std::sqrt(square);
  return out;
}

/// Fitted numbers in units of their standard deviations before.
class Problem {
 public:
  Problem() : lines_(trial_lines()), heights_mm_(trial_heights_mm()), assumed_(assumed_error()) {
    for (const ClLine& line : lines_) {
      Eigen::MatrixXd modes(line.points.size(), kModes);
      for (std::size_t n = 0; n < line.points.size(); ++n) {
        const Eigen::Vector3d& p = line.points[n].position_mm;
        // The gap is smaller by what the part is higher, across the face.
        modes.row(n) = -line.points[n].axis.z() * FaceError::shapes(p.x(), p.y()).reshaped().transpose();
      }
      modes_.push_back(modes);
      lengths_mm_.push_back(polygon_lengths_mm(positions_mm(line)));
    }
  }

  Eigen::VectorXd numbers(const DepositionModel& deposition, const FaceError& error) const {
    Eigen::VectorXd out(kNumbers);
    out.head(kModes) = (error.modes_mm.array() / assumed_.modes_mm.array()).matrix().reshaped();
    for (std::size_t i = 0; i < kAssumed.size(); ++i)
      out[kModes + i] =
          std::log(deposition.*kAssumed[i].number / kAssumed[i].median) / kAssumed[i].log_deviation;
    return out;
  }

  DepositionModel deposition(const Eigen::VectorXd& numbers) const {
    DepositionModel out;
    for (std::size_t i = 0; i < kAssumed.size(); ++i)
      out.*kAssumed[i].number =
          kAssumed[i].median * std::exp(kAssumed[i].log_deviation * numbers[kModes + i]);
    return out;
  }

  FaceError error(const Eigen::VectorXd& numbers) const {
    FaceError out;
    out.modes_mm.reshaped() = numbers.head(kModes).cwiseProduct(assumed_.modes_mm.reshaped());
    return out;
  }

  /// Misfits of the first group over their standard deviations.
  Eigen::VectorXd misfits(const Eigen::VectorXd& numbers) const {
    DepositionModel model = deposition(numbers);
    const double noise_um = 1e3 * model.width_noise_mm;
    model.width_noise_mm = 0.0;  // its expectation is added below
    const Eigen::VectorXd modes_mm = error(numbers).modes_mm.reshaped();
    std::vector<double> out;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      const Eigen::VectorXd gaps = (modes_[k] * modes_mm).array() + heights_mm_[k];
      const DepositedLine line =
          deposit(model, lengths_mm_[k], {gaps.data(), static_cast<std::size_t>(gaps.size())}, 1.0, 0);
      const WidthFigures width = measure_widths(line);
      const PrintedLine& paper = first_group()[k];
      out.push_back(std::log(line.resistance_ohm / paper.resistance_ohm) / 0.02);
      out.push_back((1e3 * width.mean_mm - paper.width_um) / 10.0);
      out.push_back((std::hypot(1e3 * width.deviation_mm, noise_um) - paper.deviation_um) / 5.0);
      add_least_widths(k, line, out);
    }
    return Eigen::Map<const Eigen::VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
  }

 private:
  static void add_least_widths(std::size_t k, const DepositedLine& line, std::vector<double>& out) {
    constexpr double kDeviation_um = 30.0, kBeside_mm = 1.0;
    double elsewhere_um = 1e3;
    std::array<double, kStrung.size()> least_um;
    least_um.fill(1e3);
    const double steps = static_cast<double>(line.widths_mm.size() - 1);
    for (std::size_t i = 0; i < line.widths_mm.size(); ++i) {
      const double at_mm = 32.0 * static_cast<double>(i) / steps, width_um = 1e3 * line.widths_mm[i];
      bool beside = false;
      for (std::size_t p = 0; p < kStrung.size(); ++p) {
        const StrungPlace& place = kStrung[p];
        if (place.line != k) continue;
        if (at_mm >= place.from_mm && at_mm <= place.to_mm) least_um[p] = std::min(least_um[p], width_um);
        beside = beside || (at_mm >= place.from_mm - kBeside_mm && at_mm <= place.to_mm + kBeside_mm);
      }
      if (!beside) elsewhere_um = std::min(elsewhere_um, width_um);
    }
    for (std::size_t p = 0; p < kStrung.size(); ++p)
      if (kStrung[p].line == k) out.push_back((least_um[p] - 150.0) / kDeviation_um);
    out.push_back(std::max(0.0, 250.0 - elsewhere_um) / kDeviation_um);
  }

  std::vector<ClLine> lines_;
  std::vector<double> heights_mm_;
  FaceError assumed_;
  std::vector<Eigen::MatrixXd> modes_;  ///< gap by mode, at each point of each line
  std::vector<std::vector<double>> lengths_mm_;
};

TrialFit fit_of(const Problem& problem, const Eigen::VectorXd& numbers) {
  const double misfit = problem.misfits(numbers).squaredNorm();
  return {problem.deposition(numbers), problem.error(numbers), misfit + numbers.squaredNorm(), misfit};
}

}  // namespace

const std::array<PrintedLine, 9>& first_group() {
  static constexpr std::array<PrintedLine, 9> kGroup{{{482.51, 88.98, 0.856},
                                                      {427.82, 108.28, 3.245},
                                                      {407.82, 96.68, 0.824},
                                                      {554.54, 103.34, 0.892},
                                                      {484.33, 50.18, 0.902},
                                                      {437.94, 106.52, 4.519},
                                                      {614.27, 104.17, 0.922},
                                                      {449.11, 88.11, 0.935},
                                                      {517.05, 110.82, 4.946}}};
  return kGroup;
}

const std::array<PrintedLine, 9>& second_group() {
  static constexpr std::array<PrintedLine, 9> kGroup{{{421.17, 80.80, 0.648},
                                                      {406.28, 79.59, 0.632},
                                                      {395.99, 76.34, 0.676},
                                                      {418.84, 70.82, 0.679},
                                                      {416.99, 81.00, 0.685},
                                                      {412.70, 79.59, 0.694},
                                                      {405.06, 69.81, 0.721},
                                                      {396.42, 67.83, 0.699},
                                                      {370.48, 71.30, 0.705}}};
  return kGroup;
}

TrialFit assess_fit(const DepositionModel& deposition, const FaceError& error) {
  const Problem problem;
  return fit_of(problem, problem.numbers(deposition, error));
}

TrialFit draw_start(std::uint64_t seed) {
  constexpr double kShare = 0.5;  // of what is assumed: nearer starts end in better fits
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, kShare);
  Eigen::VectorXd numbers(kNumbers);
  for (double& number : numbers) number = normal(random);
  // Whether the part lies high or low matters most, so it is drawn widely.
  numbers[0] *= 4.0;
  return fit_of(Problem(), numbers);
}

TrialFit fit_first_group(const TrialFit& start, int iterations,
                         const std::function<void(double share)>& progress) {
  constexpr double kStep = 1e-4, kLargestMove = 0.5, kStandsStill = 1e-9;
  const Problem problem;
  Eigen::VectorXd at = problem.numbers(start.deposition, start.error);
  Eigen::VectorXd misfits = problem.misfits(at);
  double objective = misfits.squaredNorm() + at.squaredNorm(), damping = 1.0;
  for (int iteration = 0; iteration < iterations && damping < 1e8; ++iteration) {
    Eigen::MatrixXd slopes(misfits.size(), kNumbers);
    for (int i = 0; i < kNumbers; ++i) {
      if (progress) progress((iteration + static_cast<double>(i) / kNumbers) / iterations);
      Eigen::VectorXd more = at, less = at;
      more[i] += kStep, less[i] -= kStep;
      slopes.col(i) = (problem.misfits(more) - problem.misfits(less)) / (2.0 * kStep);
    }
    Eigen::MatrixXd normal = slopes.transpose() * slopes;
    normal.diagonal().array() += 1.0;  // what is assumed before
    const Eigen::VectorXd down = slopes.transpose() * misfits + at;
    for (bool better = false; !better && damping < 1e8;) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() *= 1.0 + damping;
      Eigen::VectorXd move = -damped.ldlt().solve(down);
      move *= std::min(1.0, kLargestMove / std::max(1e-12, move.cwiseAbs().maxCoeff()));
      const Eigen::VectorXd next = at + move, next_misfits = problem.misfits(next);
      const double next_objective = next_misfits.squaredNorm() + next.squaredNorm();
      better = next_objective < objective;
      damping = better ? std::max(1e-6, damping / 4.0) : damping * 4.0;
      if (!better) continue;
      if (objective - next_objective < kStandsStill * objective) iteration = iterations;
      at = next, misfits = next_misfits, objective = next_objective;
    }
  }
  return fit_of(problem, at);
}

}  // namespace meltstage::motion
