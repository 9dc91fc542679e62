// SPDX-License-Identifier: Apache-2.0
#include "app/print/job_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string_view>
#include <utility>

#include "app/print/job_rules.hpp"
#include "base/error.hpp"
#include "base/place.hpp"
#include "base/toml_file.hpp"
#include "host/register_word.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/profile/profile.hpp"
#include "motion/tour/path.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;

// Control settings for a plant from its step response, dead time D and slope R (degC/s at full power): Kp =
// 0.7 / (R D), Ti = 8 D on the way up and 4 D in hold, Td = D / 2, each over the control period.
struct StepResponse {
  std::string_view plant;
  double slope_degc_per_s;
  double dead_time_s;
};
constexpr std::array<StepResponse, 5> kStepResponses{{
    {"PH-1", 0.621, 11.9},
    {"PH-A", 0.513, 14.3},
    {"PH-B", 0.927, 8.0},
    {"PH-C", 0.366, 20.4},
    {"E3D-like", 2.24, 5.0},
}};

std::uint16_t to_register(double value) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0, 65535.0)));
}

std::vector<tb::RegisterValue> tuned(const tb::PlantConfig& plant, double ts_s) {
  for (const StepResponse& r : kStepResponses) {
    if (r.plant != plant.name) continue;
    const double kp = 0.7 / (r.slope_degc_per_s * r.dead_time_s);     // 1/K
    const double lsb = kp * 65536.0 / 64.0;                           // duty LSB per 1/64 degC
    const double hold = plant.block_ambient_w_per_k / plant.power_w;  // duty per degree above ambient
    return {{spec::kRegKp, to_register(lsb * 64.0)},
            {spec::kRegKiApproach, to_register(lsb * ts_s / (8.0 * r.dead_time_s) * 16384.0)},
            {spec::kRegKiHold, to_register(lsb * ts_s / (4.0 * r.dead_time_s) * 16384.0)},
            {spec::kRegKd, to_register(lsb * 0.5 * r.dead_time_s / ts_s * 8.0)},
            {spec::kRegKff, to_register(hold * 0x1p22)},
            {spec::kRegLbaTime, to_register(30.0 * r.dead_time_s)}};
  }
  return {};
}

void set_register(std::vector<tb::RegisterValue>& registers, spec::Reg reg, std::uint16_t value) {
  for (tb::RegisterValue& r : registers) {
    if (r.reg == reg) {
      r.value = value;
      return;
    }
  }
  registers.push_back({reg, value});
}

bool is_power_of_ten(double step) {
  const double exponent = std::log10(step);
  return std::abs(exponent - std::round(exponent)) < 1e-9;
}

// What a register counts in decimal steps it holds as it is written. Of a binary fraction, as gains are, that
// can't be asked: there it holds nearly the same.
void require_held(const TomlSection& section, std::string_view key, const spec::RegisterInfo& info,
                  double value) {
  constexpr double kSame = 1e-6, kNearlySame = 0.01, kRoundedByTools = 0.05;
  const double steps = value / info.scale, off = std::abs(steps - std::round(steps));
  const bool held = is_power_of_ten(info.scale)
                        ? off <= kSame
                        : off <= kRoundedByTools || off <= kNearlySame * std::abs(steps);
  if (held) return;
  section.fail(key, fmt::format("{:.9g}", value),
               fmt::format("what the register {} can hold; the nearest are {:.9g} and {:.9g}{}{}", info.name,
                           std::floor(steps) * info.scale, std::ceil(steps) * info.scale,
                           info.unit.empty() ? "" : " ", info.unit));
}

// [registers]: any holding register by its name, in its unit.
std::vector<tb::RegisterValue> read_registers(TomlSection& section) {
  std::vector<tb::RegisterValue> registers;
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) {
    const spec::RegisterInfo& info = spec::kHolding[i];
    const double value = section.number(info.name, 0.0, (info.min - 0.5) * info.scale,
                                        (info.max + 0.5) * info.scale);  // rounded to a word below
    if (!section.has(info.name)) continue;
    const host::RegisterWord word = host::register_word(info, value);
    if (!word.expected.empty()) section.fail(info.name, fmt::format("{:.9g}", value), word.expected);
    require_held(section, info.name, info, value);
    registers.push_back({static_cast<spec::Reg>(i), word.word});
  }
  return registers;
}

// The value of a register that [registers] names; else what it would be without.
double named_or(const std::vector<tb::RegisterValue>& named, spec::Reg reg, double otherwise) {
  const auto found = std::find_if(named.begin(), named.end(), [&](const auto& r) { return r.reg == reg; });
  return found == named.end() ? otherwise : found->value * spec::kHolding[reg].scale;
}

// A number of [temperature] that a register holds.
double held_number(TomlSection& section, std::string_view key, spec::Reg reg, double fallback, double min,
                   double max) {
  const double value = section.number(key, fallback, min, max);
  require_held(section, key, spec::kHolding[reg], value);
  return value;
}

tb::EventKind event_kind(TomlSection& section) {
  static constexpr std::array<Choice<tb::EventKind>, 8> kKinds{{
      {"emergency-stop", tb::EventKind::emergency_stop},
      {"sensor-open", tb::EventKind::sensor_open},
      {"sensor-short", tb::EventKind::sensor_short},
      {"sensor-out", tb::EventKind::sensor_out},
      {"heater-open", tb::EventKind::heater_open},
      {"switch-short", tb::EventKind::switch_short},
      {"host-lost", tb::EventKind::host_lost},
      {"stage-jam", tb::EventKind::stage_jam},
  }};
  return section.choice("what", "", kKinds);
}

constexpr const char* kDefaultMetric = "time";  // what who prints waits for

// [print]: what the path is planned for. The stage's limits and the pause at a bump are known by then.
motion::PathTask path_task(TomlSection& print, tb::PrintJob& job) {
  static constexpr std::array<Choice<motion::Metric>, 4> kMetrics{{{"manhattan", motion::Metric::manhattan},
                                                                   {"chebyshev", motion::Metric::chebyshev},
                                                                   {"euclidean", motion::Metric::euclidean},
                                                                   {"time", motion::Metric::time}}};
  static constexpr std::array<Choice<motion::Tour>, 2> kTours{
      {{"open", motion::Tour::open}, {"closed", motion::Tour::closed}}};
  static constexpr std::array<Choice<bool>, 2> kStarts{{{"stage", true}, {"free", false}}};
  motion::PathTask task;
  task.metric = print.choice("metric", kDefaultMetric, kMetrics);
  task.tour = print.choice("tour", "open", kTours);
  if (print.has("search_s")) task.search_s = print.number("search_s", 1.0, 1e-3, motion::kLongestSearch_s);
  const bool from_stage = print.choice("begin", "stage", kStarts);
  if (from_stage) task.start = {job.start_mm.x(), job.start_mm.y()};
  task.times = {job.stage.axes[0].limits, job.stage.axes[1].limits, job.settle_s};
  const double nowhere = std::numeric_limits<double>::quiet_NaN();
  const auto& axes = job.stage.axes;
  const double x_mm = print.number("end_x_mm", nowhere, axes[0].travel.min_mm, axes[0].travel.max_mm);
  const double y_mm = print.number("end_y_mm", nowhere, axes[1].travel.min_mm, axes[1].travel.max_mm);
  if (std::isnan(x_mm) != std::isnan(y_mm))
    print.fail(std::isnan(x_mm) ? "end_x_mm" : "end_y_mm", "nothing", "both end_x_mm and end_y_mm, or none");
  if (!std::isnan(x_mm)) task.end = {x_mm, y_mm};
  if (task.end && task.tour == motion::Tour::closed)
    print.fail("end_x_mm", "an end", "none for a closed tour, which returns to where it began");
  return task;
}

struct AxisMotion {
  double speed_mm_s, acceleration_mm_s2, deceleration_mm_s2, jerk_mm_s3, deceleration_jerk_mm_s3;
};

// Of [stage], or of [stage.x] and [stage.y], where what is not said is as [stage] has it. What says nothing
// of slowing down slows down as it speeds up.
AxisMotion axis_motion(TomlSection& section, const AxisMotion& otherwise) {
  AxisMotion axis = otherwise;
  axis.speed_mm_s = section.number("speed_mm_s", otherwise.speed_mm_s, 0.1, 400.0);
  axis.acceleration_mm_s2 = section.number("acceleration_mm_s2", otherwise.acceleration_mm_s2, 1.0, 20000.0);
  axis.jerk_mm_s3 = section.number("jerk_mm_s3", otherwise.jerk_mm_s3, 10.0, 1e7);
  axis.deceleration_mm_s2 = section.number(
      "deceleration_mm_s2",
      section.has("acceleration_mm_s2") ? axis.acceleration_mm_s2 : otherwise.deceleration_mm_s2, 1.0,
      20000.0);
  axis.deceleration_jerk_mm_s3 = section.number(
      "deceleration_jerk_mm_s3",
      section.has("jerk_mm_s3") ? axis.jerk_mm_s3 : otherwise.deceleration_jerk_mm_s3, 10.0, 1e7);
  return axis;
}

motion::ScurveLimits limits_of(const AxisMotion& axis) {
  return motion::asymmetric_limits(axis.speed_mm_s, axis.acceleration_mm_s2, axis.deceleration_mm_s2,
                                   axis.jerk_mm_s3, axis.deceleration_jerk_mm_s3);
}

motion::Range axis_travel(TomlSection& section) {
  constexpr double kFarthest_mm = 2000.0, kLeast_mm = 1.0;
  motion::Range travel;
  travel.min_mm = section.number("travel_from_mm", travel.min_mm, -kFarthest_mm, kFarthest_mm - kLeast_mm);
  travel.max_mm = section.number("travel_to_mm", std::max(travel.max_mm, travel.min_mm + kLeast_mm),
                                 travel.min_mm + kLeast_mm, kFarthest_mm);
  return travel;
}

// [stage]: what drives it, and how it moves.
void read_stage(TomlSection& stage, JobDescription& parsed, const std::filesystem::path& folder) {
  tb::PrintJob& job = parsed.job;
  const AxisMotion all = axis_motion(stage, {100.0, 1000.0, 1000.0, 50000.0, 50000.0});
  for (motion::AxisConfig& axis : job.stage.axes) axis.limits = limits_of(all);
  for (const auto& [i, name] : {std::pair{0U, "x"}, {1U, "y"}}) {
    TomlSection own = stage.section(name);
    job.stage.axes[i].limits = limits_of(axis_motion(own, all));
    job.stage.axes[i].travel = axis_travel(own);
    own.finish();
  }
  // Half a turn above the home switch, as the coupling of a machine is set.
  for (motion::AxisConfig& axis : job.stage.axes) axis.index_mm = axis.travel.min_mm + 0.5 * axis.lead_mm;
  const auto place = [&](std::size_t axis, std::string_view key, double fallback_mm) {
    const auto& [min_mm, max_mm] = job.stage.axes[axis].travel;
    return stage.number(key, std::clamp(fallback_mm, min_mm, max_mm), min_mm, max_mm);
  };
  job.start_mm = {place(0, "start_x_mm", 0.0), place(1, "start_y_mm", 0.0), 0.0};
  job.drive.homed = !stage.flag("homing", false);
  job.power_on_mm = {place(0, "power_on_x_mm", job.start_mm.x()), place(1, "power_on_y_mm", job.start_mm.y()),
                     0.0};
  job.stage.clock_hz = spec::kClkHz;

  const motion::ModeBand band{
      {stage.number("mode_hz", 38.0, 1.0, 1000.0), stage.number("mode_damping", 0.05, 0.0, 0.99)},
      stage.number("mode_spread", 0.1, 0.0, 0.5)};
  const double tolerance_mm = 1e-3 * stage.number("quiet_tolerance_um", 1.0, 0.01, 1000.0);
  if (stage.flag("quiet", false)) job.stage.quiet = motion::QuietMoves{band, tolerance_mm};
  parsed.quiet_place = stage.place_of("quiet_tolerance_um");

  static constexpr std::array<std::array<std::string_view, 4>, 2> kKeys{
      {{"lead_error_x_um_per_m", "lead_error_x_um", "backlash_x_um", "deviations_x"},
       {"lead_error_y_um_per_m", "lead_error_y_um", "backlash_y_um", "deviations_y"}}};
  for (std::size_t i = 0; i < kKeys.size(); ++i) {
    motion::AxisModelConfig& axis = job.drive.axes[i];
    axis.mode = band.nominal;
    axis.screw.lead_error_share = 1e-6 * stage.number(kKeys[i][0], 0.0, -1000.0, 1000.0);
    axis.screw.lead_error_mm = 1e-3 * stage.number(kKeys[i][1], 0.0, -100.0, 100.0);
    axis.screw.backlash_mm = 1e-3 * stage.number(kKeys[i][2], 0.0, 0.0, 1000.0);
    const std::string file = stage.text(kKeys[i][3], "");
    if (file.empty()) continue;
    parsed.inputs.push_back(folder / file);
    try {
      parsed.deviations[i] = motion::read_deviations(folder / file);
      motion::require_correctable((folder / file).string(), *parsed.deviations[i], job.stage.axes[i].travel);
    } catch (const motion::MotionError& error) {
      throw UserError(error.what());
    }
  }
}

// The points of a file; what the reader has to tell of it joins the notes.
std::vector<motion::Point> read_noted(const std::filesystem::path& file,
                                      const motion::CoordinateOptions& options,
                                      std::vector<std::string>& notes) {
  motion::CoordinateFile read = motion::read_coordinate_file(file, options);
  for (const std::string& note : read.notes)
    notes.push_back(fmt::format("{}: {}", shown(file.string()), note));
  return std::move(read.points);
}

// [alignment]: the board's marks, in the frame of the bumps' file and placed with them.
tb::BoardAlignment read_alignment(TomlSection& alignment, JobDescription& parsed,
                                  const std::filesystem::path& folder, motion::CoordinateOptions placed,
                                  std::uint64_t seed) {
  constexpr double kDegree_rad = std::numbers::pi / 180.0;
  static constexpr std::array<Choice<tb::StageKnowledge>, 2> kKnowledge{
      {{"calibrated", tb::StageKnowledge::calibrated}, {"nominal", tb::StageKnowledge::nominal}}};
  tb::BoardAlignment board;
  board.seed = seed;
  const std::string file = alignment.text("marks", "");
  if (file.empty())
    alignment.fail("marks", "nothing", "the name of a file with the board's marks, such as fiducials.csv");
  placed.pitch_mm = alignment.number("pitch_mm", 1.0, 1e-6, 1e6);
  board.mark_diameter_mm = alignment.number("mark_diameter_mm", 1.0, 0.3, 1.5);
  board.limits.place_mm = 1e-3 * alignment.number("tolerance_um", 5.0, 0.1, 1000.0);
  board.limits.board_mm = 1e-3 * alignment.number("board_tolerance_um", 50.0, 1.0, 1000.0);
  board.limits.most_moves = static_cast<int>(alignment.integer("moves", 3, 1, 20));
  board.knowledge = alignment.choice("stage", "calibrated", kKnowledge);
  board.slider_sigma_mm = 1e-3 * alignment.number("slider_sigma_um", 1.0, 0.01, 100.0);
  board.lies = {1e-3 * alignment.number("board_x_um", 0.0, -10000.0, 10000.0),
                1e-3 * alignment.number("board_y_um", 0.0, -10000.0, 10000.0),
                kDegree_rad * alignment.number("board_turn_deg", 0.0, -180.0, 180.0)};
  board.upside_down = alignment.flag("upside_down", false);
  const auto missing = alignment.integer("missing_mark", 0, 0, 1000);
  if (missing > 0) board.missing_mark = static_cast<std::size_t>(missing - 1);
  alignment.finish();
  parsed.inputs.push_back(folder / file);
  for (const motion::Point& mark : read_noted(folder / file, placed, parsed.notes))
    board.marks_mm.emplace_back(mark.x_mm, mark.y_mm);
  if (board.marks_mm.size() < 2)
    throw UserError(
        fmt::format("{}: found 1 mark, expected at least 2 to align a board by", (folder / file).string()));
  if (board.missing_mark && *board.missing_mark >= board.marks_mm.size())
    alignment.fail("missing_mark", fmt::format("{}", missing),
                   fmt::format("0 (none) to {}, the marks of {}", board.marks_mm.size(), file));
  return board;
}

/// The plant and its sensor, which is returned.
const spec::SensorPreset& read_head(TomlSection& head, tb::PrintJob& job) {
  job.head.plant = head.named("plant", "PH-1", std::span(tb::kPlants));
  const spec::SensorPreset& sensor =
      head.named("sensor", "MAX31855", std::span(spec::kSensorPresets).subspan<1>());
  job.head.sensor = sensor.name;
  job.head.sensor_noise_degc = head.number("sensor_noise_degc", 0.05, 0.0, 5.0);
  job.head.plant.ambient_degc = head.number("ambient_degc", 25.0, -20.0, 80.0);
  head.finish();
  return sensor;
}

/// Set-point, window, dwell and period, and the registers that follow from them or are named.
void read_temperature(TomlSection& temperature, TomlSection& registers, const TomlSection& head,
                      const spec::SensorPreset& sensor, tb::PrintJob& job) {
  const double setpoint = held_number(temperature, "setpoint_degc", spec::kRegSetpoint, 110.0, 0.0, 500.0);
  const double window = held_number(temperature, "window_degc", spec::kRegAtWindow, 1.0, 0.1, 100.0);
  const double dwell = held_number(temperature, "dwell_s", spec::kRegAtDwell, 3.0, 0.0, 600.0);
  job.heat_timeout_s = temperature.number("timeout_s", 600.0, 1.0, 7200.0);
  // The register counts whole milliseconds, and the gains hold for its period.
  const auto period_ms =
      static_cast<std::uint16_t>(temperature.integer("period_ms", sensor.min_ts_ms, 10, 2000));
  temperature.finish();

  const std::vector<tb::RegisterValue> named = read_registers(registers);
  registers.finish();
  // What depends on the period and the set-point goes by those that count in the end.
  job.registers = tuned(job.head.plant, named_or(named, spec::kRegTs, period_ms) / 1000.0);
  set_register(job.registers, spec::kRegSetpoint, static_cast<std::uint16_t>(std::lround(setpoint * 10.0)));
  set_register(
      job.registers, spec::kRegTMax,
      static_cast<std::uint16_t>(std::lround(
          std::min({named_or(named, spec::kRegSetpoint, setpoint) + 40.0, 500.0, sensor.highest_degc}) *
          10.0)));
  set_register(job.registers, spec::kRegTAmb,
               static_cast<std::uint16_t>(std::lround(job.head.plant.ambient_degc * 10.0)));
  set_register(job.registers, spec::kRegAtWindow, static_cast<std::uint16_t>(std::lround(window * 10.0)));
  set_register(job.registers, spec::kRegAtDwell, static_cast<std::uint16_t>(std::lround(dwell * 10.0)));
  set_register(job.registers, spec::kRegTs, period_ms);
  set_register(job.registers, spec::kRegSensType,
               static_cast<std::uint16_t>(&sensor - spec::kSensorPresets.data()));
  for (const tb::RegisterValue& r : named) set_register(job.registers, r.reg, r.value);
  require_printable(job, sensor, {head, temperature, registers});
  for (const spec::Reg bus : {spec::kRegAddress, spec::kRegBaud, spec::kRegFormat}) {
    if (registers.has(spec::kHolding[bus].name))
      registers.fail(spec::kHolding[bus].name, "a value",
                     "none: the printer's host talks at the reset address, baud rate and format");
  }
}

/// Where the bumps stand, and how they are to be read.
motion::CoordinateOptions read_coordinates(TomlSection& coordinates, JobDescription& parsed) {
  const std::string file = coordinates.text("file", "");
  if (file.empty()) coordinates.fail("file", "nothing", "the name of a file with bumps, such as bumps.csv");
  motion::CoordinateOptions options;
  options.pitch_mm = coordinates.number("pitch_mm", 1.0, 1e-6, 1e6);
  options.origin_x_mm = coordinates.number("origin_x_mm", 0.0, -1e6, 1e6);
  options.origin_y_mm = coordinates.number("origin_y_mm", 0.0, -1e6, 1e6);
  options.rotation_deg = coordinates.number("rotation_deg", 0.0, -360.0, 360.0);
  options.mirror_x = coordinates.flag("mirror_x", false);
  static constexpr std::array<Choice<motion::Side>, 2> kSides{
      {{"top", motion::Side::top}, {"bottom", motion::Side::bottom}}};
  const motion::Side side = coordinates.choice("side", "top", kSides);
  if (coordinates.has("side")) options.side = side;
  options.only = coordinates.text("only", "");
  const auto& axes = parsed.job.stage.axes;
  options.travel = {axes[0].travel, axes[1].travel, axes[2].travel};
  coordinates.finish();
  parsed.coordinates = parsed.file.parent_path() / file;
  parsed.inputs.insert(parsed.inputs.end(), {parsed.file, parsed.coordinates});
  return options;
}

motion::FlyByConfig read_fly_by(TomlSection& print, const tb::PrintJob& job) {
  motion::FlyByConfig fly_by;
  fly_by.x = job.stage.axes[0].limits;
  fly_by.y = job.stage.axes[1].limits;
  fly_by.droplets_per_s = print.number("droplets_per_s", 200.0, 0.1, 10000.0);
  fly_by.latency_s = 1e-6 * print.number("latency_us", 50.0, 0.0, 10000.0);
  fly_by.flight_s = 1e-6 * print.number("flight_us", 500.0, 0.0, 100000.0);
  fly_by.encoder_mm = job.drive.axes[0].encoder_mm;
  fly_by.settle_s = job.settle_s;
  return fly_by;
}

/// How bumps are printed; the tolerance of their places as the file has it, if it has one.
std::optional<double> read_print(TomlSection& print, JobDescription& parsed) {
  tb::PrintJob& job = parsed.job;
  const double place_tolerance_um = print.number("place_tolerance_um", 0.0, 0.1, 10000.0);
  job.droplet_j = print.number("droplet_j", 0.0, 0.0, 10.0);
  job.settle_s = print.number("settle_ms", 15.0, 0.0, 10000.0) / 1000.0;
  parsed.task = path_task(print, job);
  parsed.plan_metric = print.text("metric", kDefaultMetric);
  static constexpr std::array<Choice<bool>, 2> kModes{{{"stop", false}, {"fly-by", true}}};
  const bool on_the_fly = print.choice("mode", "stop", kModes);
  const motion::FlyByConfig fly_by = read_fly_by(print, job);
  if (on_the_fly) parsed.fly_by = fly_by;
  print.finish();
  if (!print.has("place_tolerance_um")) return std::nullopt;
  return 1e-3 * place_tolerance_um;
}

tb::RtlWindows read_rtl(TomlSection& rtl) {
  static constexpr std::array<Choice<tb::RtlWindows>, 3> kRtl{
      {{"chosen", tb::RtlWindows::chosen}, {"full", tb::RtlWindows::full}, {"none", tb::RtlWindows::none}}};
  const tb::RtlWindows windows = rtl.choice("windows", "chosen", kRtl);
  rtl.finish();
  return windows;
}

/// In order of time.
void read_events(std::vector<TomlSection>& events, tb::PrintJob& job) {
  for (TomlSection& event : events) {
    const double at = event.number("at_s", -1.0, 0.0, 1e6);
    if (at < 0.0) event.fail("at_s", "nothing", "a time in seconds");
    job.events.push_back({at, event_kind(event)});
    event.finish();
  }
  std::stable_sort(job.events.begin(), job.events.end(), [](auto& a, auto& b) { return a.at_s < b.at_s; });
}

/// Boards are aligned where the drawn stage is.
void require_drawn_travel(const TomlSection& alignment, const motion::CoordinateOptions& options) {
  const motion::Range drawn;  // the alignment stage lies under the middle of it
  for (const motion::Range& travel : {options.travel.x, options.travel.y})
    if (travel.min_mm != drawn.min_mm || travel.max_mm != drawn.max_mm)
      alignment.fail(
          "marks", fmt::format("a stage of {:.6g}..{:.6g} mm", travel.min_mm, travel.max_mm),
          fmt::format("travels of {:.6g}..{:.6g} mm, where boards are aligned", drawn.min_mm, drawn.max_mm));
}

void read_bumps(TomlSection& alignment, const motion::CoordinateOptions& options,
                const std::optional<double>& place_tolerance_mm, JobDescription& parsed) {
  try {
    parsed.bumps_in_file_order = read_noted(parsed.coordinates, options, parsed.notes);
    parsed.job.place_tolerance_mm =
        place_tolerance_mm ? *place_tolerance_mm : default_place_tolerance_mm(parsed.bumps_in_file_order);
    if (!alignment.present()) return;
    require_drawn_travel(alignment, options);
    parsed.alignment =
        read_alignment(alignment, parsed, parsed.file.parent_path(), options, parsed.job.head.seed);
  } catch (const motion::CoordinateError& error) {
    throw UserError(error.what());
  }
}

}  // namespace

JobDescription parse_job(const std::filesystem::path& path) {
  const toml::table table = parse_toml(path, "a job file (TOML); examples/ has some");
  TomlSection root(path, &table, "");
  TomlSection general = root.section("job");
  TomlSection head = root.section("head");
  TomlSection temperature = root.section("temperature");
  TomlSection registers = root.section("registers");
  TomlSection stage = root.section("stage");
  TomlSection coordinates = root.section("coordinates");
  TomlSection print = root.section("print");
  TomlSection rtl = root.section("rtl");
  TomlSection alignment = root.section("alignment");
  std::vector<TomlSection> events = root.sections("event");
  root.finish();

  JobDescription parsed;
  parsed.file = path;
  tb::PrintJob& job = parsed.job;

  job.name = general.text("name", escaped(path.stem().string()));
  job.head.seed = static_cast<std::uint64_t>(general.integer("seed", 1, 0, INT64_MAX));
  general.finish();

  const spec::SensorPreset& sensor = read_head(head, job);
  read_temperature(temperature, registers, head, sensor, job);
  read_stage(stage, parsed, path.parent_path());
  stage.finish();
  const motion::CoordinateOptions options = read_coordinates(coordinates, parsed);
  const std::optional<double> place_tolerance_mm = read_print(print, parsed);
  job.rtl = read_rtl(rtl);
  read_events(events, job);
  read_bumps(alignment, options, place_tolerance_mm, parsed);
  return parsed;
}

}  // namespace meltstage::app
