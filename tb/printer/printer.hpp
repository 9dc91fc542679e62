// SPDX-License-Identifier: Apache-2.0
// The virtual printer: the chip heats a simulated head over its UART while the stage prints bumps; every pin
// is recorded.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "cmodel/spec.hpp"
#include "motion/stage/accuracy.hpp"
#include "motion/stage/jetting.hpp"
#include "motion/stage/stage.hpp"
#include "motion/tour/path.hpp"
#include "recording/stream.hpp"
#include "tb/lockstep/lockstep.hpp"
#include "tb/pins/head.hpp"
#include "tb/printer/board_place.hpp"
#include "tb/printer/driven_stage.hpp"

namespace meltstage::tb {

// A register and the raw value that the host writes to it.
struct RegisterValue {
  chip::spec::Reg reg;
  std::uint16_t value;
};

enum class EventKind {
  emergency_stop,
  sensor_open,
  sensor_short,
  sensor_out,
  heater_open,
  switch_short,
  host_lost,
  stage_jam  // the slide of the X axis is stuck
};

// Something that happens to the printer.
struct PrintEvent {
  double at_s;
  EventKind kind;
};

// Which clocks the RTL runs beside the model.
enum class RtlWindows {
  none,
  chosen,  // command phase, heat-up samples, first bumps, shutdown
  full,  // the whole job, after the print, from its recording (tb/windows/windows.hpp): none while it prints
};

// Printing without a stop at the bumps. `plan` is of the job's bumps.
struct FlyBy {
  motion::FlyByConfig config;
  motion::FlyByPlan plan;
};

struct PrintJob {
  std::string name;
  HeadConfig head;
  std::vector<RegisterValue> registers;  // set-point and whatever else the job sets
  std::vector<motion::Point> bumps;      // in the order of printing
  BoardPlace board;                      // in truth
  motion::StageConfig stage;             // its clock is the chip's
  DriveConfig drive;
  Eigen::Vector3d power_on_mm = Eigen::Vector3d::Zero();  // where the head stands first
  Eigen::Vector3d start_mm = Eigen::Vector3d::Zero();     // where it waits for the temperature
  std::array<motion::CompensationTable, 2> compensation;  // of X and Y; empty: none
  std::optional<FlyBy> fly_by;                            // otherwise it stops at each bump
  std::optional<Eigen::Vector3d> end_mm;                  // where the head goes after the last bump
  double place_tolerance_mm = 0.1;                        // a good droplet lands this near to its bump
  double droplet_j = 0.0;                                 // heat that a droplet takes along
  double settle_s = 0.015;                                // pause at each bump before the droplet
  double heat_timeout_s = 600.0;                          // from RUN to at-temperature
  std::vector<PrintEvent> events;
  RtlWindows rtl = RtlWindows::chosen;
  RunIdentity identity;
  std::filesystem::path failures = "failures";  // where a mismatch leaves its files
};

// The head as the host saw it at a poll, and the heater node behind it.
struct Reading {
  double t_s;
  double reading_degc;
  double setpoint_degc;
  double duty;  // 0..1
  double heater_degc;
  bool run;
};

struct PhaseTime {
  std::string name;
  double begin_s;
  double end_s;
};

struct CheckedWindow {
  std::string name;
  std::uint64_t first_cycle;
  std::uint64_t last_cycle;
  unsigned flop_bits;
  Compared compared;
};

struct PrintFault {
  double t_s;
  std::string sentence;
};

// A droplet on the board.
struct Landed {
  std::size_t bump;  // in the order of printing
  double t_s;        // of its trigger
  Eigen::Vector2d miss_mm;
};

struct PrintResult {
  bool good = false;    // every bump printed, each in its place
  std::string verdict;  // one sentence
  std::vector<PhaseTime> phases;
  std::vector<Reading> readings;
  std::vector<CheckedWindow> windows;
  std::vector<PrintFault> faults;
  std::vector<Landed> landed;  // in the order of their triggers
  std::size_t droplets = 0;
  std::size_t misplaced = 0;  // droplets of these beyond the tolerance
  std::uint64_t cycles = 0;
  std::uint64_t frames = 0;                          // Modbus frames that the chip accepted
  double homing_s = 0.0;                             // 0: the stage was homed before
  double largest_miss_mm = 0.0, mean_miss_mm = 0.0;  // of the droplets from their bumps
  double heater_energy_j = 0.0;
  double peak_heater_degc = std::numeric_limits<double>::quiet_NaN();  // NaN: never looked at
};

struct PrintProgress {
  std::string phase;
  double t_s;
  double reading_degc;
  double setpoint_degc;
  std::size_t droplets;
};

// A place of the head, and where the stage is sent so that the head comes there.
struct Sent {
  Eigen::Vector3d to_mm, commanded_mm;
};

// The next move: each compensated axis is corrected for the side from which it comes; one that needn't move
// stays.
Sent send(const PrintJob& job, const Sent& before, const Eigen::Vector3d& to_mm);

// Pins of chip and stage as they are recorded.
recording::Header printer_header(const PrintJob& job);

// Runs the job; every pin goes to `sink`. Throws Mismatch when model and RTL differ; whatever else goes wrong
// with the printer (fault, emergency stop, lost chip) stops it and is in the result.
PrintResult run_print(const PrintJob& job, recording::Sink& sink,
                      const std::function<void(const PrintProgress&)>& progress);

}  // namespace meltstage::tb
