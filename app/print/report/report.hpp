// SPDX-License-Identifier: Apache-2.0
// What one print has to tell, as a page for a person and as a summary for a program.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace meltstage::app {

/// One line of a table of names and texts.
struct NamedText {
  std::string name;
  std::string text;
};

/// One measured value. The page shows whole numbers in full and others to four significant digits.
struct KeyFigure {
  std::string what;
  double value = 0.0;
  std::string unit;  ///< plain ASCII (degC, mm/s); empty for a count
};

/// Temperatures at one instant; NaN where there is none (the curve has a gap there).
struct TemperatureSample {
  double t_s = 0.0;
  double reading_degc = 0.0;   ///< what the chip measured
  double heater_degc = 0.0;    ///< heater node of the plant
  double setpoint_degc = 0.0;  ///< what the chip regulates to, after its ramp; NaN while the heater is off
};

/// Duty of the heater from this instant to the next sample.
struct DutySample {
  double t_s = 0.0;
  double duty = 0.0;  ///< 0 to 1
};

/// A stretch of the job: command, heat-up, print, shutdown.
struct Phase {
  std::string name;
  double begin_s = 0.0;
  double end_s = 0.0;
};

struct PathPoint {
  double x_mm = 0.0;
  double y_mm = 0.0;
};

/// The bumps in the order they are visited, and what that costs in the planner's metric.
struct Path {
  std::vector<PathPoint> points;
  double cost = 0.0;
};

/// Where a droplet fell.
struct Droplet {
  std::size_t bump = 0;  ///< in the planned order, from 0
  double t_s = 0.0;
  double miss_x_um = 0.0;  ///< beside its bump
  double miss_y_um = 0.0;
};

/// A stretch of clocks over which the RTL ran beside the C++ model.
struct LockstepWindow {
  std::string name;
  std::uint64_t first_cycle = 0;
  std::uint64_t last_cycle = 0;
  std::uint64_t clocks = 0;           ///< clocks compared
  std::uint64_t flops_per_clock = 0;  ///< flops compared on each of them
  std::uint64_t comparisons = 0;      ///< values compared in all: flops and pins
  std::uint64_t mismatches = 0;
};

/// One window of a check of the whole job.
struct CheckedWindow {
  std::uint64_t first_cycle = 0;
  std::uint64_t last_cycle = 0;
  std::string verdict;      ///< equal, differs, missing, unusable
  std::string start_state;  ///< SHA-256 of the chip's state
  std::string end_state;
};

/// The whole job in RTL, window by window.
struct WindowCheck {
  bool whole = false;  ///< every clock compared exactly once, all equal
  std::vector<CheckedWindow> windows;
  std::uint64_t equal = 0;   ///< windows
  std::uint64_t cycles = 0;  ///< clocks of the job
  std::uint64_t clocks = 0;  ///< clocks compared and equal
  std::uint64_t flop_values = 0;
  std::uint64_t pin_values = 0;
  double clock_hz = 0.0;
  std::vector<std::string> faults;  ///< gaps, differences
  std::vector<std::string> lost_workers;
  std::string workers;
  double wall_s = 0.0;
};

/// Something that went wrong, and when.
struct Fault {
  double t_s = 0.0;
  std::string sentence;
};

/// Everything the page and the summary say about one print. An empty list is shown as "none", never hidden.
struct PrintReport {
  std::string job;                  ///< the job's name
  std::string date;                 ///< when it ran, ISO 8601
  std::vector<NamedText> versions;  ///< tools and the stamp of the source
  bool good = false;
  std::string verdict;  ///< one sentence that says why it is good or bad
  std::vector<KeyFigure> key_figures;
  std::vector<TemperatureSample> temperature;  ///< by time
  std::vector<DutySample> duty;                ///< by time
  std::vector<Phase> phases;
  Path path_before;               ///< order of the coordinate file
  Path path_after;                ///< planned order
  std::string path_unit = "mm";   ///< of the paths' costs: "mm", or "s" where the path is planned in time
  double path_bound = 0.0;        ///< no order costs less
  std::vector<Droplet> droplets;  ///< by time
  double good_miss_um = 0.0;      ///< a droplet nearer to its bump is a good one
  std::vector<LockstepWindow> lockstep;
  std::optional<WindowCheck> windows;  ///< of a job that ran in RTL as a whole
  std::vector<Fault> faults;
  std::vector<NamedText> settings;
};

/// Version of summary.json's structure; raised when a field changes its meaning or goes away.
inline constexpr int kSummarySchema = 2;

/// Curves of the page hold at most this many values each; extremes are kept.
inline constexpr std::size_t kMaxCurvePoints = 2000;

/// A path of the page holds at most this many bumps: the first ones, and the page says how many there are.
inline constexpr std::size_t kMaxPathPoints = 20'000;

/// The page: one HTML file that needs neither network nor other files. Texts may hold any character.
std::string render_report(const PrintReport& report);

/// The report without its curves and paths, as indented JSON: schema, job, verdict, key figures, phases,
/// lockstep, windows, faults, settings, versions. NaN is written as null.
std::string summary_json(const PrintReport& report);

/// Whether a text is what summary_json() writes, or wrote when it had fewer fields.
bool is_summary(std::string_view text);

/// Writes the page; it appears whole or not at all.
/// @throws std::runtime_error with one line naming the path when it can't be written.
void write_report(const std::filesystem::path& path, const PrintReport& report);

}  // namespace meltstage::app
