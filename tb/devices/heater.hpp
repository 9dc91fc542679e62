// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <deque>
#include <string_view>

namespace meltstage::tb {

/// Heater, block and sensor of a print head as a thermal network:
///   Ch dTh/dt = P - Ghb (Th - Tb);  Cb dTb/dt = Ghb (Th - Tb) - Gba (Tb - Ta);
///   ts dTs/dt = Tb(t - delay) - Ts.
struct PlantConfig {
  std::string_view name;
  double power_w;                ///< at nominal supply voltage
  double heater_j_per_k;         ///< Ch
  double heater_block_w_per_k;   ///< Ghb
  double block_j_per_k;          ///< Cb
  double block_ambient_w_per_k;  ///< Gba
  double sensor_lag_s;           ///< ts
  double transport_delay_s;
  double ambient_degc = 25.0;
};

/// Known plants: PH-1 nominal print head, PH-A slow, PH-B small, PH-C heavy, E3D-like fast hot-end (danger
/// case).
inline constexpr std::array<PlantConfig, 5> kPlants{{
    {"PH-1", 60.0, 8.0, 1.0, 80.0, 0.27, 4.0, 2.0},
    {"PH-A", 40.0, 12.0, 1.0, 60.0, 0.13, 4.0, 2.0},
    {"PH-B", 30.0, 6.0, 1.0, 24.0, 0.10, 3.0, 1.0},
    {"PH-C", 120.0, 40.0, 2.5, 260.0, 0.45, 6.0, 3.0},
    {"E3D-like", 30.0, 2.5, 1.0, 9.8, 0.085, 2.5, 1.0},
}};

/// The plant of that name; throws std::invalid_argument naming the known ones.
const PlantConfig& plant_config(std::string_view name);

/// Temperatures of the three nodes.
struct PlantState {
  double heater_degc;
  double block_degc;
  double sensor_degc;
};

/// What drives the network, constant over an interval.
struct PlantDrive {
  double power_w;
  double ambient_degc;
  double sensor_coupling;  ///< 1 seated, 0 fallen out: the sensor sees ambient + coupling (block - ambient)
};

/// Exact solution of the network (without the delay) over an interval of constant drive, of any length.
/// The two-node part is symmetric in sqrt(C) T, so its eigenvalues are real and the solution is two decaying
/// exponentials; the sensor's lag is their convolution in closed form.
class ThermalNetwork {
 public:
  /// `extra_loss_w_per_k` adds to Gba. Throws std::invalid_argument when a capacity, conductance or lag is
  /// not > 0.
  ThermalNetwork(const PlantConfig& config, double extra_loss_w_per_k);

  /// State `dt_s` >= 0 later.
  PlantState advance(const PlantState& state, const PlantDrive& drive, double dt_s) const;

  /// Both time constants of heater and block, slow one first.
  Eigen::Vector2d time_constants_s() const { return decay_per_s_.cwiseInverse(); }

 private:
  // What is left of each mode, and of the sensor's lag, after a time; and what a mode has added to the sensor
  // by then.
  struct Decay {
    double dt_s = 0.0;
    Eigen::Vector2d modes{1.0, 1.0};
    double sensor = 1.0;
    Eigen::Vector2d modes_to_sensor{0.0, 0.0};
  };
  Decay decay_over(double dt_s) const;

  double heater_block_w_per_k_;
  double block_ambient_w_per_k_;
  double sensor_rate_per_s_;
  Eigen::Vector2d decay_per_s_;   // eigenvalues, ascending
  Eigen::Matrix2d node_of_mode_;  // C^-1/2 Q
  Eigen::Matrix2d mode_of_node_;  // Q^T C^1/2
  // A heater that is pulsed meets the same few times again and again.
  mutable std::array<Decay, 64> known_decays_{};
};

/// What can be broken in the heater's circuit.
struct HeaterFaults {
  bool element_open = false;
  bool switch_shorted = false;
};

/// The heated head. Time is the chip's cycle count. State moves only at events (heater edge, droplet, change
/// of a property); a reading never changes a later one, so stepping each clock and skipping idle time give
/// the same bits. Events must come in order of cycle; a reading earlier than the last event throws
/// std::logic_error.
class HeaterPlant {
 public:
  /// Starts at ambient with the heater off. Throws std::invalid_argument on a bad plant or clock.
  HeaterPlant(const PlantConfig& config, double clock_hz);

  /// Level of the heater gate from `cycle` on.
  void set_heater(std::uint64_t cycle, bool on) {
    if (on != gate_on_) switch_heater(cycle, on);
  }
  /// Supply voltage over nominal (power goes with its square); 0 = the safety relay is open.
  void set_supply_ratio(std::uint64_t cycle, double ratio);
  void set_ambient_degc(std::uint64_t cycle, double ambient_degc);
  /// Loss from block to ambient on top of Gba (fan, ink flow).
  void set_extra_loss_w_per_k(std::uint64_t cycle, double extra_loss_w_per_k);
  void set_faults(std::uint64_t cycle, const HeaterFaults& faults);
  /// 1 seated, 0 fallen out; acts on the sensor at once, without the transport delay.
  void set_sensor_coupling(std::uint64_t cycle, double coupling);
  /// A droplet takes `energy_j` out of the block at this instant.
  void droplet(std::uint64_t cycle, double energy_j);

  double ambient_degc() const { return drive_.ambient_degc; }
  double heater_degc(std::uint64_t cycle) const { return now(cycle).heater_degc; }
  double block_degc(std::uint64_t cycle) const { return now(cycle).block_degc; }
  /// What the sensor's junction has, noise and quantisation excluded.
  double sensor_degc(std::uint64_t cycle);

  /// Switch closed (commanded or shorted): what a feedback pin at the switch sees.
  bool switch_conducting() const { return gate_on_ || faults_.switch_shorted; }
  /// Power into the element now.
  double power_w() const;

 private:
  // A change of what the block gets, on its way to the sensor.
  struct Arrival {
    std::uint64_t cycle;
    PlantDrive drive;
    double extra_loss_w_per_k;
    double block_step_k;
  };

  PlantState now(std::uint64_t cycle) const;
  double seconds(std::uint64_t from, std::uint64_t to) const;
  void switch_heater(std::uint64_t cycle, bool on);
  void commit(std::uint64_t cycle);
  void apply_change(std::uint64_t cycle, double block_step_k);
  void receive_until(std::uint64_t cycle);

  PlantConfig config_;
  double clock_hz_;
  std::uint64_t delay_cycles_;
  bool gate_on_ = false;
  double supply_ratio_ = 1.0;
  double extra_loss_w_per_k_ = 0.0;
  HeaterFaults faults_;

  ThermalNetwork network_;  // the block as it is
  PlantDrive drive_;
  PlantState state_;
  std::uint64_t cycle_ = 0;

  ThermalNetwork delayed_network_;  // the block as the sensor sees it, one transport delay behind
  PlantDrive delayed_drive_;
  PlantState delayed_state_;
  std::uint64_t delayed_cycle_ = 0;
  double delayed_extra_loss_w_per_k_ = 0.0;
  std::deque<Arrival> arrivals_;
};

}  // namespace meltstage::tb
