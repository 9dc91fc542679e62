// SPDX-License-Identifier: Apache-2.0
// `meltstage report`: what prints left behind, side by side, as Markdown for a pull request.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/json_output.hpp"
#include "app/print/report/report.hpp"
#include "app/verbs.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostSummaryBytes = std::size_t{64} << 20;

struct Figure {
  std::string what, unit;
  std::vector<std::optional<double>> values;  // one a print; nothing where the print has none
};

struct Print {
  std::string folder, job, date, verdict;
  bool good;
};

struct Comparison {
  std::vector<Print> prints;
  std::vector<Figure> figures;  // in the order in which the prints have them
};

Json read_summary(const fs::path& folder) {
  const fs::path file = fs::is_directory(folder) ? folder / "summary.json" : folder;
  const std::string text = read_file(file, "the summary.json of a print", kMostSummaryBytes);
  if (!is_summary(text))
    throw UserError(
        fmt::format("{}: found no summary of a print, expected what `meltstage print` writes; "
                    "name the folder of a print",
                    file.string()));
  return Json::parse(text);
}

double number_of(const Json& value) {
  if (!value.is_number()) throw Json::type_error::create(302, "no number", &value);
  return value;
}

void take_figures(const Json& summary, std::size_t print, std::vector<Figure>& figures) {
  for (const Json& entry : summary.at("key_figures")) {
    const std::string what = entry.at("what"), unit = entry.at("unit");
    auto figure = std::find_if(figures.begin(), figures.end(),
                               [&](const Figure& f) { return f.what == what && f.unit == unit; });
    if (figure == figures.end()) figure = figures.insert(figures.end(), {what, unit, {}});
    figure->values.resize(print);
    const Json& value = entry.at("value");
    figure->values.push_back(value.is_null() ? std::nullopt : std::optional(number_of(value)));
  }
}

Comparison compare(const std::vector<fs::path>& folders) {
  Comparison comparison;
  for (const fs::path& folder : folders) {
    try {
      const Json summary = read_summary(folder);
      take_figures(summary, comparison.prints.size(), comparison.figures);
      comparison.prints.push_back({folder.string(), summary.at("job"), summary.at("date"),
                                   summary.at("verdict"), summary.at("good")});
    } catch (const Json::exception&) {
      throw UserError(
          fmt::format("{}: found a summary with other fields, expected schema {}; print the job again",
                      folder.string(), kSummarySchema));
    }
  }
  for (Figure& figure : comparison.figures) figure.values.resize(comparison.prints.size());
  return comparison;
}

// Text in Markdown: its own marks stand for themselves.
std::string cell(const std::string& text) {
  std::string plain;
  for (const char c : escaped(text)) {
    if (std::string_view("|`*_<[").find(c) != std::string_view::npos) plain += '\\';
    plain += c;
  }
  return plain;
}

std::string value_text(const std::optional<double>& value) {
  if (!value) return "-";
  return std::abs(*value) < 1e15 && *value == std::round(*value) ? fmt::format("{:.0f}", *value)
                                                                 : fmt::format("{:.4g}", *value);
}

// Beside the first print's: "25.5 (+1.2 %)". Less than that shows is no difference.
std::string beside(const std::optional<double>& first, const std::optional<double>& value) {
  const std::string text = value_text(value);
  if (!first || !value || text == value_text(first)) return text;
  if (*first == 0.0) return text + " (was 0)";
  constexpr double kMost_percent = 1000.0;
  const double change_percent = 100.0 * (*value - *first) / std::abs(*first);
  if (!(std::abs(change_percent) < kMost_percent)) return fmt::format("{} (x {:.3g})", text, *value / *first);
  return fmt::format("{} ({:+.1f} %)", text, change_percent);
}

void tell(const Comparison& comparison) {
  for (std::size_t i = 0; i < comparison.prints.size(); ++i) {
    const Print& print = comparison.prints[i];
    fmt::print("{}. {}: {} of {}: {}\n", i + 1, cell(print.folder), print.good ? "good" : "**not good**",
               escaped(print.date), escaped(print.verdict));
  }
  std::string head = "\n| |", rule = "|---|";
  for (std::size_t i = 0; i < comparison.prints.size(); ++i) {
    head += fmt::format(" {}. {} |", i + 1, cell(comparison.prints[i].job));
    rule += "---:|";
  }
  fmt::print("{} |\n{}---|\n", head, rule);
  for (const Figure& figure : comparison.figures) {
    std::string line = fmt::format("| {} |", cell(figure.what));
    for (const auto& value : figure.values) line += fmt::format(" {} |", beside(figure.values[0], value));
    fmt::print("{} {} |\n", line, cell(figure.unit));
  }
}

void tell_json(const Comparison& comparison) {
  Json prints = Json::array(), figures = Json::array();
  for (const Print& print : comparison.prints)
    prints.push_back({{"folder", print.folder},
                      {"job", print.job},
                      {"date", print.date},
                      {"good", print.good},
                      {"verdict", print.verdict}});
  for (const Figure& figure : comparison.figures) {
    Json values = Json::array();
    for (const auto& value : figure.values) values.push_back(value ? Json(*value) : Json(nullptr));
    figures.push_back({{"what", figure.what}, {"unit", figure.unit}, {"values", values}});
  }
  print_json({{"prints", prints}, {"figures", figures}});
}

}  // namespace

Action add_report_command(CLI::App& cli, const std::string&) {
  struct Settings {
    std::vector<fs::path> folders;
    bool json = false;
  };
  const auto s = std::make_shared<Settings>();
  CLI::App* command =
      cli.add_subcommand("report", "Key figures of prints side by side, as Markdown (docs/print/report.md)");
  show_example(command, "report out/first out/second");
  command->add_option("DIRS", s->folders, "Folders of prints; the first is what the others are compared with")
      ->required();
  command->add_flag("--json", s->json, kJsonHelp);
  return [s] {
    const Comparison comparison = compare(s->folders);
    s->json ? tell_json(comparison) : tell(comparison);
    return std::all_of(comparison.prints.begin(), comparison.prints.end(),
                       [](const Print& print) { return print.good; })
               ? 0
               : 1;
  };
}

}  // namespace meltstage::app
