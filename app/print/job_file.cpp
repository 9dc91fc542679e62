// SPDX-License-Identifier: Apache-2.0
#include "app/print/job_file.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string_view>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/place.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/profile/profile.hpp"
#include "motion/tour/path.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;

// A table of the job file that remembers which keys were asked for, so that a misspelt one is told.
class Section {
 public:
  Section(const std::filesystem::path& file, const toml::table* table, std::string name)
      : file_(file), table_(table), name_(std::move(name)) {}

  bool present() const { return table_ != nullptr; }

  double number(std::string_view key, double fallback, double min, double max) {
    const toml::node* node = find(key);
    if (node == nullptr) return fallback;
    const auto value = node->value<double>();
    if (!value || !node->is_number())
      fail(key, text_of(*node), fmt::format("a number from {} to {}", min, max), node);
    if (!(*value >= min && *value <= max))
      fail(key, fmt::format("{}", *value), fmt::format("{} to {}", min, max), node);
    return *value;
  }

  std::int64_t integer(std::string_view key, std::int64_t fallback, std::int64_t min, std::int64_t max) {
    const toml::node* node = find(key);
    if (node == nullptr) return fallback;
    if (!node->is_integer())
      fail(key, text_of(*node), fmt::format("a whole number from {} to {}", min, max), node);
    const std::int64_t value = **node->as_integer();
    if (value < min || value > max)
      fail(key, fmt::format("{}", value), fmt::format("{} to {}", min, max), node);
    return value;
  }

  bool flag(std::string_view key, bool fallback) {
    const toml::node* node = find(key);
    if (node == nullptr) return fallback;
    if (!node->is_boolean()) fail(key, text_of(*node), "true or false", node);
    return **node->as_boolean();
  }

  std::string text(std::string_view key, std::string_view fallback) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::string(fallback);
    if (!node->is_string()) fail(key, text_of(*node), "a text in quotes", node);
    const std::string& value = **node->as_string();
    if (escaped(value) != value) fail(key, text_of(*node), "a text without control characters", node);
    return value;
  }

  template <class T, std::size_t n>
  T choice(std::string_view key, std::string_view fallback,
           const std::array<std::pair<std::string_view, T>, n>& choices) {
    const std::string value = text(key, fallback);
    std::string names;
    for (const auto& [name, result] : choices) {
      if (name == value) return result;
      names += (names.empty() ? "" : ", ") + std::string(name);
    }
    fail(key, '"' + value + '"', "one of: " + names, find(key));
  }

  [[noreturn]] void fail(std::string_view key, const std::string& found, const std::string& expected,
                         const toml::node* node) const {
    const auto line = node != nullptr ? node->source().begin.line : 0;
    throw UserError(fmt::format("{}:{}: {}.{}: found {}, expected {}", file_.string(), line, name_, key,
                                found, expected));
  }

  // Every key that nobody asked for is a mistake.
  void finish() const {
    if (table_ == nullptr) return;
    for (const auto& [key, node] : *table_) {
      if (!asked_.contains(std::string(key.str()))) {
        std::string known;
        for (const std::string& k : asked_) known += (known.empty() ? "" : ", ") + k;
        throw UserError(fmt::format("{}:{}: {}.{}: unknown field, expected one of: {}", file_.string(),
                                    node.source().begin.line, name_, shown(key.str()), known));
      }
    }
  }

  const toml::table* table() const { return table_; }

 private:
  const toml::node* find(std::string_view key) {
    asked_.insert(std::string(key));
    return table_ != nullptr ? table_->get(key) : nullptr;
  }
  static std::string text_of(const toml::node& node) {
    if (const auto text = node.value<std::string>()) return '"' + shown(*text) + '"';
    return fmt::format("a {}", toml::impl::node_type_friendly_names[static_cast<std::size_t>(node.type())]);
  }

  std::filesystem::path file_;
  const toml::table* table_;
  std::string name_;
  std::set<std::string> asked_;
};

toml::table parse(const std::filesystem::path& path) {
  const std::string text = read_toml_text(path, "a job file (TOML); examples/ has some");
  try {
    toml::table table = toml::parse(text, path.string());
    if (table.empty())
      throw UserError(fmt::format("{}: is empty, expected a job file (TOML)", path.string()));
    return table;
  } catch (const toml::parse_error& error) {
    throw UserError(fmt::format("{}:{}:{}: not TOML: {}", path.string(), error.source().begin.line,
                                error.source().begin.column, escaped(error.description())));
  }
}

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

// [registers]: any holding register by its name, in its unit.
void read_registers(Section& section, std::vector<tb::RegisterValue>& registers) {
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) {
    const spec::RegisterInfo& info = spec::kHolding[i];
    if (!section.present() || section.table()->get(info.name) == nullptr) {
      section.number(info.name, 0.0, info.min * info.scale, info.max * info.scale);
      continue;
    }
    const double value = section.number(info.name, 0.0, info.min * info.scale, info.max * info.scale);
    set_register(registers, static_cast<spec::Reg>(i),
                 static_cast<std::uint16_t>(std::lround(value / info.scale)));
  }
}

std::uint16_t sensor_code(const std::string& name) {
  for (std::size_t i = 1; i < spec::kSensorPresets.size(); ++i) {
    if (spec::kSensorPresets[i].name == name) return static_cast<std::uint16_t>(i);
  }
  return 0;
}

tb::EventKind event_kind(Section& section) {
  static constexpr std::array<std::pair<std::string_view, tb::EventKind>, 8> kKinds{{
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

// [print]: what the path is planned for. The stage's limits and the pause at a bump are known by then.
motion::PathTask path_task(Section& print, tb::PrintJob& job) {
  static constexpr std::array<std::pair<std::string_view, motion::Metric>, 4> kMetrics{
      {{"manhattan", motion::Metric::manhattan},
       {"chebyshev", motion::Metric::chebyshev},
       {"euclidean", motion::Metric::euclidean},
       {"time", motion::Metric::time}}};
  static constexpr std::array<std::pair<std::string_view, motion::Tour>, 2> kTours{
      {{"open", motion::Tour::open}, {"closed", motion::Tour::closed}}};
  static constexpr std::array<std::pair<std::string_view, bool>, 2> kStarts{
      {{"stage", true}, {"free", false}}};
  motion::PathTask task;
  task.metric = print.choice("metric", "manhattan", kMetrics);
  task.tour = print.choice("tour", "open", kTours);
  const bool from_stage = print.choice("begin", "stage", kStarts);
  if (from_stage) task.start = {job.start_mm.x(), job.start_mm.y()};
  task.times = {job.stage.axes[0].limits, job.stage.axes[1].limits, job.settle_s};
  const double nowhere = std::numeric_limits<double>::quiet_NaN();
  const double x_mm = print.number("end_x_mm", nowhere, 0.0, 200.0);
  const double y_mm = print.number("end_y_mm", nowhere, 0.0, 200.0);
  if (std::isnan(x_mm) != std::isnan(y_mm))
    print.fail(std::isnan(x_mm) ? "end_x_mm" : "end_y_mm", "nothing", "both end_x_mm and end_y_mm, or none",
               nullptr);
  if (!std::isnan(x_mm)) task.end = {x_mm, y_mm};
  if (task.end && task.tour == motion::Tour::closed)
    print.fail("end_x_mm", "an end", "none for a closed tour, which returns to where it began", nullptr);
  return task;
}

// [stage]: what drives it, and how it moves.
void read_stage(Section& stage, JobDescription& parsed, const std::filesystem::path& folder) {
  tb::PrintJob& job = parsed.job;
  job.start_mm = {stage.number("start_x_mm", 0.0, 0.0, 200.0), stage.number("start_y_mm", 0.0, 0.0, 200.0),
                  0.0};
  job.drive.homed = !stage.flag("homing", false);
  job.power_on_mm = {stage.number("power_on_x_mm", job.start_mm.x(), 0.0, 200.0),
                     stage.number("power_on_y_mm", job.start_mm.y(), 0.0, 200.0), 0.0};
  const double speed = stage.number("speed_mm_s", 100.0, 0.1, 400.0);
  const double acceleration = stage.number("acceleration_mm_s2", 1000.0, 1.0, 20000.0);
  const double jerk = stage.number("jerk_mm_s3", 50000.0, 10.0, 1e7);
  for (motion::AxisConfig& axis : job.stage.axes) {
    axis.limits = motion::asymmetric_limits(speed, acceleration, acceleration, jerk, jerk);
    // Half a turn above the home switch, as the coupling of a machine is set.
    axis.index_mm = axis.travel.min_mm + 0.5 * axis.lead_mm;
  }
  job.stage.clock_hz = spec::kClkHz;

  const motion::ModeBand band{
      {stage.number("mode_hz", 38.0, 1.0, 1000.0), stage.number("mode_damping", 0.05, 0.0, 0.99)},
      stage.number("mode_spread", 0.1, 0.0, 0.5)};
  const double tolerance_mm = 1e-3 * stage.number("quiet_tolerance_um", 1.0, 0.01, 1000.0);
  if (stage.flag("quiet", false)) job.stage.quiet = motion::QuietMoves{band, tolerance_mm};

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
    } catch (const motion::MotionError& error) {
      throw UserError(error.what());
    }
  }
}

// [alignment]: the board's marks, in the frame of the bumps' file and placed with them.
tb::BoardAlignment read_alignment(Section& alignment, JobDescription& parsed,
                                  const std::filesystem::path& folder, motion::CoordinateOptions placed,
                                  std::uint64_t seed) {
  constexpr double kDegree_rad = std::numbers::pi / 180.0;
  static constexpr std::array<std::pair<std::string_view, tb::StageKnowledge>, 2> kKnowledge{
      {{"calibrated", tb::StageKnowledge::calibrated}, {"nominal", tb::StageKnowledge::nominal}}};
  tb::BoardAlignment board;
  board.seed = seed;
  const std::string file = alignment.text("marks", "");
  if (file.empty())
    alignment.fail("marks", "nothing", "the name of a file with the board's marks, such as fiducials.csv",
                   alignment.table());
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
  for (const motion::Point& mark : motion::read_coordinates(folder / file, placed))
    board.marks_mm.emplace_back(mark.x_mm, mark.y_mm);
  if (board.marks_mm.size() < 2)
    throw UserError(
        fmt::format("{}: found 1 mark, expected at least 2 to align a board by", (folder / file).string()));
  if (board.missing_mark && *board.missing_mark >= board.marks_mm.size())
    alignment.fail("missing_mark", fmt::format("{}", missing),
                   fmt::format("0 (none) to {}, the marks of {}", board.marks_mm.size(), file),
                   alignment.table()->get("missing_mark"));
  return board;
}

}  // namespace

JobDescription parse_job(const std::filesystem::path& path) {
  const toml::table root = parse(path);
  const auto section = [&](const char* name) {
    const toml::node* node = root.get(name);
    if (node != nullptr && !node->is_table()) {
      throw UserError(fmt::format("{}:{}: {}: expected a section [{}]", path.string(),
                                  node->source().begin.line, name, name));
    }
    return Section(path, node != nullptr ? node->as_table() : nullptr, name);
  };
  for (const auto& [key, node] : root) {
    static const std::set<std::string_view> known{"job",   "coordinates", "head", "temperature", "registers",
                                                  "print", "stage",       "rtl",  "event",       "alignment"};
    if (!known.contains(key.str())) {
      throw UserError(fmt::format(
          "{}:{}: [{}]: unknown section, expected one of: job, coordinates, head, temperature, registers, "
          "print, stage, alignment, rtl, event",
          path.string(), node.source().begin.line, shown(key.str())));
    }
  }

  JobDescription parsed;
  parsed.file = path;
  tb::PrintJob& job = parsed.job;

  Section general = section("job");
  job.name = general.text("name", escaped(path.stem().string()));
  job.head.seed = static_cast<std::uint64_t>(general.integer("seed", 1, 0, INT64_MAX));
  general.finish();

  Section head = section("head");
  const std::string plant = head.text("plant", "PH-1");
  try {
    job.head.plant = tb::plant_config(plant);
  } catch (const std::invalid_argument& error) {
    throw UserError(fmt::format("{}: head.plant: {}", path.string(), error.what()));
  }
  job.head.sensor = head.text("sensor", "MAX31855");
  const std::uint16_t sensor = sensor_code(job.head.sensor);
  if (sensor == 0) {
    throw UserError(fmt::format(
        "{}: head.sensor: found \"{}\", expected one of: MAX31855, MAX6675, MAX31865, ADT7320, ADT7310, LM70",
        path.string(), job.head.sensor));
  }
  job.head.sensor_noise_degc = head.number("sensor_noise_degc", 0.05, 0.0, 5.0);
  job.head.plant.ambient_degc = head.number("ambient_degc", 25.0, -20.0, 80.0);
  head.finish();

  Section temperature = section("temperature");
  const double setpoint = temperature.number("setpoint_degc", 110.0, 0.0, 500.0);
  const double window = temperature.number("window_degc", 1.0, 0.1, 100.0);
  const double dwell = temperature.number("dwell_s", 3.0, 0.0, 600.0);
  job.heat_timeout_s = temperature.number("timeout_s", 600.0, 1.0, 7200.0);
  const double period_ms =
      temperature.number("period_ms", spec::kSensorPresets[sensor].min_ts_ms, 10.0, 2000.0);
  temperature.finish();

  job.registers = tuned(job.head.plant, period_ms / 1000.0);
  set_register(job.registers, spec::kRegSetpoint, static_cast<std::uint16_t>(std::lround(setpoint * 10.0)));
  set_register(job.registers, spec::kRegTMax,
               static_cast<std::uint16_t>(std::lround(std::min(setpoint + 40.0, 500.0) * 10.0)));
  set_register(job.registers, spec::kRegTAmb,
               static_cast<std::uint16_t>(std::lround(job.head.plant.ambient_degc * 10.0)));
  set_register(job.registers, spec::kRegAtWindow, static_cast<std::uint16_t>(std::lround(window * 10.0)));
  set_register(job.registers, spec::kRegAtDwell, static_cast<std::uint16_t>(std::lround(dwell * 10.0)));
  set_register(job.registers, spec::kRegTs, static_cast<std::uint16_t>(std::lround(period_ms)));
  set_register(job.registers, spec::kRegSensType, sensor);
  Section registers = section("registers");
  read_registers(registers, job.registers);
  registers.finish();
  for (const spec::Reg bus : {spec::kRegAddress, spec::kRegBaud, spec::kRegFormat}) {
    for (const tb::RegisterValue& r : job.registers) {
      if (r.reg == bus) {
        throw UserError(fmt::format(
            "{}: registers.{}: the printer's host talks at the reset address, baud rate and format; "
            "leave it out",
            path.string(), spec::kHolding[bus].name));
      }
    }
  }

  Section stage = section("stage");
  read_stage(stage, parsed, path.parent_path());
  stage.finish();

  Section coordinates = section("coordinates");
  const std::string file = coordinates.text("file", "");
  if (file.empty())
    throw UserError(fmt::format(
        "{}: coordinates.file: missing, expected the name of a file with bumps, such as bumps.csv",
        path.string()));
  motion::CoordinateOptions options;
  options.pitch_mm = coordinates.number("pitch_mm", 1.0, 1e-6, 1e6);
  options.origin_x_mm = coordinates.number("origin_x_mm", 0.0, -1e6, 1e6);
  options.origin_y_mm = coordinates.number("origin_y_mm", 0.0, -1e6, 1e6);
  options.rotation_deg = coordinates.number("rotation_deg", 0.0, -360.0, 360.0);
  options.mirror_x = coordinates.flag("mirror_x", false);
  coordinates.finish();
  parsed.coordinates = path.parent_path() / file;
  parsed.inputs.insert(parsed.inputs.end(), {path, parsed.coordinates});

  Section print = section("print");
  job.droplet_j = print.number("droplet_j", 0.0, 0.0, 10.0);
  job.settle_s = print.number("settle_ms", 15.0, 0.0, 10000.0) / 1000.0;
  parsed.task = path_task(print, job);
  parsed.plan_metric = print.text("metric", "manhattan");
  static constexpr std::array<std::pair<std::string_view, bool>, 2> kModes{
      {{"stop", false}, {"fly-by", true}}};
  const bool on_the_fly = print.choice("mode", "stop", kModes);
  motion::FlyByConfig fly_by;
  fly_by.x = job.stage.axes[0].limits;
  fly_by.y = job.stage.axes[1].limits;
  fly_by.droplets_per_s = print.number("droplets_per_s", 200.0, 0.1, 10000.0);
  fly_by.latency_s = 1e-6 * print.number("latency_us", 50.0, 0.0, 10000.0);
  fly_by.flight_s = 1e-6 * print.number("flight_us", 500.0, 0.0, 100000.0);
  fly_by.encoder_mm = job.drive.axes[0].encoder_mm;
  fly_by.settle_s = job.settle_s;
  if (on_the_fly) parsed.fly_by = fly_by;
  print.finish();

  Section rtl = section("rtl");
  static constexpr std::array<std::pair<std::string_view, tb::RtlWindows>, 3> kRtl{
      {{"chosen", tb::RtlWindows::chosen}, {"full", tb::RtlWindows::full}, {"none", tb::RtlWindows::none}}};
  job.rtl = rtl.choice("windows", "chosen", kRtl);
  rtl.finish();

  if (const toml::node* events = root.get("event"); events != nullptr) {
    if (!events->is_array_of_tables())
      throw UserError(fmt::format("{}: event: expected sections [[event]]", path.string()));
    for (const toml::node& node : *events->as_array()) {
      Section event(path, node.as_table(), "event");
      const double at = event.number("at_s", -1.0, 0.0, 1e6);
      if (at < 0.0) event.fail("at_s", "nothing", "a time in seconds", &node);
      job.events.push_back({at, event_kind(event)});
      event.finish();
    }
    std::stable_sort(job.events.begin(), job.events.end(), [](auto& a, auto& b) { return a.at_s < b.at_s; });
  }

  Section alignment = section("alignment");
  try {
    parsed.bumps_in_file_order = motion::read_coordinates(parsed.coordinates, options);
    if (alignment.present())
      parsed.alignment = read_alignment(alignment, parsed, path.parent_path(), options, job.head.seed);
  } catch (const motion::CoordinateError& error) {
    throw UserError(error.what());
  }
  return parsed;
}

}  // namespace meltstage::app
