// SPDX-License-Identifier: Apache-2.0
#include "app/print/report/report.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

namespace meltstage::app {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

PrintReport sample() {
  PrintReport report;
  report.job = "first";
  report.date = "2026-11-21T03:00:00Z";
  report.versions = {{"meltstage", "0.1.0 (abc1234)"}};
  report.good = true;
  report.verdict = "32 bumps printed at 180 °C, RTL and model equal.";
  report.key_figures = {{"bumps", 32, ""}, {"overshoot", 0.4213, "degC"}};
  report.temperature = {{0.0, 25.0, 25.5, kNan}, {1.0, 60.25, 70.0, 180.0}, {2.0, 179.75, 190.0, 180.0}};
  report.duty = {{0.0, 0.0}, {0.5, 1.0}, {2.0, 0.25}};
  report.phases = {{"command", 0.0, 0.5}, {"heat-up", 0.5, 2.0}};
  report.path_before = {{{0.0, 0.0}, {3.0, 4.0}, {1.0, 0.0}}, 13.0};
  report.path_after = {{{0.0, 0.0}, {1.0, 0.0}, {3.0, 4.0}}, 7.0};
  report.path_bound = 6.5;
  report.lockstep = {{"command", 0, 999, 1000, 1234, 1'250'000, 0}};
  report.faults = {{1.5, "sensor open"}};
  report.settings = {{"set-point", "180 °C"}};
  return report;
}

/// The data that the page's script reads.
json page_data(const std::string& page) {
  const std::string open = R"(<script type="application/json" id="data">)";
  const std::size_t begin = page.find(open);
  if (begin == std::string::npos) throw std::runtime_error("the page holds no data element");
  const std::size_t end = page.find("</script>", begin);
  return json::parse(page.substr(begin + open.size(), end - begin - open.size()));
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

std::string file_text(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

TEST(ReportPage, RefersToNothingOutsideItself) {
  const std::string page = render_report(sample());
  EXPECT_FALSE(std::regex_search(page, std::regex(R"re(<(link|img|iframe|object|embed|base)\b)re")));
  EXPECT_FALSE(std::regex_search(page, std::regex(R"re(<[a-z]+[^<>]*\s(src|href)\s*=)re")));
  EXPECT_THAT(page, Not(HasSubstr("@import")));
  EXPECT_THAT(page, Not(HasSubstr("url(")));
}

TEST(ReportPage, HoldsEveryPartOnce) {
  const std::string page = render_report(sample());
  EXPECT_EQ(count(page, "Chart.js v"), 1u);
  EXPECT_EQ(count(page, "const equalAspect"), 1u);
  EXPECT_EQ(count(page, "--reading:"), 2u);  // light and dark
  EXPECT_EQ(count(page, "</script>"), 3u);
  EXPECT_EQ(count(page, "</html>"), 1u);
  EXPECT_THAT(page, Not(HasSubstr("{{")));
}

TEST(ReportPage, HoldsTheCurves) {
  const json data = page_data(render_report(sample()));
  EXPECT_EQ(data["temperature"]["t_s"], json({0.0, 1.0, 2.0}));
  EXPECT_EQ(data["temperature"]["reading_degc"], json({25.0, 60.25, 179.75}));
  EXPECT_EQ(data["temperature"]["heater_degc"], json({25.5, 70.0, 190.0}));
  EXPECT_EQ(data["duty"]["duty"], json({0.0, 1.0, 0.25}));
}

TEST(ReportPage, ShowsAMissingValueAsAGap) {
  const json data = page_data(render_report(sample()));
  EXPECT_EQ(data["temperature"]["setpoint_degc"], json({nullptr, 180.0, 180.0}));
}

TEST(ReportPage, HoldsBothPathsWithTheirLengths) {
  const json data = page_data(render_report(sample()));
  EXPECT_EQ(data["path_before"]["x_mm"], json({0.0, 3.0, 1.0}));
  EXPECT_EQ(data["path_before"]["cost"], 13.0);
  EXPECT_EQ(data["path_after"]["y_mm"], json({0.0, 0.0, 4.0}));
  EXPECT_EQ(data["path_after"]["cost"], 7.0);
}

TEST(ReportPage, CutsALongCurveAndKeepsItsPeak) {
  PrintReport report = sample();
  report.temperature.assign(50'000, {0.0, 20.0, 20.0, 20.0});
  report.temperature[12'345].reading_degc = 321.0;
  const json readings = page_data(render_report(report))["temperature"]["reading_degc"];
  EXPECT_LE(readings.size(), kMaxCurvePoints);
  EXPECT_EQ(count(readings.dump(), "321.0"), 1u);
}

TEST(ReportPage, DrawsTheFirstBumpsOfALongPathAndTellsHowManyThereAre) {
  PrintReport report = sample();
  report.path_after.points.assign(kMaxPathPoints + 7, {1.0, 2.0});
  const json path = page_data(render_report(report))["path_after"];
  EXPECT_EQ(path["x_mm"].size(), kMaxPathPoints);
  EXPECT_EQ(path["points"], kMaxPathPoints + 7);
}

TEST(ReportPage, TextsOfTheUserStayTexts) {
  PrintReport report = sample();
  report.job = R"(</script><script>alert(1)</script> & "<b>")";
  report.faults = {{0.0, "{{data}} <!-- </SCRIPT> \\ \""}};
  const std::string page = render_report(report);
  EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
  EXPECT_EQ(count(page, "</script>"), 3u);
  EXPECT_THAT(page, HasSubstr("<title>&lt;/script>&lt;script>alert(1)&lt;/script> &amp; \"&lt;b>\""));
  const json data = page_data(page);
  EXPECT_EQ(data["job"], report.job);
  EXPECT_EQ(data["faults"][0]["sentence"], report.faults[0].sentence);
}

TEST(ReportPage, BytesThatAreNoTextBecomeAReplacementSign) {
  PrintReport report = sample();
  report.job = "caf\xe9";
  EXPECT_EQ(page_data(render_report(report))["job"], "caf\xef\xbf\xbd");
}

TEST(ReportPage, AReportOfNothingIsAPageToo) {
  const json data = page_data(render_report(PrintReport{}));
  EXPECT_EQ(data["good"], false);
  EXPECT_TRUE(data["lockstep"].empty());
  EXPECT_TRUE(data["path_after"]["x_mm"].empty());
}

TEST(Summary, SaysWhatHappenedWithoutTheCurves) {
  const json summary = json::parse(summary_json(sample()));
  EXPECT_EQ(summary["schema"], kSummarySchema);
  EXPECT_EQ(summary["job"], "first");
  EXPECT_EQ(summary["date"], "2026-11-21T03:00:00Z");
  EXPECT_EQ(summary["good"], true);
  EXPECT_EQ(summary["verdict"], "32 bumps printed at 180 °C, RTL and model equal.");
  EXPECT_EQ(summary["key_figures"][1], json({{"what", "overshoot"}, {"value", 0.4213}, {"unit", "degC"}}));
  EXPECT_EQ(summary["phases"][1], json({{"name", "heat-up"}, {"begin_s", 0.5}, {"end_s", 2.0}}));
  EXPECT_EQ(
      summary["path"],
      json(
          {{"points", 3}, {"unit", "mm"}, {"cost_before", 13.0}, {"cost_after", 7.0}, {"lower_bound", 6.5}}));
  EXPECT_EQ(summary["lockstep"][0]["comparisons"], 1'250'000);
  EXPECT_EQ(summary["lockstep"][0]["flops_per_clock"], 1234);
  EXPECT_EQ(summary["faults"][0], json({{"t_s", 1.5}, {"sentence", "sensor open"}}));
  EXPECT_EQ(summary["settings"][0]["text"], "180 °C");
  EXPECT_EQ(summary["versions"][0]["name"], "meltstage");
  EXPECT_FALSE(summary.contains("temperature"));
}

TEST(Summary, TellsMismatches) {
  PrintReport report = sample();
  report.lockstep[0].mismatches = 3;
  EXPECT_EQ(json::parse(summary_json(report))["lockstep"][0]["mismatches"], 3);
}

TEST(Summary, KeepsCountsBeyond32Bits) {
  PrintReport report = sample();
  report.lockstep[0].comparisons = 123'456'789'012'345;
  EXPECT_EQ(json::parse(summary_json(report))["lockstep"][0]["comparisons"], 123'456'789'012'345);
}

class ReportFile : public testing::Test {
 protected:
  ReportFile() : folder(std::filesystem::path(testing::TempDir()) / ("report_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder);
  }
  ~ReportFile() override { std::filesystem::remove_all(folder); }

  const std::filesystem::path folder;
};

TEST_F(ReportFile, HoldsThePageAndNothingIsLeftBesideIt) {
  write_report(folder / "report.html", sample());
  EXPECT_EQ(file_text(folder / "report.html"), render_report(sample()));
  const std::filesystem::directory_iterator files(folder);
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

TEST_F(ReportFile, ThatCannotBeWrittenIsNamed) {
  const auto path = folder / "missing" / "report.html";
  try {
    write_report(path, sample());
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
    EXPECT_THAT(error.what(), Not(HasSubstr("\n")));
  }
}

}  // namespace
}  // namespace meltstage::app
