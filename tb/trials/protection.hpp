// SPDX-License-Identifier: Apache-2.0
// What guard is measured on: faults of a heated head, each with the chip and with two firmware rules; and
// healthy jobs in which nothing may trip. docs/chip/protection.md has the tables.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tb/devices/heater.hpp"
#include "tb/trials/heated_run.hpp"

namespace meltstage::tb {

enum class HeadFault : std::uint8_t {
  falls_out,         ///< the sensor reads ambient, after an onset
  half_out,          ///< it sees 60 % of the block's temperature above ambient, after an onset
  reads_low,         ///< it reads 30 degC low, after an onset
  drifts_down,       ///< its reading leaves the truth by 0.1 degC/s
  dead_low,          ///< it reads 1 degC below the set-point, with noise, whatever the head does
  frozen_low,        ///< its value stands 2 degC below the set-point
  heater_open,       ///< the element takes no power
  heater_half,       ///< half of the element is open, after an onset
  switch_short,      ///< the heater's switch conducts whatever its gate says
  switch_short_off,  ///< the same while the heater is switched off
};

enum class Protector : std::uint8_t { chip, marlin, klipper };

struct FaultCase {
  PlantConfig plant;
  double setpoint_degc;
  HeadFault fault;
  bool feedback = true;    ///< heater_fb_i is wired
  std::uint64_t seed = 1;  ///< of the sensor's noise
  double onset_s = 0.0;    ///< in which the fault grows; 0: at once
  double noise_degc = 0.05;
  double watched_s = 400.0;  ///< from the fault on
};
/// Case number `seed`: a head, a set-point, a fault, an onset of 0 to 300 s and a noise of 0 to 0.5 degC, all
/// drawn.
FaultCase draw_fault_case(std::uint64_t seed);

/// The fault in words, as a table names it.
std::string fault_name(const FaultCase& what);

struct FaultOutcome {
  double detected_s;        ///< after the fault; infinite: never
  std::uint16_t faults;     ///< latched by the chip at that time
  double heater_peak_degc;  ///< from the fault to the end of the run
  double block_peak_degc;
};

/// One run on these settings: cold start, hold, fault at 400 s (at 60 s with the heater off) or once the head
/// has been at temperature, then watched. The protector cuts what it can: the chip both switches, a firmware
/// rule the heater's gate. Under a rule the loop is the same chip with its detectors off.
FaultOutcome run_fault(const FaultCase& what, std::vector<HeadSetting> settings, Protector protector);

/// A healthy job: what happened, and who tripped.
struct HealthyJob {
  std::string what;      ///< plant and its changes, for a report
  std::uint16_t faults;  ///< latched by the chip
  double tripped_s;      ///< infinite: never
  bool marlin_tripped;   ///< the rules saw the same readings
  bool klipper_tripped;
  unsigned noisy_frames;  ///< frames with inverted bits
  double heat_s;          ///< length of the job
};

/// Job number `seed`: PH-1 or E3D-like with heat capacity within +-30 %, loss +-40 %, sensor lag x1..2. It is
/// put into service by commission(), and then works with another supply (+-10 %) and ambient (15..30 degC);
/// set-point changes, droplets' heat loss, a fan, a sag, supply dips, single noisy frames.
HealthyJob run_healthy_job(std::uint64_t seed);

}  // namespace meltstage::tb
