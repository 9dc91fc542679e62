// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/heater.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

namespace meltstage::tb {
namespace {

void require_positive(const PlantConfig& config, const char* field, double value) {
  if (std::isfinite(value) && value > 0.0) return;
  throw std::invalid_argument(
      fmt::format("plant {}: {} is {}, expected a finite number > 0", config.name, field, value));
}

// Integral of exp(-a (t - u)) exp(-b u) over u = 0..t, without cancellation or overflow for any a, b > 0.
double convolve_exponentials(double a, double b, double t) {
  const double slow = std::exp(-std::min(a, b) * t);
  const double gap = std::abs(a - b);
  return gap * t < 1e-12 ? slow * t : slow * -std::expm1(-gap * t) / gap;
}

}  // namespace

const PlantConfig& plant_config(std::string_view name) {
  const auto* found =
      std::find_if(kPlants.begin(), kPlants.end(), [&](const auto& p) { return p.name == name; });
  if (found != kPlants.end()) return *found;
  std::string known;
  for (const auto& p : kPlants) known += fmt::format("{}{}", known.empty() ? "" : ", ", p.name);
  throw std::invalid_argument(fmt::format("plant '{}' is unknown, expected one of: {}", name, known));
}

ThermalNetwork::ThermalNetwork(const PlantConfig& config, double extra_loss_w_per_k)
    : heater_block_w_per_k_(config.heater_block_w_per_k),
      block_ambient_w_per_k_(config.block_ambient_w_per_k + extra_loss_w_per_k),
      sensor_rate_per_s_(1.0 / config.sensor_lag_s) {
  require_positive(config, "heater_j_per_k", config.heater_j_per_k);
  require_positive(config, "heater_block_w_per_k", config.heater_block_w_per_k);
  require_positive(config, "block_j_per_k", config.block_j_per_k);
  require_positive(config, "block_ambient_w_per_k with extra loss", block_ambient_w_per_k_);
  require_positive(config, "sensor_lag_s", config.sensor_lag_s);
  const Eigen::Vector2d root_c{std::sqrt(config.heater_j_per_k), std::sqrt(config.block_j_per_k)};
  const double g = heater_block_w_per_k_;
  Eigen::Matrix2d conductance;
  conductance << g, -g, -g, g + block_ambient_w_per_k_;
  const Eigen::Vector2d inverse_root_c = root_c.cwiseInverse();
  const Eigen::Matrix2d symmetric = inverse_root_c.asDiagonal() * conductance * inverse_root_c.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(symmetric);
  decay_per_s_ = solver.eigenvalues();
  node_of_mode_ = inverse_root_c.asDiagonal() * solver.eigenvectors();
  mode_of_node_ = solver.eigenvectors().transpose() * root_c.asDiagonal();
}

ThermalNetwork::Decay ThermalNetwork::decay_over(double dt_s) const {
  Decay& known = known_decays_[std::bit_cast<std::uint64_t>(dt_s) * 0x9E3779B97F4A7C15U >> 58];
  if (known.dt_s == dt_s) return known;
  known.dt_s = dt_s;
  known.modes = (-decay_per_s_ * dt_s).array().exp();
  known.sensor = std::exp(-sensor_rate_per_s_ * dt_s);
  for (int i = 0; i < 2; ++i)
    known.modes_to_sensor(i) =
        sensor_rate_per_s_ * convolve_exponentials(sensor_rate_per_s_, decay_per_s_(i), dt_s);
  return known;
}

PlantState ThermalNetwork::advance(const PlantState& state, const PlantDrive& drive, double dt_s) const {
  const double block_end = drive.ambient_degc + drive.power_w / block_ambient_w_per_k_;
  const Eigen::Vector2d end{block_end + drive.power_w / heater_block_w_per_k_, block_end};
  const Eigen::Vector2d modes = mode_of_node_ * (Eigen::Vector2d{state.heater_degc, state.block_degc} - end);
  const Decay decay = decay_over(dt_s);
  const Eigen::Vector2d nodes = end + node_of_mode_ * decay.modes.cwiseProduct(modes);

  const double k = drive.sensor_coupling;
  const double sensor_end = drive.ambient_degc + k * (block_end - drive.ambient_degc);
  double sensor = sensor_end + (state.sensor_degc - sensor_end) * decay.sensor;
  for (int i = 0; i < 2; ++i) sensor += k * node_of_mode_(1, i) * modes(i) * decay.modes_to_sensor(i);
  return {nodes(0), nodes(1), sensor};
}

HeaterPlant::HeaterPlant(const PlantConfig& config, double clock_hz)
    : config_(config),
      clock_hz_(clock_hz),
      delay_cycles_(0),
      network_(config, 0.0),
      drive_{0.0, config.ambient_degc, 1.0},
      state_{config.ambient_degc, config.ambient_degc, config.ambient_degc},
      delayed_network_(network_),
      delayed_drive_(drive_),
      delayed_state_(state_) {
  require_positive(config, "power_w", config.power_w);
  require_positive(config, "clock_hz of the bench", clock_hz);
  constexpr double kLongestDelay_s = 3600.0;  // beyond it the cycles would be too many to count
  if (!(config.transport_delay_s >= 0.0 && config.transport_delay_s <= kLongestDelay_s))
    throw std::invalid_argument(fmt::format("plant {}: transport_delay_s is {}, expected 0..{}", config.name,
                                            config.transport_delay_s, kLongestDelay_s));
  delay_cycles_ = static_cast<std::uint64_t>(std::llround(config.transport_delay_s * clock_hz));
}

double HeaterPlant::seconds(std::uint64_t from, std::uint64_t to) const {
  if (to < from) {
    throw std::logic_error(fmt::format("heater plant: cycle {} is before the last event at {}", to, from));
  }
  return static_cast<double>(to - from) / clock_hz_;
}

PlantState HeaterPlant::now(std::uint64_t cycle) const {
  return network_.advance(state_, drive_, seconds(cycle_, cycle));
}

double HeaterPlant::sensor_degc(std::uint64_t cycle) {
  receive_until(cycle);
  return delayed_network_.advance(delayed_state_, delayed_drive_, seconds(delayed_cycle_, cycle)).sensor_degc;
}

double HeaterPlant::power_w() const {
  return switch_conducting() && !faults_.element_open ? config_.power_w * supply_ratio_ * supply_ratio_ : 0.0;
}

void HeaterPlant::switch_heater(std::uint64_t cycle, bool on) {
  commit(cycle);
  gate_on_ = on;
  apply_change(cycle, 0.0);
}

void HeaterPlant::set_supply_ratio(std::uint64_t cycle, double ratio) {
  commit(cycle);
  supply_ratio_ = ratio;
  apply_change(cycle, 0.0);
}

void HeaterPlant::set_ambient_degc(std::uint64_t cycle, double ambient_degc) {
  commit(cycle);
  drive_.ambient_degc = ambient_degc;
  apply_change(cycle, 0.0);
}

void HeaterPlant::set_extra_loss_w_per_k(std::uint64_t cycle, double extra_loss_w_per_k) {
  commit(cycle);
  network_ = ThermalNetwork(config_, extra_loss_w_per_k);
  extra_loss_w_per_k_ = extra_loss_w_per_k;
  apply_change(cycle, 0.0);
}

void HeaterPlant::set_faults(std::uint64_t cycle, const HeaterFaults& faults) {
  commit(cycle);
  faults_ = faults;
  apply_change(cycle, 0.0);
}

void HeaterPlant::set_sensor_coupling(std::uint64_t cycle, double coupling) {
  receive_until(cycle);
  delayed_state_ = delayed_network_.advance(delayed_state_, delayed_drive_, seconds(delayed_cycle_, cycle));
  delayed_cycle_ = cycle;
  delayed_drive_.sensor_coupling = coupling;
}

void HeaterPlant::droplet(std::uint64_t cycle, double energy_j) {
  commit(cycle);
  const double block_step_k = -energy_j / config_.block_j_per_k;
  state_.block_degc += block_step_k;
  apply_change(cycle, block_step_k);
}

void HeaterPlant::commit(std::uint64_t cycle) {
  state_ = now(cycle);
  cycle_ = cycle;
}

void HeaterPlant::apply_change(std::uint64_t cycle, double block_step_k) {
  drive_.power_w = power_w();
  arrivals_.push_back({cycle + delay_cycles_, drive_, extra_loss_w_per_k_, block_step_k});
  receive_until(cycle);  // keeps the queue as short as the delay even when nobody reads the sensor
}

void HeaterPlant::receive_until(std::uint64_t cycle) {
  while (!arrivals_.empty() && arrivals_.front().cycle <= cycle) {
    const Arrival arrival = arrivals_.front();
    arrivals_.pop_front();
    delayed_state_ =
        delayed_network_.advance(delayed_state_, delayed_drive_, seconds(delayed_cycle_, arrival.cycle));
    delayed_cycle_ = arrival.cycle;
    delayed_state_.block_degc += arrival.block_step_k;
    const double coupling = delayed_drive_.sensor_coupling;
    delayed_drive_ = arrival.drive;
    delayed_drive_.sensor_coupling = coupling;
    if (arrival.extra_loss_w_per_k != delayed_extra_loss_w_per_k_) {
      delayed_network_ = ThermalNetwork(config_, arrival.extra_loss_w_per_k);
      delayed_extra_loss_w_per_k_ = arrival.extra_loss_w_per_k;
    }
  }
}

}  // namespace meltstage::tb
