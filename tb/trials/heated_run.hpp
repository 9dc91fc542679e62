// SPDX-License-Identifier: Apache-2.0
// A chip heating a head from power-up on, driven by a host as a user's would: settings, commands, a poll each
// second. The model runs from event to event; what happens to the head is done between two calls of until().
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "cmodel/advance.hpp"
#include "tb/pins/head.hpp"

namespace meltstage::tb {

struct HeadSetting {
  chip::spec::Reg reg;
  std::int32_t value;  // as the register holds it
};

/// What a step of full power from cold tells about a head, read at the sensor.
struct StepResponse {
  double rate_degc_per_s;  ///< steepest rise
  double dead_time_s;      ///< where that tangent leaves the start
};
StepResponse step_response(const PlantConfig& plant);

/// The loop alone: every detector that a register can switch off is off, the limits are as wide as they go.
std::vector<HeadSetting> detectors_off();

class HeatedRun {
 public:
  /// Power-up, settings written by the host, first samples taken; heating is off.
  HeatedRun(const HeadConfig& config, std::span<const HeadSetting> settings);

  /// On to that time since power-up, polling; steps of 0.1 s unless the time comes first.
  void until(double time_s);
  double now_s() const { return static_cast<double>(run_.cycle) / chip::spec::kClkHz; }
  std::uint64_t cycle() const { return run_.cycle; }

  /// The host writes; returns once the chip has answered. Throws std::runtime_error when it refuses.
  void write(chip::spec::Reg reg, std::int32_t value);
  void set_point(double degc);
  /// Clears faults and starts heating.
  void start();

  Head& head() { return head_; }
  chip::Run& run() { return run_; }
  const chip::Chip& chip() const { return run_.chip; }
  double reading_degc() const { return run_.chip.guard.pv_q / 64.0; }
  double set_point_degc() const { return set_point_degc_; }
  double heater_degc() const { return head_.plant().heater_degc(run_.cycle); }
  double block_degc() const { return head_.plant().block_degc(run_.cycle); }
  /// When fault_no fell first, seconds; infinite when it has not.
  double tripped_s() const { return tripped_s_; }
  /// Bits of every fault latched up to now.
  std::uint16_t faults() const { return run_.chip.guard.fault_q; }

 private:
  void advance(std::uint64_t until);

  Head head_;
  chip::Run run_;
  double set_point_degc_ = 0.0;
  double tripped_s_ = std::numeric_limits<double>::infinity();
  std::uint64_t next_poll_ = 0;
};

}  // namespace meltstage::tb
