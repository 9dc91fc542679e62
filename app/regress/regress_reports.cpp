// SPDX-License-Identifier: Apache-2.0
#include "app/regress/regress_reports.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>

#include "base/build_stamp.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/first_line.hpp"
#include "page_style.hpp"

namespace meltstage::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kSlowest = 10;
constexpr std::size_t kShownFaults = 20;
constexpr std::size_t kShownHistory = 60;

// Text for XML and HTML; control characters, which neither can hold, are blanks.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += static_cast<unsigned char>(c) < 0x20 && c != '\n' ? ' ' : c;
  }
  return out;
}

double per_second(std::uint64_t count, double seconds) {
  return seconds > 0.0 ? static_cast<double>(count) / seconds : 0.0;
}

// "12.3 million".
std::string large(std::uint64_t count) {
  const auto value = static_cast<double>(count);
  if (count >= 1'000'000'000) return fmt::format("{:.2f} billion", value / 1e9);
  if (count >= 1'000'000) return fmt::format("{:.1f} million", value / 1e6);
  std::string text = std::to_string(count);
  if (count >= 1'000) text.insert(text.size() - 3, ",");
  return text;
}

// One test's runs together.
struct TestSum {
  std::uint64_t runs = 0, good = 0, clocks = 0;
  double run_s = 0.0;
};

std::map<std::string, TestSum> by_test(const RegressReport& report) {
  std::map<std::string, TestSum> sums;
  for (std::size_t i = 0; i < report.plan.suite.runs.size(); ++i) {
    TestSum& sum = sums[report.plan.suite.runs[i].test];
    ++sum.runs;
    const auto& result = report.verdict.results[i];
    if (!result) continue;
    sum.good += result->good;
    sum.clocks += result->compared.clocks;
    sum.run_s += result->wall_s;
  }
  return sums;
}

std::vector<tb::RunResult> slowest(const RegressReport& report) {
  std::vector<tb::RunResult> list;
  for (const auto& result : report.verdict.results)
    if (result) list.push_back(*result);
  std::stable_sort(list.begin(), list.end(),
                   [](const auto& a, const auto& b) { return a.wall_s > b.wall_s; });
  if (list.size() > kSlowest) list.resize(kSlowest);
  return list;
}

std::string test_case(const RegressReport& report, std::size_t number) {
  const tb::RegressRun& run = report.plan.suite.runs[number];
  const auto& result = report.verdict.results[number];
  std::string text =
      fmt::format("  <testcase classname=\"{}\" name=\"{}\" time=\"{:.3f}\"", escaped(report.plan.suite.name),
                  tb::name_of(run), result ? result->wall_s : 0.0);
  if (result && result->good) return text + "/>\n";
  if (!result) return text + "><error message=\"no result: its worker was lost\"/></testcase>\n";
  return text + fmt::format("><failure message=\"{}\">{}\nrepeat: {}</failure></testcase>\n",
                            escaped(first_line(result->report)), escaped(result->report),
                            tb::repeat_command(run));
}

// Clocks a second of the runs, and a mark for each verdict that was bad.
std::string trend(const std::vector<HistoryLine>& history) {
  const std::size_t count = std::min(history.size(), kShownHistory);
  const auto* const first = history.data() + (history.size() - count);
  double most = 0.0;
  for (std::size_t i = 0; i < count; ++i) most = std::max(most, per_second(first[i].clocks, first[i].run_s));
  if (count < 2 || most <= 0.0)
    return "<p class=\"about\">The first of its kind: later runs show a trend here.</p>\n";
  constexpr double kLeft = 90.0, kWidth = 860.0, kTop = 10.0, kHeight = 90.0;
  std::string line, marks;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = kLeft + kWidth * static_cast<double>(i) / static_cast<double>(count - 1);
    const double y = kTop + kHeight * (1.0 - per_second(first[i].clocks, first[i].run_s) / most);
    line += fmt::format("{:.1f},{:.1f} ", x, y);
    marks += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"><title>{}: {}, {} bad of "
        "{}</title></circle>",
        x, y, first[i].passed ? "#1a7f4b" : "#b3261e", escaped(first[i].date),
        first[i].passed ? "passed" : "failed", first[i].bad, first[i].runs);
  }
  return fmt::format(
      "<svg viewBox=\"0 0 960 128\" role=\"img\" aria-label=\"clocks a second over earlier runs\"><line "
      "class=\"axis\" x1=\"{0}\" "
      "y1=\"{1}\" x2=\"{2}\" y2=\"{1}\"/><text class=\"label\" x=\"0\" y=\"16\">{3:.2f} M/s</text><text "
      "class=\"label\" x=\"0\" "
      "y=\"{1}\">0</text><polyline fill=\"none\" stroke=\"#3b6ea5\" stroke-width=\"1.5\" "
      "points=\"{4}\"/>{5}<text class=\"label\" "
      "x=\"{0}\" y=\"122\">{6}</text><text class=\"label\" x=\"{2}\" y=\"122\" "
      "text-anchor=\"end\">{7}</text></svg>\n",
      kLeft, kTop + kHeight, kLeft + kWidth, most / 1e6, line, marks, escaped(first[0].date.substr(0, 10)),
      escaped(first[count - 1].date.substr(0, 10)));
}

std::string failures_html(const RegressReport& report) {
  std::string text;
  for (std::size_t i = 0; i < report.plan.suite.runs.size(); ++i) {
    const tb::RegressRun& run = report.plan.suite.runs[i];
    const auto& result = report.verdict.results[i];
    if (result && result->good) continue;
    text += fmt::format("<details open><summary><b>{}</b> <code>{}</code></summary><pre>{}</pre></details>\n",
                        tb::name_of(run), escaped(tb::repeat_command(run)),
                        result ? escaped(result->report) : "no result: its worker was lost");
  }
  return text;
}

// Open where it is asked for; otherwise a list that a reader may open.
std::string holes_html(const RegressReport& report) {
  const std::vector<std::string>& holes = report.verdict.holes;
  if (holes.empty())
    return "<h2>Coverage</h2>\n<p>Each point of the specification is met, each flop bit rises and falls, and "
           "each fault latches in each state and beside each other one.</p>\n";
  const bool asked = report.plan.suite.coverage_closed;
  std::string text = fmt::format(
      "<h2>Coverage</h2>\n<details{}><summary>{} points are not met{}</summary>\n<ul "
      "class=\"columns\">\n",
      asked ? " open" : "", holes.size(), asked ? "" : ", which this suite does not ask for");
  for (const std::string& hole : holes) text += "<li>" + escaped(hole) + "</li>\n";
  return text + "</ul></details>\n";
}

// Flop bits that switch both ways, of all blocks.
tb::FlopToggles::Block all_blocks(const tb::FlopToggles& toggles) {
  tb::FlopToggles::Block sum{"all", 0, 0};
  for (const auto& block : toggles.blocks()) {
    sum.bits += block.bits;
    sum.switched += block.switched;
  }
  return sum;
}

double percent(const tb::FlopToggles::Block& block) { return 100.0 * block.switched / block.bits; }

// A row a block: its bits, how many of them switch both ways in each test, and in all.
std::string toggles_html(const tb::RegressVerdict& verdict) {
  std::string text =
      "<h2>Flop bits that rise and fall</h2>\n<p class=\"about\">By themselves, in clocks that were "
      "compared: neither in a reset nor when a test sets a flop.</p>\n<table><tr><th>block</th><th>bits</th>";
  std::vector<std::vector<tb::FlopToggles::Block>> columns;
  const auto add = [&](const std::string& name, const tb::FlopToggles& toggles) {
    text += fmt::format("<th>{}</th>", escaped(name));
    columns.push_back(toggles.blocks());
    columns.back().push_back(all_blocks(toggles));
  };
  for (const auto& [test, toggles] : verdict.toggles_of) add(test, toggles);
  add("together", verdict.toggles);
  text += "<th>%</th></tr>\n";
  for (std::size_t row = 0; row < columns.back().size(); ++row) {
    const tb::FlopToggles::Block& block = columns.back()[row];
    text += fmt::format("<tr><td>{}</td><td>{}</td>", block.name, block.bits);
    for (const auto& column : columns) text += fmt::format("<td>{}</td>", column[row].switched);
    text += fmt::format("<td>{:.1f}</td></tr>\n", percent(block));
  }
  return text +
         fmt::format(
             "</table>\n<p class=\"about\">{} rises and falls are proved never to happen, and count as "
             "met.</p>\n",
             tb::FlopToggles::never().count);
}

Json to_json(const HistoryLine& line) {
  return {{"date", line.date}, {"suite", line.suite},   {"passed", line.passed}, {"runs", line.runs},
          {"bad", line.bad},   {"clocks", line.clocks}, {"holes", line.holes},   {"run_s", line.run_s}};
}

}  // namespace

std::string junit_xml(const RegressReport& report) {
  const tb::RegressVerdict& v = report.verdict;
  const bool closed = report.plan.suite.coverage_closed;
  const std::size_t failures = v.failed + (closed && !v.holes.empty());
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n<testsuite name=\"{}\" tests=\"{}\" "
      "failures=\"{}\" errors=\"{}\" "
      "skipped=\"0\" time=\"{:.3f}\" timestamp=\"{}\">\n",
      escaped(report.plan.suite.name), v.results.size() + closed, failures, v.missing, v.run_s, report.date);
  for (std::size_t i = 0; i < v.results.size(); ++i) text += test_case(report, i);
  if (closed) {
    text += fmt::format("  <testcase classname=\"{}\" name=\"coverage\" time=\"0\"",
                        escaped(report.plan.suite.name));
    std::string holes;
    for (const std::string& hole : v.holes) holes += escaped(hole) + "\n";
    text += holes.empty() ? "/>\n"
                          : fmt::format("><failure message=\"{} points not met\">{}</failure></testcase>\n",
                                        v.holes.size(), holes);
  }
  return text + "</testsuite>\n</testsuites>\n";
}

std::string summary_json(const RegressReport& report) {
  const tb::RegressVerdict& v = report.verdict;
  Json runs = Json::array();
  for (std::size_t i = 0; i < v.results.size(); ++i) {
    const tb::RegressRun& run = report.plan.suite.runs[i];
    Json one = {{"run", tb::name_of(run)}, {"amount", run.amount}, {"verdict", "lost"}};
    if (const auto& r = v.results[i]) {
      one["verdict"] = r->good ? "good" : "bad";
      one["clocks"] = r->compared.clocks;
      one["wall_s"] = r->wall_s;
      one["host"] = r->host;
      if (!r->good) one["report"] = r->report;
    }
    one["repeat"] = tb::repeat_command(run);
    runs.push_back(one);
  }
  const Json json = {{"suite", report.plan.suite.name},
                     {"date", report.date},
                     {"version", version()},
                     {"rtl_sha256", rtl_sha256()},
                     {"verdict", v.passed() ? "passed" : "failed"},
                     {"good", v.good},
                     {"bad", v.failed},
                     {"lost", v.missing},
                     {"clocks", v.compared.clocks},
                     {"flop_values", v.compared.flop_values},
                     {"pin_values", v.compared.pin_values},
                     {"clocks_per_s", per_second(v.compared.clocks, v.run_s)},
                     {"wall_s", report.wall_s},
                     {"workers", report.workers},
                     {"not_covered", v.holes},
                     {"flop_bits", all_blocks(v.toggles).bits},
                     {"flop_bits_both_ways", all_blocks(v.toggles).switched},
                     {"flop_bits_still", v.toggles.still()},
                     {"faults", v.faults},
                     {"notes", report.notes},
                     {"runs", runs}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string regress_page(const RegressReport& report, const std::vector<HistoryLine>& history) {
  const tb::RegressVerdict& v = report.verdict;
  const std::string& name = report.plan.suite.name;
  std::string text = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>regress {0}: {1}</title><meta "
      "name=\"viewport\" "
      "content=\"width=device-width\"><style>{2}</style></head><body>\n<h1>regress {0} <span class=\"verdict "
      "{1}\">{1}</span></h1>\n<p "
      "class=\"about\">{3}<br>{4}, meltstage {5}, {6}; {7:.0f} s by the clock</p>\n",
      escaped(name), v.passed() ? "passed" : "failed", regress_style::kCss, escaped(report.plan.suite.about),
      report.date, escaped(version()), escaped(report.workers), report.wall_s);
  text +=
      "<table><tr><th>test</th><th>runs</th><th>good</th><th>clocks</th><th>million clocks/s a "
      "process</th></tr>\n";
  for (const auto& [test, sum] : by_test(report))
    text += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.2f}</td></tr>\n", test,
                        sum.runs, sum.good, large(sum.clocks), per_second(sum.clocks, sum.run_s) / 1e6);
  text += fmt::format(
      "<tr><td><b>all</b></td><td>{}</td><td>{}</td><td>{}</td><td>{:.2f}</td></tr></table>\n",
      v.results.size(), v.good, large(v.compared.clocks), per_second(v.compared.clocks, v.run_s) / 1e6);
  text += fmt::format("<p>{} flop values and {} pin values compared; {} resets, {} frames, {} samples.</p>\n",
                      large(v.compared.flop_values), large(v.compared.pin_values), v.compared.resets,
                      v.compared.frames, v.compared.samples);
  if (v.failed + v.missing > 0) text += "<h2>Runs that are not good</h2>\n" + failures_html(report);
  text += holes_html(report);
  text += toggles_html(v);
  text += "<h2>Earlier runs of this suite</h2>\n" + trend(history);
  text +=
      "<h2>Slowest runs</h2>\n<table><tr><th>run</th><th>seconds</th><th>clocks</th><th>machine</th></tr>\n";
  for (const tb::RunResult& r : slowest(report))
    text += fmt::format("<tr><td>{}</td><td>{:.1f}</td><td>{}</td><td>{}</td></tr>\n", tb::name_of(r.run),
                        r.wall_s, large(r.compared.clocks), escaped(r.host));
  text += "</table>\n";
  if (!report.notes.empty()) {
    text += "<h2>Lost workers</h2>\n<ul>\n";
    for (const std::string& note : report.notes) text += "<li>" + escaped(note) + "</li>\n";
    text += "</ul>\n";
  }
  return text + "</body></html>\n";
}

std::string regress_text(const RegressReport& report, const std::filesystem::path& folder) {
  const tb::RegressVerdict& v = report.verdict;
  std::string text =
      fmt::format("{:<10} {:>7} {:>7} {:>16} {:>18}\n", "test", "runs", "good", "clocks", "M clocks/s");
  for (const auto& [test, sum] : by_test(report))
    text += fmt::format("{:<10} {:>7} {:>7} {:>16} {:>18.2f}\n", test, sum.runs, sum.good, sum.clocks,
                        per_second(sum.clocks, sum.run_s) / 1e6);
  for (std::size_t i = 0; i < v.faults.size() && i < kShownFaults; ++i) text += v.faults[i] + "\n";
  if (v.faults.size() > kShownFaults)
    text += fmt::format("... {} lines more\n", v.faults.size() - kShownFaults);
  for (const std::string& note : report.notes) text += note + "\n";
  std::size_t shown = 0;
  for (const auto& result : v.results)
    if (result && !result->good && shown++ < kShownFaults)
      text += "repeat: " + tb::repeat_command(result->run) + "\n";
  text += fmt::format("{:.1f} % of {} flop bits rise and fall by themselves\n",
                      percent(all_blocks(v.toggles)), all_blocks(v.toggles).bits);
  text += fmt::format(
      "{}: {} of {} runs good, {} clocks, {} flop values compared, {} points not covered{}; {:.1f} s, "
      "{}{}\npage: {}\n",
      v.passed() ? "passed" : "FAILED", v.good, v.results.size(), v.compared.clocks, v.compared.flop_values,
      v.holes.size(), report.plan.suite.coverage_closed ? "" : " (not asked for)", report.wall_s,
      report.workers, report.kept != 0 ? fmt::format("; {} results were there already", report.kept) : "",
      (folder / "report.html").string());
  return text;
}

HistoryLine history_line(const RegressReport& report) {
  const tb::RegressVerdict& v = report.verdict;
  return {report.date,          report.plan.suite.name, v.passed(),     v.results.size(),
          v.failed + v.missing, v.compared.clocks,      v.holes.size(), v.run_s};
}

std::vector<HistoryLine> append_history(const std::filesystem::path& file, const HistoryLine& line) {
  {
    std::ofstream out(file, std::ios::app | std::ios::binary);
    out << to_json(line).dump() << '\n';
    if (!out.flush()) throw UserError(fmt::format("{}: cannot be written", file.string()));
  }
  std::vector<HistoryLine> lines;
  std::istringstream text(read_file(file, "a history of regressions"));
  for (std::string row; std::getline(text, row);) {
    try {
      const Json json = Json::parse(row);
      HistoryLine read{json.at("date"), json.at("suite"),  json.at("passed"), json.at("runs"),
                       json.at("bad"),  json.at("clocks"), json.at("holes"),  json.at("run_s")};
      if (read.suite == line.suite) lines.push_back(read);
    } catch (const nlohmann::json::exception&) {  // cut off by a kill, or somebody else's
    }
  }
  return lines;
}

}  // namespace meltstage::app
