// SPDX-License-Identifier: Apache-2.0
#include "motion/align/prp_calibration.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "motion/align/prp_parts.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using prp_parts::Parameters;

constexpr int kStage = prp_parts::kParameters;
constexpr int kPlate = 3;
constexpr int kAll = kStage + kPlate;
constexpr std::size_t kFewestViews = 7;  // 3 equations each for 18 unknowns, and something to judge by
constexpr double kNotTold = 0.999;       // correlation above which two parameters can't be told apart
constexpr double kMisfit = 1.3;          // residuals above this many times the noise want an explanation
using All = Eigen::Matrix<double, kAll, 1>;
using Information = Eigen::Matrix<double, kAll, kAll>;
using Rows = Eigen::Matrix<double, 3, kAll>;

All prior_sigmas(const PrpGeometry& nominal, const PrpPriors& priors) {
  All sigma;
  for (int i = 0; i < 3; ++i) {
    sigma[prp_parts::kLead + i] = priors.lead_share * nominal.lead_mm[static_cast<std::size_t>(i)];
    sigma[prp_parts::kOffset + i] = priors.offset_mm;
    sigma[prp_parts::kD + i] = priors.d_mm;
    sigma[prp_parts::kBeta + i] = priors.angle_rad;
  }
  sigma[prp_parts::kLink] = priors.link_mm;
  sigma[prp_parts::kAlpha1] = sigma[prp_parts::kAlpha2] = priors.angle_rad;
  sigma.tail<kPlate>() << priors.plate_mm, priors.plate_mm, priors.plate_rad;
  return sigma;
}

/// Travel that the model asks of each slider for a pose of the plate, less what was commanded; T is double or
/// a Jet. The platform's pose is the plate's without the plate's place on it.
template <typename T>
void travel_excess(const T* values, const PlanarPose& seen, const PrpTurns& turns, T* excess_mm) {
  using std::cos;
  using std::sin;
  const T* plate = values + kStage;
  const T angle = T(seen.angle_rad) - plate[2];
  const T c = cos(angle), s = sin(angle);
  const T x = seen.x_mm - (c * plate[0] - s * plate[1]), y = seen.y_mm - (s * plate[0] + c * plate[1]);
  const auto travels = prp_parts::travels_mm(values, x, y, angle);
  for (int i = 0; i < 3; ++i)
    excess_mm[i] = travels[static_cast<std::size_t>(i)] - values[prp_parts::kLead + i] * turns[i];
}

/// A view, reduced to the plate's pose.
struct SeenPose {
  PrpTurns turns;
  PlanarPose plate;
  Matrix3d whiten = Matrix3d::Identity();  // travel residuals in mm to residuals of variance 1
};

/// Residuals of one view; the parameters are counted in their prior's sigma from nominal.
struct ViewResidual {
  const SeenPose& view;
  const All& nominal;
  const All& sigma;

  template <typename T>
  bool operator()(const T* scaled, T* residual) const {
    std::array<T, kAll> values;
    for (std::size_t i = 0; i < kAll; ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      values[i] = nominal[at] + sigma[at] * scaled[i];
    }
    std::array<T, 3> excess;
    travel_excess(values.data(), view.plate, view.turns, excess.data());
    for (int i = 0; i < 3; ++i) {
      residual[i] = T(0.0);
      for (int j = 0; j < 3; ++j) residual[i] += view.whiten(i, j) * excess[static_cast<std::size_t>(j)];
    }
    return true;
  }
};

/// What is known beforehand: every scaled parameter is 0 +- 1.
struct PriorResidual {
  template <typename T>
  bool operator()(const T* scaled, T* residual) const {
    std::copy_n(scaled, kAll, residual);
    return true;
  }
};

Matrix3d whitening(const PrpGeometry& nominal, const PrpTurns& turns, const std::vector<Vector2d>& seen_mm,
                   const PrpCalibrationOptions& options) {
  Matrix3d information = Matrix3d::Zero();
  for (const auto& mark : seen_mm) {
    Eigen::Matrix<double, 2, 3> by_pose;
    by_pose << 1.0, 0.0, -mark.y(), 0.0, 1.0, mark.x();
    information += by_pose.transpose() * by_pose;
  }
  const Matrix3d pose = information.inverse() * options.mark_sigma_mm * options.mark_sigma_mm;
  Matrix3d travel_by_pose = prp_jacobian(nominal, turns).inverse();
  for (int i = 0; i < 3; ++i) travel_by_pose.row(i) *= nominal.lead_mm[static_cast<std::size_t>(i)];
  const Matrix3d covariance = travel_by_pose * pose * travel_by_pose.transpose() +
                              Matrix3d::Identity() * options.actuator_sigma_mm * options.actuator_sigma_mm;
  return Eigen::LLT<Matrix3d>(covariance).matrixL().solve(Matrix3d::Identity());
}

void check_options(const PrpCalibrationOptions& options) {
  if (!(options.actuator_sigma_mm > 0.0) || !(options.mark_sigma_mm > 0.0))
    throw MotionError(
        fmt::format("stage calibration: found sigma {} mm of the sliders and {} mm of the marks, "
                    "expected both above 0",
                    options.actuator_sigma_mm, options.mark_sigma_mm));
}

std::vector<SeenPose> seen_poses(const std::vector<Vector2d>& plate_mm, const std::vector<PlateView>& views,
                                 const PrpGeometry& nominal, const PrpCalibrationOptions& options) {
  if (views.size() < kFewestViews)
    throw MotionError(
        fmt::format("stage calibration: found {} poses, expected at least {}", views.size(), kFewestViews));
  std::vector<SeenPose> poses;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const PlateView& view = views[k];
    std::vector<Vector2d> known;
    for (const std::size_t mark : view.marks) {
      if (mark >= plate_mm.size())
        throw MotionError(fmt::format("stage calibration, pose {}: found mark {}, expected 0 to {}", k + 1,
                                      mark, plate_mm.size() - 1));
      known.push_back(plate_mm[mark]);
    }
    if (!view.turns.allFinite())
      throw MotionError(
          fmt::format("stage calibration, pose {}: found turns {}, {}, {}, expected finite numbers", k + 1,
                      view.turns[0], view.turns[1], view.turns[2]));
    try {
      poses.push_back({view.turns, fit_pose(known, view.seen_mm).pose,
                       whitening(nominal, view.turns, view.seen_mm, options)});
    } catch (const MotionError& error) {
      throw MotionError(fmt::format("stage calibration, pose {}: {}", k + 1, error.what()));
    }
  }
  return poses;
}

/// The plate's place on the platform if the stage were nominal: from the view nearest to home.
PlanarPose first_plate_place(const std::vector<SeenPose>& poses, const PrpGeometry& nominal) {
  const auto nearest = std::min_element(poses.begin(), poses.end(), [](const SeenPose& a, const SeenPose& b) {
    return a.turns.squaredNorm() < b.turns.squaredNorm();
  });
  return compose(inverse_of(prp_forward(nominal, nearest->turns)), nearest->plate);
}

std::vector<IdentifiedParameter> named_parameters(const All& nominal, const All& value,
                                                  const Information& covariance, const All& prior) {
  constexpr std::array<const char*, kAll> kNames{
      "R_1",    "R_2",    "R_3",    "q_1",  "q_2",     "q_3",     "d_1",     "d_2",     "d_3",
      "beta_1", "beta_2", "beta_3", "l_32", "alpha_1", "alpha_2", "plate x", "plate y", "plate angle"};
  std::vector<IdentifiedParameter> parameters;
  for (int i = 0; i < kAll; ++i) {
    const bool angle = (i >= prp_parts::kBeta && i != prp_parts::kLink && i < kStage) || i == kAll - 1;
    parameters.push_back({kNames[static_cast<std::size_t>(i)],
                          i < prp_parts::kOffset ? "mm/turn" : (angle ? "rad" : "mm"), nominal[i], value[i],
                          std::sqrt(covariance(i, i)), prior[i]});
  }
  return parameters;
}

/// Standard uncertainty of the worst slider over the 27 corners and middles of the workspace, for
/// displacements from home: what the calibration is for.
double prediction_sigma_mm(const PrpGeometry& geometry, const Information& covariance) {
  const Parameters at = prp_parts::to_vector(geometry);
  const PlanarPose home = prp_forward(geometry, PrpTurns::Zero());
  double worst = 0.0;
  for (int corner = 0; corner < 27; ++corner) {
    PrpTurns turns(corner % 3 - 1, corner / 3 % 3 - 1, corner / 9 - 1);
    for (int i = 0; i < 3; ++i)
      turns[i] *= geometry.stroke_mm / geometry.lead_mm[static_cast<std::size_t>(i)];
    const PlanarPose by = displacement(home, prp_forward(geometry, turns));
    Eigen::Matrix<double, 3, kStage> by_parameter;
    for (int i = 0; i < kStage; ++i) {
      // Far less than any prior, far more than rounding.
      const double step = 1e-4 * std::max(1e-2, std::abs(at[i]));
      std::array<PrpTurns, 2> turned;
      for (std::size_t side = 0; side < 2; ++side) {
        Parameters moved_to = at;
        moved_to[i] += side == 0 ? -step : step;
        const PrpGeometry other = prp_parts::to_geometry(moved_to, geometry);
        turned[side] = prp_inverse(other, compose(by, prp_forward(other, PrpTurns::Zero())));
      }
      by_parameter.col(i) = (turned[1] - turned[0]) / (2.0 * step);
    }
    const Matrix3d spread =
        by_parameter * covariance.topLeftCorner<kStage, kStage>() * by_parameter.transpose();
    for (int i = 0; i < 3; ++i)
      worst = std::max(worst, geometry.lead_mm[static_cast<std::size_t>(i)] * std::sqrt(spread(i, i)));
  }
  return worst;
}

void add_warnings(PrpCalibration& result, const PrpCalibrationOptions& options) {
  for (std::size_t i = 0; i < result.parameters.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double r = result.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (std::abs(r) < kNotTold) continue;
      const auto &a = result.parameters[j], &b = result.parameters[i];
      result.warnings.push_back(
          fmt::format("these data can't tell {} and {} apart (correlation {:.5f}); alone each is known to "
                      "{:.3g} {} and {:.3g} {} only",
                      a.name, b.name, r, a.sigma, a.unit, b.sigma, b.unit));
    }
  for (const auto& parameter : result.parameters)
    if (parameter.sigma > 0.9 * parameter.prior_sigma)
      result.warnings.push_back(
          fmt::format("these data say nothing about {}: it is still known to {:.3g} {} only", parameter.name,
                      parameter.sigma, parameter.unit));
  if (result.prediction_sigma_mm > options.actuator_sigma_mm)
    result.warnings.push_back(fmt::format(
        "the poses leave {:.1f} um (sigma) open at the corners of the workspace, expected less than "
        "the sliders' scatter of {:.1f} um; take more poses, or those of choose_poses",
        result.prediction_sigma_mm * 1e3, options.actuator_sigma_mm * 1e3));
  if (result.misfit > kMisfit)
    result.warnings.push_back(
        fmt::format("residuals are {:.1f} times the noise given: the stage does what the "
                    "model doesn't know, or the noise is larger than told",
                    result.misfit));
}

/// Largest over smallest eigenvalue of the information of the data, over the directions in which they say
/// more than the priors.
double condition_of(const Information& data) {
  const Eigen::SelfAdjointEigenSolver<Information> solver(data);
  double smallest = INFINITY;
  for (int i = 0; i < kAll; ++i)
    if (solver.eigenvalues()[i] > 1.0) smallest = std::min(smallest, solver.eigenvalues()[i]);
  return std::sqrt(solver.eigenvalues()[kAll - 1] / smallest);
}

}  // namespace

PrpCalibration calibrate_prp(const std::vector<Vector2d>& plate_mm, const std::vector<PlateView>& views,
                             const PrpGeometry& nominal, const PrpCalibrationOptions& options) {
  check_options(options);
  const std::vector<SeenPose> poses = seen_poses(plate_mm, views, nominal, options);
  const PlanarPose plate = first_plate_place(poses, nominal);
  All start;
  start << prp_parts::to_vector(nominal), plate.x_mm, plate.y_mm, plate.angle_rad;
  const All sigma = prior_sigmas(nominal, options.priors);

  ceres::Problem problem;
  All scaled = All::Zero();
  for (const SeenPose& pose : poses)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<ViewResidual, 3, kAll>(new ViewResidual{pose, start, sigma}), nullptr,
        scaled.data());
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PriorResidual, kAll, kAll>(new PriorResidual),
                           nullptr, scaled.data());
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.logging_type = ceres::SILENT;
  // The priors keep every direction finite, so that whole Gauss-Newton steps are safe from the start.
  solver.initial_trust_region_radius = 1e12;
  solver.function_tolerance = 1e-8;
  solver.max_num_iterations = 50;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);

  // Information at the solution: the rows of all views, and 1 for each prior.
  Information data = Information::Zero();
  double squares = 0.0;
  PrpCalibration result;
  const All value = start + sigma.cwiseProduct(scaled);
  for (const SeenPose& pose : poses) {
    const ceres::AutoDiffCostFunction<ViewResidual, 3, kAll> cost(new ViewResidual{pose, start, sigma});
    const double* parameters[] = {scaled.data()};
    Vector3d residual;
    Eigen::Matrix<double, 3, kAll, Eigen::RowMajor> rows;
    double* jacobians[] = {rows.data()};
    cost.Evaluate(parameters, residual.data(), jacobians);
    data += rows.transpose() * rows;
    squares += residual.squaredNorm();
    Vector3d excess;
    travel_excess(value.data(), pose.plate, pose.turns, excess.data());
    result.residuals_mm.push_back(excess);
  }
  const Information scaled_covariance =
      (data + Information::Identity()).ldlt().solve(Information::Identity());
  const Information covariance = sigma.asDiagonal() * scaled_covariance * sigma.asDiagonal();
  const All deviation = scaled_covariance.diagonal().cwiseSqrt();

  result.geometry = prp_parts::to_geometry(value.head<kStage>(), nominal);
  result.plate = {value[kStage], value[kStage + 1], value[kStage + 2]};
  result.parameters = named_parameters(start, value, covariance, sigma);
  result.correlation =
      deviation.cwiseInverse().asDiagonal() * scaled_covariance * deviation.cwiseInverse().asDiagonal();
  // Of the 18, what the data determine takes freedom from the residuals, what the priors determine doesn't.
  const double determined = static_cast<double>(kAll) - scaled_covariance.trace();
  const double freedom = 3.0 * static_cast<double>(poses.size()) - determined;
  result.misfit = std::sqrt(squares / std::max(1.0, freedom));
  result.condition = condition_of(data);
  result.prediction_sigma_mm = prediction_sigma_mm(result.geometry, covariance);
  result.iterations = static_cast<int>(summary.iterations.size());
  std::vector<Vector3d> travels;
  for (const SeenPose& pose : poses) {
    Vector3d travel;
    for (int i = 0; i < 3; ++i) travel[i] = value[prp_parts::kLead + i] * pose.turns[i];
    travels.push_back(travel);
  }
  result.table = ResidualTable(travels, result.residuals_mm, options.actuator_sigma_mm, nominal.stroke_mm);
  add_warnings(result, options);
  return result;
}

std::vector<PrpTurns> choose_poses(std::size_t count, const PrpGeometry& nominal,
                                   const PrpCalibrationOptions& options) {
  check_options(options);
  if (count < kFewestViews)
    throw MotionError(fmt::format("choice of poses: found {}, expected at least {}", count, kFewestViews));
  All start;
  start << prp_parts::to_vector(nominal), 0.0, 0.0, 0.0;
  const All sigma = prior_sigmas(nominal, options.priors);
  // Marks over the whole platform, as a plate has them.
  const double far_mm = nominal.d_mm[2];
  const std::vector<Vector2d> marks{{0.0, 0.0}, {far_mm, 0.0}, {0.0, far_mm}, {far_mm, far_mm}};

  std::vector<PrpTurns> candidates;
  std::vector<Rows> rows;
  for (int cell = 0; cell < 125; ++cell) {
    PrpTurns turns(cell % 5 - 2, cell / 5 % 5 - 2, cell / 25 - 2);
    for (int i = 0; i < 3; ++i)
      turns[i] *= 0.5 * nominal.stroke_mm / nominal.lead_mm[static_cast<std::size_t>(i)];
    const SeenPose pose{turns, prp_forward(nominal, turns), whitening(nominal, turns, marks, options)};
    const ceres::AutoDiffCostFunction<ViewResidual, 3, kAll> cost(new ViewResidual{pose, start, sigma});
    const All at = All::Zero();
    const double* parameters[] = {at.data()};
    Vector3d residual;
    Eigen::Matrix<double, 3, kAll, Eigen::RowMajor> by_parameter;
    double* jacobians[] = {by_parameter.data()};
    cost.Evaluate(parameters, residual.data(), jacobians);
    candidates.push_back(turns);
    rows.push_back(by_parameter);
  }
  // det(M + r' r) = det(M) det(1 + r M^-1 r').
  const auto best_beside = [&](const Information& information) {
    const Information inverse = information.ldlt().solve(Information::Identity());
    std::size_t best = 0;
    double most = -INFINITY;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double gain = (Matrix3d::Identity() + rows[i] * inverse * rows[i].transpose()).determinant();
      if (gain > most) {
        most = gain;
        best = i;
      }
    }
    return best;
  };
  Information information = Information::Identity();
  std::vector<std::size_t> chosen;
  while (chosen.size() < count) {
    chosen.push_back(best_beside(information));
    information += rows[chosen.back()].transpose() * rows[chosen.back()];
  }
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round)
    for (auto& each : chosen) {
      information -= rows[each].transpose() * rows[each];
      each = best_beside(information);
      information += rows[each].transpose() * rows[each];
    }
  std::vector<PrpTurns> turns;
  for (const std::size_t each : chosen) turns.push_back(candidates[each]);
  return turns;
}

ResidualTable::ResidualTable(const std::vector<Vector3d>& travels_mm,
                             const std::vector<Vector3d>& residuals_mm, double sigma_mm, double stroke_mm)
    : stroke_mm_(stroke_mm) {
  const auto count = static_cast<Eigen::Index>(travels_mm.size());
  Eigen::MatrixXd squared(count, count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < count; ++j)
      squared(i, j) =
          (travels_mm[static_cast<std::size_t>(i)] - travels_mm[static_cast<std::size_t>(j)]).squaredNorm() /
          (stroke_mm * stroke_mm);
  Eigen::MatrixXd residuals(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) residuals.row(i) = residuals_mm[static_cast<std::size_t>(i)];
  // Minus twice the log likelihood, up to a constant; a table must earn its two parameters (Akaike).
  const double noise = sigma_mm * sigma_mm;
  Eigen::Array3d best = (residuals.colwise().squaredNorm().transpose().array() / noise +
                         static_cast<double>(count) * std::log(noise)) -
                        4.0;
  for (const double length : {0.4, 0.7, 1.2, 2.0}) {
    const Eigen::MatrixXd kernel = (-0.5 / (length * length) * squared).array().exp();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(kernel);
    const Eigen::MatrixXd in_modes = modes.eigenvectors().transpose() * residuals;
    for (const double times : {0.25, 1.0, 4.0, 16.0, 64.0, 256.0, 1024.0}) {
      const Eigen::ArrayXd variance = noise * (1.0 + times * modes.eigenvalues().array().max(0.0));
      const double log_determinant = variance.log().sum();
      for (Eigen::Index branch = 0; branch < 3; ++branch) {
        const double unlikely = (in_modes.col(branch).array().square() / variance).sum() + log_determinant;
        if (unlikely >= best[branch]) continue;
        best[branch] = unlikely;
        const auto b = static_cast<std::size_t>(branch);
        fit_[b] = {length, times * noise};
        weights_[b] = modes.eigenvectors() * (in_modes.col(branch).array() / variance).matrix();
      }
    }
  }
  const bool any =
      std::any_of(fit_.begin(), fit_.end(), [](const Fit& fit) { return fit.variance_mm2 > 0.0; });
  if (!any) return;
  for (const auto& travel : travels_mm) nodes_.push_back(travel / stroke_mm);
}

Vector3d ResidualTable::at(const Vector3d& travel_mm) const {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const double squared = (travel_mm / stroke_mm_ - nodes_[k]).squaredNorm();
    for (std::size_t b = 0; b < 3; ++b)
      if (fit_[b].variance_mm2 > 0.0)
        sum[static_cast<Eigen::Index>(b)] += weights_[b][static_cast<Eigen::Index>(k)] *
                                             fit_[b].variance_mm2 *
                                             std::exp(-0.5 * squared / (fit_[b].length * fit_[b].length));
  }
  return sum;
}

PrpTurns displaced_turns(const PrpCalibration& calibration, const PrpTurns& now, const PlanarPose& by) {
  const auto& lead = calibration.geometry.lead_mm;
  const Vector3d leads(lead[0], lead[1], lead[2]);
  const auto beyond = [&](const PrpTurns& turns) -> PrpTurns {
    return calibration.table.at(turns.cwiseProduct(leads)).cwiseQuotient(leads);
  };
  const PlanarPose here = prp_forward(calibration.geometry, now + beyond(now));
  const PrpTurns wanted = prp_inverse(calibration.geometry, compose(by, here));
  // The table is flat against the stroke: each round leaves its slope's share of the error.
  PrpTurns turns = wanted;
  for (int round = 0; round < 4; ++round) turns = wanted - beyond(turns);
  check_stroke(calibration.geometry, turns);
  return turns;
}

}  // namespace meltstage::motion
