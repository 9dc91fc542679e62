// SPDX-License-Identifier: Apache-2.0
#include "app/print/job_rules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

namespace meltstage::app {

namespace {

namespace spec = chip::spec;

double value_of(const tb::PrintJob& job, spec::Reg reg) {
  const spec::RegisterInfo& info = spec::kHolding[reg];
  double raw = info.reset;
  for (const tb::RegisterValue& r : job.registers)
    if (r.reg == reg) raw = info.is_signed ? static_cast<std::int16_t>(r.value) : r.value;
  return raw * info.scale;
}

// The field that a register's value comes from.
struct Field {
  const TomlSection& section;
  std::string_view key;
};

Field field_of(spec::Reg reg, const TomlSection& section, std::string_view key,
               const TomlSection& registers) {
  const std::string_view name = spec::kHolding[reg].name;
  return registers.has(name) ? Field{registers, name} : Field{section, key};
}

[[noreturn]] void refuse(const Field& field, double found, const std::string& expected) {
  field.section.fail(field.key, fmt::format("{:.6g}", found), expected);
}

void require_setpoint(const tb::PrintJob& job, const spec::SensorPreset& sensor, const RegisterSections& s) {
  constexpr double kMargin_degc = spec::kSetpointMargin * 0.1;
  constexpr double kRounding_degc = 1e-6;
  const double setpoint = value_of(job, spec::kRegSetpoint), most = value_of(job, spec::kRegTMax);
  const double measured = sensor.highest_degc;
  const Field field = field_of(spec::kRegSetpoint, s.temperature, "setpoint_degc", s.registers);
  // Above what the sensor measures no limit trips, however hot the head gets.
  if (setpoint > measured - kMargin_degc + kRounding_degc)
    refuse(
        field, setpoint,
        fmt::format("at most {:.6g}, which is {:.6g} degC below the highest temperature that the sensor {} "
                    "measures",
                    measured - kMargin_degc, kMargin_degc, sensor.name));
  if (most > measured)
    refuse({s.registers, "T_MAX"}, most,
           fmt::format("at most {:.6g}, the highest temperature that the sensor {} measures", measured,
                       sensor.name));
  if (setpoint > most - kMargin_degc + kRounding_degc) {
    if (s.registers.has("T_MAX"))
      refuse({s.registers, "T_MAX"}, most,
             fmt::format("at least {:.6g}, the set-point and {:.6g} degC", setpoint + kMargin_degc,
                         kMargin_degc));
    refuse(field, setpoint,
           fmt::format("at most {:.6g}, which is {:.6g} degC below the chip's highest T_MAX",
                       most - kMargin_degc, kMargin_degc));
  }
  const double ambient = job.head.plant.ambient_degc, window = value_of(job, spec::kRegAtWindow);
  if (setpoint + window < ambient)
    refuse(field, setpoint,
           fmt::format("at least {:.6g}: the head does not get colder than head.ambient_degc",
                       ambient - window));
  if (ambient >= most)
    refuse({s.head, "ambient_degc"}, ambient, fmt::format("less than {:.6g}, the limit T_MAX", most));
}

void require_period(const tb::PrintJob& job, const spec::SensorPreset& sensor, const RegisterSections& s) {
  const double period_ms = value_of(job, spec::kRegTs);
  if (period_ms < sensor.min_ts_ms)
    refuse(field_of(spec::kRegTs, s.temperature, "period_ms", s.registers), period_ms,
           fmt::format("at least {} ms, in which the sensor {} has a new reading", sensor.min_ts_ms,
                       sensor.name));
}

}  // namespace

void require_printable(const tb::PrintJob& job, const spec::SensorPreset& sensor, const RegisterSections& s) {
  require_setpoint(job, sensor, s);
  require_period(job, sensor, s);
  if (const double lock = value_of(job, spec::kRegLock); lock != 0.0)
    refuse({s.registers, spec::kHolding[spec::kRegLock].name}, lock,
           "0: a locked chip does not take the printer's order to heat");
}

double default_place_tolerance_mm(const std::vector<motion::Point>& bumps) {
  constexpr double kShareOfDistance = 0.25, kLeast_mm = 0.010, kMost_mm = 0.100;
  std::vector<std::pair<double, double>> by_x;
  for (const motion::Point& bump : bumps) by_x.emplace_back(bump.x_mm, bump.y_mm);
  std::sort(by_x.begin(), by_x.end());
  // Bumps no farther to the left than could matter, by y.
  std::set<std::pair<double, double>> near;
  double nearest_mm = kMost_mm / kShareOfDistance;
  std::size_t leaves = 0;
  for (const auto& [x, y] : by_x) {
    for (; x - by_x[leaves].first > nearest_mm; ++leaves)
      near.erase({by_x[leaves].second, by_x[leaves].first});
    const double least = -std::numeric_limits<double>::infinity();
    for (auto it = near.lower_bound({y - nearest_mm, least}); it != near.end() && it->first <= y + nearest_mm;
         ++it)
      nearest_mm = std::min(nearest_mm, std::hypot(x - it->second, y - it->first));
    near.insert({y, x});
  }
  return std::clamp(kShareOfDistance * nearest_mm, kLeast_mm, kMost_mm);
}

}  // namespace meltstage::app
