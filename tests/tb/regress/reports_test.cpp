// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "app/regress/regress_reports.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage::app {
namespace {

constexpr chip::Inputs kRunning{.test_mode = true};  // out of reset whatever the synchroniser holds

using testing::HasSubstr;
using testing::Not;

// A good run, a bad one, a lost one.
RegressReport report_of_three() {
  RegressReport report;
  report.plan.suite = {.name = "mine",
                       .about = "three runs",
                       .coverage_closed = true,
                       .runs = {{"random", 1, 10}, {"random", 2, 10}, {"skip", 3, 4}}};
  tb::RunResult good, bad;
  good.run = report.plan.suite.runs[0];
  good.good = true;
  good.compared.clocks = 10;
  good.wall_s = 0.5;
  bad.run = report.plan.suite.runs[1];
  bad.report = "MISMATCH <a> & \"b\"\x1b[31m\nsecond line";
  report.verdict.results = {good, bad, std::nullopt};
  report.verdict.faults = {"random.2: MISMATCH", "skip.3: no result", "not covered: fault Rate"};
  report.verdict.holes = {"fault Rate"};
  report.verdict.good = report.verdict.failed = report.verdict.missing = 1;
  report.date = "2026-11-27T03:50:00Z";
  return report;
}

TEST(RegressReports, JunitHasACaseForEachRunAndOneForCoverage) {
  const std::string xml = junit_xml(report_of_three());
  EXPECT_THAT(xml, HasSubstr("tests=\"4\" failures=\"2\" errors=\"1\""));
  EXPECT_THAT(xml, HasSubstr("<testcase classname=\"mine\" name=\"random.1\" time=\"0.500\"/>"));
  EXPECT_THAT(xml, HasSubstr("<failure message=\"MISMATCH &lt;a&gt; &amp; &quot;b&quot; [31m\">"));
  EXPECT_THAT(xml, HasSubstr("repeat: meltstage regress one random.2 --amount 10"));
  EXPECT_THAT(xml, HasSubstr("name=\"skip.3\" time=\"0.000\"><error"));
  EXPECT_THAT(xml, HasSubstr("<failure message=\"1 points not met\">fault Rate"));
  EXPECT_THAT(xml, Not(HasSubstr("\x1b")));
}

TEST(RegressReports, TextAndPageTellVerdictRepeatAndHoles) {
  const RegressReport report = report_of_three();
  const std::string text = regress_text(report, "out/mine"),
                    page = regress_page(report, {history_line(report)});
  EXPECT_THAT(text, HasSubstr("FAILED: 1 of 3 runs good"));
  EXPECT_THAT(text, HasSubstr("repeat: meltstage regress one random.2 --amount 10\n"));
  for (const char* part :
       {"failed", "random.2", "MISMATCH &lt;a&gt;", "skip.3", "its worker was lost", "fault Rate"})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_THAT(summary_json(report), HasSubstr("\"verdict\": \"failed\""));
}

// Of RST_SYNC's two bits one rises in one test and the other in another; neither ever falls by itself.
TEST(RegressReports, PageTellsTheFlopBitsOfEachTest) {
  RegressReport report = report_of_three();
  chip::Chip low, stage, both;
  stage.rst_sync.stage_q = both.rst_sync.stage_q = 1;
  low.rst_sync.stage_q = low.rst_sync.out_q = stage.rst_sync.out_q = 0;
  both.rst_sync.out_q = 1;
  auto& of_random = report.verdict.toggles_of["random"];
  of_random.resume(low);
  of_random.observe(kRunning, stage);
  auto& of_any_state = report.verdict.toggles_of["any_state"];
  of_any_state.resume(stage);
  of_any_state.observe(kRunning, both);
  for (const auto& [test, toggles] : report.verdict.toggles_of) report.verdict.toggles.add(toggles);
  const std::string page = regress_page(report, {});
  EXPECT_THAT(page, HasSubstr("<th>bits</th><th>any_state</th><th>random</th><th>together</th><th>%</th>"));
  EXPECT_THAT(page, HasSubstr("<td>rst_sync</td><td>2</td><td>1</td><td>1</td><td>2</td><td>100.0</td>"));
}

TEST(RegressReports, HistoryIsOfTheSuiteAndSkipsWhatIsNoLineOfIt) {
  const ScratchFolder folder;
  const auto file = folder.write("history.jsonl", "{\"date\": \"cut off\n[1]\n");
  HistoryLine line = history_line(report_of_three());
  EXPECT_EQ(append_history(file, line).size(), 1u);
  line.suite = "other";
  EXPECT_EQ(append_history(file, line).size(), 1u);
  line.suite = "mine";
  const auto lines = append_history(file, line);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[1].bad, 2u);
}

}  // namespace
}  // namespace meltstage::app
