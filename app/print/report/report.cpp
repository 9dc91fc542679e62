// SPDX-License-Identifier: Apache-2.0
#include "app/print/report/report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

#include "app/print/report/decimate.hpp"
#include "base/output_file.hpp"
#include "page_parts.hpp"

namespace meltstage::app {
namespace {

using Json = nlohmann::ordered_json;

/// Texts come from files of the user: bytes that are no UTF-8 become U+FFFD instead of an exception.
std::string dump(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

Json named_texts(const std::vector<NamedText>& rows) {
  Json list = Json::array();
  for (const auto& row : rows) list.push_back({{"name", row.name}, {"text", row.text}});
  return list;
}

Json lockstep_windows(const std::vector<LockstepWindow>& windows) {
  Json list = Json::array();
  for (const auto& w : windows)
    list.push_back({{"name", w.name},
                    {"first_cycle", w.first_cycle},
                    {"last_cycle", w.last_cycle},
                    {"clocks", w.clocks},
                    {"flops_per_clock", w.flops_per_clock},
                    {"comparisons", w.comparisons},
                    {"mismatches", w.mismatches}});
  return list;
}

Json window_check(const std::optional<WindowCheck>& check) {
  if (!check) return nullptr;
  Json list = Json::array();
  for (const CheckedWindow& w : check->windows)
    list.push_back({{"first_cycle", w.first_cycle},
                    {"last_cycle", w.last_cycle},
                    {"verdict", w.verdict},
                    {"start_state", w.start_state},
                    {"end_state", w.end_state}});
  return {{"whole", check->whole},           {"windows", check->windows.size()},
          {"equal", check->equal},           {"cycles", check->cycles},
          {"clocks", check->clocks},         {"flop_values", check->flop_values},
          {"pin_values", check->pin_values}, {"clock_hz", check->clock_hz},
          {"faults", check->faults},         {"lost_workers", check->lost_workers},
          {"workers", check->workers},       {"wall_s", check->wall_s},
          {"list", std::move(list)}};
}

/// What page and summary have in common.
Json summary(const PrintReport& report) {
  Json figures = Json::array();
  for (const auto& f : report.key_figures)
    figures.push_back({{"what", f.what}, {"value", f.value}, {"unit", f.unit}});
  Json phases = Json::array();
  for (const auto& p : report.phases)
    phases.push_back({{"name", p.name}, {"begin_s", p.begin_s}, {"end_s", p.end_s}});
  Json faults = Json::array();
  for (const auto& f : report.faults) faults.push_back({{"t_s", f.t_s}, {"sentence", f.sentence}});
  return {{"schema", kSummarySchema},
          {"job", report.job},
          {"date", report.date},
          {"good", report.good},
          {"verdict", report.verdict},
          {"key_figures", figures},
          {"phases", phases},
          {"path",
           {{"points", report.path_after.points.size()},
            {"unit", report.path_unit},
            {"cost_before", report.path_before.cost},
            {"cost_after", report.path_after.cost},
            {"lower_bound", report.path_bound}}},
          {"lockstep", lockstep_windows(report.lockstep)},
          {"windows", window_check(report.windows)},
          {"faults", faults},
          {"settings", named_texts(report.settings)},
          {"versions", named_texts(report.versions)}};
}

/// Six significant digits: finer than a screen, and pages stay small.
double drawn(double value) {
  if (value == 0.0 || !std::isfinite(value)) return value;
  const double scale = std::pow(10.0, 5.0 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

Json column(const std::vector<double>& values, const std::vector<std::size_t>& kept) {
  Json list = Json::array();
  for (std::size_t i : kept) list.push_back(drawn(values[i]));
  return list;
}

/// The field `member` of every sample.
template <typename Sample>
std::vector<double> channel(const std::vector<Sample>& samples, double Sample::*member) {
  std::vector<double> values(samples.size());
  std::transform(samples.begin(), samples.end(), values.begin(),
                 [member](const Sample& s) { return s.*member; });
  return values;
}

Json temperature_curves(const std::vector<TemperatureSample>& samples) {
  const std::array channels{channel(samples, &TemperatureSample::reading_degc),
                            channel(samples, &TemperatureSample::heater_degc),
                            channel(samples, &TemperatureSample::setpoint_degc)};
  const auto kept = decimate(channels, kMaxCurvePoints);
  return {{"t_s", column(channel(samples, &TemperatureSample::t_s), kept)},
          {"reading_degc", column(channels[0], kept)},
          {"heater_degc", column(channels[1], kept)},
          {"setpoint_degc", column(channels[2], kept)}};
}

Json duty_curve(const std::vector<DutySample>& samples) {
  const std::array channels{channel(samples, &DutySample::duty)};
  const auto kept = decimate(channels, kMaxCurvePoints);
  return {{"t_s", column(channel(samples, &DutySample::t_s), kept)}, {"duty", column(channels[0], kept)}};
}

Json drawn_path(const Path& path) {
  Json x = Json::array(), y = Json::array();
  const std::size_t count = std::min(path.points.size(), kMaxPathPoints);
  for (std::size_t i = 0; i < count; ++i) {
    x.push_back(drawn(path.points[i].x_mm));
    y.push_back(drawn(path.points[i].y_mm));
  }
  return {{"x_mm", x}, {"y_mm", y}, {"points", path.points.size()}, {"cost", path.cost}};
}

/// Of the bumps that the page draws.
Json drawn_droplets(const PrintReport& report) {
  Json bump = Json::array(), t = Json::array(), x = Json::array(), y = Json::array();
  for (const Droplet& droplet : report.droplets) {
    if (droplet.bump >= kMaxPathPoints) continue;
    bump.push_back(droplet.bump);
    t.push_back(drawn(droplet.t_s));
    x.push_back(drawn(droplet.miss_x_um));
    y.push_back(drawn(droplet.miss_y_um));
  }
  return {{"bump", bump}, {"t_s", t}, {"miss_x_um", x}, {"miss_y_um", y}, {"good_um", report.good_miss_um}};
}

Json page_data(const PrintReport& report) {
  Json data = summary(report);
  data["temperature"] = temperature_curves(report.temperature);
  data["duty"] = duty_curve(report.duty);
  data["path_before"] = drawn_path(report.path_before);
  data["path_after"] = drawn_path(report.path_after);
  data["droplets"] = drawn_droplets(report);
  return data;
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

/// JSON inside a <script> element: a "<" of a text (JSON has it nowhere else) could end the element.
std::string script_safe(std::string json) {
  replace_all(json, "<", "\\u003c");
  return json;
}

std::string html_text(std::string text) {
  replace_all(text, "&", "&amp;");
  replace_all(text, "<", "&lt;");
  return text;
}

/// `html` with each {{name}} replaced once; what is put in isn't looked at again.
std::string fill(std::string_view html, const std::map<std::string_view, std::string>& parts) {
  std::string page;
  for (std::size_t at = 0; at < html.size();) {
    const std::size_t open = std::min(html.find("{{", at), html.size());
    page += html.substr(at, open - at);
    if (open == html.size()) break;
    const std::size_t close = html.find("}}", open);
    page += parts.at(html.substr(open + 2, close - open - 2));
    at = close + 2;
  }
  return page;
}

}  // namespace

std::string render_report(const PrintReport& report) {
  return fill(page_parts::kHtml, {{"title", html_text(report.job)},
                                  {"verdict", html_text(report.verdict)},
                                  {"style", std::string(page_parts::kStyle)},
                                  {"data", script_safe(dump(page_data(report), -1))},
                                  {"chart_js", std::string(page_parts::kChartJs)},
                                  {"script", std::string(page_parts::kScript)}});
}

bool is_summary(std::string_view text) {
  const Json summary = Json::parse(text, nullptr, false);
  if (!summary.is_object()) return false;
  const auto has = [&](const char* field, auto is) {
    return summary.contains(field) && (summary.at(field).*is)();
  };
  return has("schema", &Json::is_number_integer) && has("job", &Json::is_string) &&
         has("verdict", &Json::is_string) && has("key_figures", &Json::is_array) &&
         has("lockstep", &Json::is_array);
}

std::string summary_json(const PrintReport& report) { return dump(summary(report), 2) + "\n"; }

void write_report(const std::filesystem::path& path, const PrintReport& report) {
  OutputFile file(path);
  file.write(render_report(report));
  file.publish();
}

}  // namespace meltstage::app
