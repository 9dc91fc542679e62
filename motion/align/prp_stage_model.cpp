// SPDX-License-Identifier: Apache-2.0
#include "motion/align/prp_stage_model.hpp"

#include <cmath>
#include <numbers>

namespace meltstage::motion {
namespace {

constexpr double kBeyond_turns = 0.1;  // that an approach from below starts at

}  // namespace

PrpStageConfig random_stage(const PrpGeometry& nominal, const PrpTolerances& tolerances, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto within = [&](double tolerance) {
    return std::uniform_real_distribution<double>(-tolerance, tolerance)(random);
  };
  PrpGeometry built = nominal;
  for (std::size_t i = 0; i < 3; ++i) {
    built.lead_mm[i] *= 1.0 + within(tolerances.lead_share);
    built.offset_mm[i] += within(tolerances.offset_mm);
    built.d_mm[i] += within(tolerances.d_mm);
    built.beta_rad[i] += within(tolerances.angle_rad);
  }
  built.link_mm += within(tolerances.link_mm);
  built.alpha1_rad += within(tolerances.angle_rad);
  built.alpha2_rad += within(tolerances.angle_rad);
  const double x_mm = within(tolerances.frame_origin_mm), y_mm = within(tolerances.frame_origin_mm);
  PrpStageConfig config;
  config.geometry = seen_from(built, {x_mm, y_mm}, within(tolerances.frame_angle_rad));
  config.seed = random();
  return config;
}

PrpStageModel::PrpStageModel(const PrpStageConfig& config) : config_(config), random_(config.seed) {
  move_to(PrpTurns::Zero());
}

double PrpStageModel::noise(double sigma) { return sigma > 0.0 ? sigma * normal_(random_) : 0.0; }

void PrpStageModel::move_to(const PrpTurns& turns) { place(turns, config_.actuator_sigma_mm); }

void PrpStageModel::stand_at(const PrpTurns& turns) {
  commanded_ = turns - PrpTurns::Constant(kBeyond_turns);
  place(turns, 0.0);
}

void PrpStageModel::place(const PrpTurns& turns, double scatter_mm) {
  PrpTurns reached;
  for (int i = 0; i < 3; ++i) {
    const auto branch = static_cast<std::size_t>(i);
    // The slider stays behind by half the dead band on the side it came from.
    if (turns[i] != commanded_[i])
      lost_mm_[branch] = (turns[i] > commanded_[i] ? -0.5 : 0.5) * config_.backlash_mm;
    const double travel_mm = config_.geometry.lead_mm[branch] * turns[i];
    const double wave_mm =
        config_.screw_wave_mm * std::sin(2.0 * std::numbers::pi * travel_mm / config_.screw_wavelength_mm +
                                         static_cast<double>(branch));
    reached[i] =
        (travel_mm + lost_mm_[branch] + wave_mm + noise(scatter_mm)) / config_.geometry.lead_mm[branch];
  }
  commanded_ = turns;
  pose_ = prp_forward(config_.geometry, reached);
  const double share = reached[1] * config_.geometry.lead_mm[1] / config_.geometry.stroke_mm;
  pose_.x_mm += config_.guide_bow_mm * share * share;
}

void PrpStageModel::approach_from_below(const PrpTurns& turns) {
  move_to(turns - PrpTurns::Constant(kBeyond_turns));
  move_to(turns);
}

Eigen::Vector2d PrpStageModel::see(const Eigen::Vector2d& on_platform_mm) {
  const double dx = noise(config_.mark_sigma_mm), dy = noise(config_.mark_sigma_mm);
  return moved(pose_, on_platform_mm) + Eigen::Vector2d(dx, dy);
}

PrpMachine PrpStageModel::with_plate(std::vector<Eigen::Vector2d> on_platform_mm) {
  return {[this](const PrpTurns& turns) { approach_from_below(turns); },
          [this, marks = std::move(on_platform_mm)](std::size_t mark) { return see(marks.at(mark)); }};
}

}  // namespace meltstage::motion
