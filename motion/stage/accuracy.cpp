// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/accuracy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <tuple>

#include "base/file.hpp"
#include "base/number.hpp"
#include "base/place.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion {
namespace {

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Estimator of the standard deviation with n - 1.
double deviation_of(std::span<const double> values) {
  const double mean = mean_of(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

void check_targets(std::span<const TargetDeviations> targets) {
  if (targets.size() < 2)
    throw MotionError(
        fmt::format("accuracy: found {} target positions, expected at least 2", targets.size()));
  std::vector<double> positions;
  for (const TargetDeviations& target : targets) {
    if (target.forward_um.size() < 2 || target.reverse_um.size() < 2)
      throw MotionError(
          fmt::format("accuracy: found {} forward and {} reverse approaches at {} mm, expected at least 2 of "
                      "each (ISO 230-2: 5)",
                      target.forward_um.size(), target.reverse_um.size(), target.target_mm));
    for (const auto* runs : {&target.forward_um, &target.reverse_um})
      for (const double value : *runs)
        if (!std::isfinite(value) || !std::isfinite(target.target_mm))
          throw MotionError(fmt::format("accuracy: found deviation {} um at {} mm, expected finite numbers",
                                        value, target.target_mm));
    positions.push_back(target.target_mm);
  }
  std::sort(positions.begin(), positions.end());
  if (const auto twice = std::adjacent_find(positions.begin(), positions.end()); twice != positions.end())
    throw MotionError(fmt::format("accuracy: found {} mm twice, expected each target position once", *twice));
}

PositionAccuracy at_position(const TargetDeviations& target) {
  PositionAccuracy at;
  at.target_mm = target.target_mm;
  at.mean_forward_um = mean_of(target.forward_um);
  at.mean_reverse_um = mean_of(target.reverse_um);
  at.mean_um = 0.5 * (at.mean_forward_um + at.mean_reverse_um);
  at.reversal_um = at.mean_forward_um - at.mean_reverse_um;
  at.deviation_forward_um = deviation_of(target.forward_um);
  at.deviation_reverse_um = deviation_of(target.reverse_um);
  at.repeatability_forward_um = 4.0 * at.deviation_forward_um;
  at.repeatability_reverse_um = 4.0 * at.deviation_reverse_um;
  at.repeatability_um =
      std::max({2.0 * (at.deviation_forward_um + at.deviation_reverse_um) + std::abs(at.reversal_um),
                at.repeatability_forward_um, at.repeatability_reverse_um});
  return at;
}

/// A band that grows with every value put into it.
struct Band {
  double low = INFINITY, high = -INFINITY;
  void add(double value, double margin = 0.0) {
    low = std::min(low, value - margin);
    high = std::max(high, value + margin);
  }
  void add(const Band& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
  }
  double width() const { return high - low; }
};

double interpolated(const std::vector<double>& at, const std::vector<double>& values, double position) {
  if (at.empty()) return 0.0;
  const auto above = std::upper_bound(at.begin(), at.end(), position);
  if (above == at.begin()) return values.front();
  if (above == at.end()) return values.back();
  const auto i = static_cast<std::size_t>(above - at.begin());
  const double share = (position - at[i - 1]) / (at[i] - at[i - 1]);
  return values[i - 1] + share * (values[i] - values[i - 1]);
}

constexpr double kSteepest = 0.1;  // change of deviation a way

/// The command c with c + deviation(c) = target. Each round gains the slope of the deviations, 1e-3 at most
/// on a screw and kSteepest on whatever is taken for one.
double solve_command(const std::vector<double>& at, const std::vector<double>& deviation, double target_mm) {
  constexpr int kRounds = 12;
  double command_mm = target_mm;
  for (int round = 0; round < kRounds; ++round)
    command_mm = target_mm - interpolated(at, deviation, command_mm);
  return command_mm;
}

/// Fields of a row without blanks around them, and where they stand.
struct Fields {
  std::string_view name;
  std::size_t line = 0;
  std::array<std::string_view, 3> texts;
  std::array<std::size_t, 3> columns{};
  std::string place(std::size_t field) const { return fmt::format("{}:{}:{}", name, line, columns[field]); }
};

std::optional<Fields> fields_of(std::string_view name, const detail::Line& line) {
  const std::size_t first = line.text.find(','), second = line.text.find(',', first + 1);
  if (first == std::string_view::npos || second == std::string_view::npos ||
      line.text.find(',', second + 1) != std::string_view::npos)
    return std::nullopt;
  Fields fields{name, line.number, {}, {}};
  const std::array<std::size_t, 4> starts = {0, first + 1, second + 1, line.text.size() + 1};
  for (std::size_t i = 0; i < fields.texts.size(); ++i) {
    const std::string_view field = line.text.substr(starts[i], starts[i + 1] - starts[i] - 1);
    fields.texts[i] = detail::trimmed(field);
    const std::size_t blanks = field.find_first_not_of(" \t");
    fields.columns[i] = starts[i] + (blanks == std::string_view::npos ? 0 : blanks) + 1;
  }
  return fields;
}

double parse(std::string_view text, const std::string& where, std::string_view what, double largest) {
  const auto value = number_in(text, -largest, largest);
  if (!value)
    throw MotionError(fmt::format("{}: found {} \"{}\", expected a finite number from {:g} to {:g}", where,
                                  what, shown(text), -largest, largest));
  return *value;
}

/// The interferometer on a simulated axis, which it moves from target to target.
class Bench {
 public:
  Bench(const AxisModelConfig& axis, const AccuracyTest& test, const InterferometerConfig& instrument,
        const CompensationTable& table)
      : test_(test),
        instrument_(instrument),
        table_(table),
        axis_(axis, test.target_mm.front() - test.overrun_mm),
        command_mm_(test.target_mm.front() - test.overrun_mm),
        random_(instrument.seed) {}

  void go_forward(double target_mm) { go(compensated_forward_mm(table_, target_mm)); }
  void go_reverse(double target_mm) { go(compensated_reverse_mm(table_, target_mm)); }

  /// Mean of the readings at the end of the dwell, minus the target.
  double deviation_um(double target_mm, double stop_um) {
    const double cycle_s = axis_.config().servo.cycle_s;
    hold(instrument_.dwell_s - instrument_.averaging_s);
    double sum_um = 0.0;
    const int readings = std::max(1, static_cast<int>(std::lround(instrument_.averaging_s / cycle_s)));
    for (int i = 0; i < readings; ++i) {
      hold(cycle_s);
      const double reading_um = (axis_.load_mm() - target_mm) * 1e3 + noise(instrument_.noise_um);
      sum_um += std::round(reading_um / instrument_.resolution_um) * instrument_.resolution_um;
    }
    return sum_um / readings + noise(stop_um);
  }

 private:
  double noise(double sigma) { return sigma == 0.0 ? 0.0 : sigma * normal_(random_); }

  void hold(double time_s) {
    const auto cycles = std::lround(time_s / axis_.config().servo.cycle_s);
    for (long i = 0; i < cycles; ++i) axis_.step({command_mm_, 0.0, 0.0, 0.0});
  }

  void go(double command_mm) {
    const double sign = command_mm < command_mm_ ? -1.0 : 1.0, cycle_s = axis_.config().servo.cycle_s;
    const Scurve curve = plan_scurve(test_.limits, std::abs(command_mm - command_mm_));
    const auto cycles = static_cast<int>(std::ceil(curve.duration_s / cycle_s));
    for (int i = 0; i < cycles; ++i) {
      const MotionState along = curve.sample(i * cycle_s);
      axis_.step({command_mm_ + sign * along.position_mm, sign * along.velocity_mm_s,
                  sign * along.acceleration_mm_s2, 0.0});
    }
    command_mm_ = command_mm;
  }

  const AccuracyTest& test_;
  const InterferometerConfig& instrument_;
  const CompensationTable& table_;
  AxisModel axis_;
  double command_mm_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace

AxisAccuracy evaluate_accuracy(std::span<const TargetDeviations> targets) {
  check_targets(targets);
  AxisAccuracy axis;
  for (const TargetDeviations& target : targets) axis.positions.push_back(at_position(target));
  std::sort(axis.positions.begin(), axis.positions.end(),
            [](const PositionAccuracy& a, const PositionAccuracy& b) { return a.target_mm < b.target_mm; });
  Band forward, reverse, both, mean, forward_2s, reverse_2s, both_2s;
  for (const PositionAccuracy& at : axis.positions) {
    axis.reversal_um = std::max(axis.reversal_um, std::abs(at.reversal_um));
    axis.mean_reversal_um += at.reversal_um / static_cast<double>(axis.positions.size());
    axis.repeatability_forward_um = std::max(axis.repeatability_forward_um, at.repeatability_forward_um);
    axis.repeatability_reverse_um = std::max(axis.repeatability_reverse_um, at.repeatability_reverse_um);
    axis.repeatability_um = std::max(axis.repeatability_um, at.repeatability_um);
    forward.add(at.mean_forward_um);
    reverse.add(at.mean_reverse_um);
    mean.add(at.mean_um);
    forward_2s.add(at.mean_forward_um, 2.0 * at.deviation_forward_um);
    reverse_2s.add(at.mean_reverse_um, 2.0 * at.deviation_reverse_um);
  }
  for (const Band& band : {forward, reverse}) both.add(band);
  for (const Band& band : {forward_2s, reverse_2s}) both_2s.add(band);
  axis.systematic_forward_um = forward.width();
  axis.systematic_reverse_um = reverse.width();
  axis.systematic_um = both.width();
  axis.mean_systematic_um = mean.width();
  axis.accuracy_forward_um = forward_2s.width();
  axis.accuracy_reverse_um = reverse_2s.width();
  axis.accuracy_um = both_2s.width();
  return axis;
}

ResidualBacklash residual_backlash(std::span<const TargetDeviations> targets) {
  const AxisAccuracy axis = evaluate_accuracy(targets);
  // With the mean course taken off, the residuals of a target are +-B_i / 2.
  std::vector<double> steps_um;
  for (const PositionAccuracy& at : axis.positions)
    steps_um.push_back((at.mean_reverse_um - at.mean_um) - (at.mean_forward_um - at.mean_um));
  return {mean_of(steps_um), deviation_of(steps_um) / std::sqrt(static_cast<double>(steps_um.size()))};
}

std::vector<TargetDeviations> read_deviations(const std::filesystem::path& path) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 26;
  return read_deviations_text(path.string(), read_file(path, "a file of deviations", kMostBytes));
}

std::vector<TargetDeviations> read_deviations_text(std::string_view name, std::string_view content) {
  constexpr double kFarthest_mm = 1e6, kLargest_um = 1e9;
  constexpr std::string_view kHeader = "target_mm,direction,deviation_um";
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  std::map<double, TargetDeviations> targets;
  bool headed = false;
  if (content.starts_with(kByteOrderMark)) content.remove_prefix(kByteOrderMark.size());
  if (!content.empty() && content.back() != '\n' && content.back() != '\r')
    throw MotionError(fmt::format(
        "{}: the file ends in the middle of its last line, expected a line end; it may be cut off", name));
  detail::for_lines(content, [&](const detail::Line& line) {
    const std::string_view text = detail::trimmed(line.text);
    if (text.empty() || text.front() == '#') return;
    const std::string place = fmt::format("{}:{}:1", name, line.number);
    if (!headed) {
      const auto names = fields_of(name, line);
      if (!names || fmt::format("{},{},{}", names->texts[0], names->texts[1], names->texts[2]) != kHeader)
        throw MotionError(
            fmt::format("{}: found header \"{}\", expected \"{}\"", place, shown(line.text), kHeader));
      headed = true;
      return;
    }
    const auto fields = fields_of(name, line);
    if (!fields)
      throw MotionError(
          fmt::format("{}: found \"{}\", expected three fields: {}", place, shown(line.text), kHeader));
    const double target_mm = parse(fields->texts[0], fields->place(0), "target_mm", kFarthest_mm);
    const std::string_view direction = fields->texts[1];
    const double deviation_um = parse(fields->texts[2], fields->place(2), "deviation_um", kLargest_um);
    if (direction != "+" && direction != "-")
      throw MotionError(fmt::format("{}: found direction \"{}\", expected + (forward) or - (reverse)",
                                    fields->place(1), shown(direction)));
    TargetDeviations& target = targets[target_mm];
    target.target_mm = target_mm;
    if (target.line == 0) target.line = line.number;
    (direction == "+" ? target.forward_um : target.reverse_um).push_back(deviation_um);
  });
  std::vector<TargetDeviations> result;
  for (auto& [position, target] : targets) result.push_back(std::move(target));
  try {
    check_targets(result);
  } catch (const MotionError& error) {
    throw MotionError(fmt::format("{}: {}", name, error.what()));
  }
  return result;
}

void require_correctable(std::string_view name, std::span<const TargetDeviations> targets,
                         const Range& travel) {
  const TargetDeviations* before = nullptr;
  for (const TargetDeviations& target : targets) {
    const std::string place = fmt::format("{}:{}:1", name, target.line);
    if (!(target.target_mm >= travel.min_mm && target.target_mm <= travel.max_mm))
      throw MotionError(fmt::format("{}: found target_mm {}, expected {} to {}, the axis' travel", place,
                                    target.target_mm, travel.min_mm, travel.max_mm));
    for (const auto runs : {&TargetDeviations::forward_um, &TargetDeviations::reverse_um}) {
      if (before == nullptr) break;
      const double way_mm = target.target_mm - before->target_mm;
      const double change_mm = 1e-3 * (mean_of(target.*runs) - mean_of(before->*runs));
      if (std::abs(change_mm) > kSteepest * way_mm)
        throw MotionError(fmt::format(
            "{}: found deviations whose mean changes by {:.6g} um over the {:.6g} mm from the "
            "target before, expected at most {:.6g} um; are they in micrometres, and of this axis?",
            place, 1e3 * change_mm, way_mm, 1e3 * kSteepest * way_mm));
    }
    before = &target;
  }
}

CompensationTable make_compensation(const AxisAccuracy& accuracy) {
  CompensationTable table;
  for (const PositionAccuracy& at : accuracy.positions) {
    table.position_mm.push_back(at.target_mm);
    table.forward_mm.push_back(at.mean_forward_um * 1e-3);
    table.reverse_mm.push_back(at.mean_reverse_um * 1e-3);
  }
  return table;
}

void check_compensation(const CompensationTable& table) {
  const auto& at = table.position_mm;
  if (table.forward_mm.size() != at.size() || table.reverse_mm.size() != at.size())
    throw MotionError(fmt::format(
        "compensation: found {} positions, {} forward and {} reverse deviations, expected as many of each",
        at.size(), table.forward_mm.size(), table.reverse_mm.size()));
  for (std::size_t i = 1; i < at.size(); ++i)
    if (!(at[i] > at[i - 1]))
      throw MotionError(fmt::format(
          "compensation: found position {} mm behind {} mm, expected ascending numbers", at[i], at[i - 1]));
  for (const auto* numbers : {&table.position_mm, &table.forward_mm, &table.reverse_mm})
    for (const double value : *numbers)
      if (!std::isfinite(value))
        throw MotionError(fmt::format("compensation: found {} mm, expected finite numbers", value));
}

double compensated_forward_mm(const CompensationTable& table, double target_mm) {
  check_compensation(table);
  return solve_command(table.position_mm, table.forward_mm, target_mm);
}

double compensated_reverse_mm(const CompensationTable& table, double target_mm) {
  check_compensation(table);
  return solve_command(table.position_mm, table.reverse_mm, target_mm);
}

std::vector<double> accuracy_targets(double from_mm, double to_mm, int count, double period_mm,
                                     std::uint64_t seed) {
  if (!(to_mm > from_mm) || count < 2 || !(period_mm >= 0.0) || period_mm > (to_mm - from_mm) / count)
    throw MotionError(
        fmt::format("accuracy targets: found {}..{} mm, {} targets, period {} mm, expected ends in order, at "
                    "least 2 targets and a period below their spacing",
                    from_mm, to_mm, count, period_mm));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> part(0.0, period_mm);
  const double spacing_mm = (to_mm - from_mm - period_mm) / (count - 1);
  std::vector<double> targets;
  for (int i = 0; i < count; ++i) targets.push_back(from_mm + i * spacing_mm + part(random));
  return targets;
}

namespace {

void check(const InterferometerConfig& instrument) {
  for (const auto& [what, value, least] : {std::tuple{"noise [um]", instrument.noise_um, 0.0},
                                           {"resolution [um]", instrument.resolution_um, 1e-9},
                                           {"stop from below [um]", instrument.stop_forward_um, 0.0},
                                           {"stop from above [um]", instrument.stop_reverse_um, 0.0},
                                           {"dwell [s]", instrument.dwell_s, 0.0},
                                           {"averaging [s]", instrument.averaging_s, 0.0}})
    if (!std::isfinite(value) || value < least)
      throw MotionError(fmt::format("interferometer: {}: found {}, expected a finite number from {:g}", what,
                                    value, least));
}

}  // namespace

std::vector<TargetDeviations> measure_axis(const AxisModelConfig& axis, const AccuracyTest& test,
                                           const InterferometerConfig& instrument,
                                           const CompensationTable& table) {
  if (test.target_mm.empty() || test.runs < 1 ||
      std::adjacent_find(test.target_mm.begin(), test.target_mm.end(), std::greater_equal<>()) !=
          test.target_mm.end())
    throw MotionError(
        fmt::format("accuracy test: found {} targets and {} runs, expected ascending targets "
                    "and at least 1 run",
                    test.target_mm.size(), test.runs));
  check(instrument);
  Bench bench(axis, test, instrument, table);
  std::vector<TargetDeviations> result(test.target_mm.size());
  const std::size_t count = result.size();
  // Down once before the first run, so that it too begins with the play taken up.
  bench.go_forward(test.target_mm.front());
  bench.go_reverse(test.target_mm.front() - test.overrun_mm);
  for (int run = 0; run < test.runs; ++run) {
    for (std::size_t i = 0; i < count; ++i) {
      bench.go_forward(test.target_mm[i]);
      result[i].target_mm = test.target_mm[i];
      result[i].forward_um.push_back(bench.deviation_um(test.target_mm[i], instrument.stop_forward_um));
    }
    bench.go_forward(test.target_mm.back() + test.overrun_mm);
    for (std::size_t i = count; i-- > 0;) {
      bench.go_reverse(test.target_mm[i]);
      result[i].reverse_um.push_back(bench.deviation_um(test.target_mm[i], instrument.stop_reverse_um));
    }
    bench.go_reverse(test.target_mm.front() - test.overrun_mm);
  }
  return result;
}

}  // namespace meltstage::motion
