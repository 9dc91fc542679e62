// SPDX-License-Identifier: Apache-2.0
// What guard is measured on: faults of a heated head, each with the chip and with two firmware rules; and
// healthy jobs in which nothing may trip. docs/chip/protection.md has the tables.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "tb/devices/heater.hpp"

namespace meltstage::tb {

enum class HeadFault : std::uint8_t {
  falls_out,         ///< the sensor reads ambient
  half_out,          ///< it sees 60 % of the block's temperature above ambient, after an onset
  dead_low,          ///< it reads 1 degC below the set-point, with noise, whatever the head does
  frozen_low,        ///< its value stands 2 degC below the set-point
  heater_open,       ///< the element takes no power
  switch_short,      ///< the heater's switch conducts whatever its gate says
  switch_short_off,  ///< the same while the heater is switched off
};

enum class Protector : std::uint8_t { chip, marlin, klipper };

struct FaultCase {
  std::string_view plant;  ///< of kPlants
  double setpoint_degc;
  HeadFault fault;
  bool feedback = true;    ///< heater_fb_i is wired
  std::uint64_t seed = 1;  ///< of the sensor's noise
  double onset_s = 0.0;    ///< in which half_out grows
  double noise_degc = 0.05;
};
/// The fault in words, as a table names it.
std::string fault_name(const FaultCase& what);

struct FaultOutcome {
  double detected_s;        ///< after the fault; infinite: never
  std::uint16_t faults;     ///< latched by the chip at that time
  double heater_peak_degc;  ///< from the fault to the end of the run
  double block_peak_degc;
};

/// One run: cold start, hold, fault at 400 s (at 60 s with the heater off), 400 s after it. The protector
/// cuts what it can: the chip both switches, a firmware rule the heater's gate. Under a rule the loop is the
/// same chip with its detectors off.
FaultOutcome run_fault(const FaultCase& what, Protector protector);

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

/// Job number `seed`: PH-1 or E3D-like with heat capacity within +-30 %, loss +-40 %, supply +-10 %, sensor
/// lag x1..2, ambient 15..25 degC, on settings made for the plain plant; set-point changes, droplets' heat
/// loss, supply dips, single noisy frames.
HealthyJob run_healthy_job(std::uint64_t seed);

}  // namespace meltstage::tb
