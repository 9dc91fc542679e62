// SPDX-License-Identifier: Apache-2.0
#include "tb/regress/regression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ratio>
#include <type_traits>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/first_line.hpp"
#include "base/sha256.hpp"
#include "tb/jobs/deadline.hpp"
#include "tb/jobs/sealed_json.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlanFormat = "meltstage-regression";
constexpr const char* kResultFormat = "meltstage-regression-result";

fs::path plan_file(const fs::path& folder) { return folder / "plan.json"; }
fs::path result_file(const fs::path& folder, std::size_t number) {
  return folder / "results" / fmt::format("{:06}.json", number);
}

Json to_json(const RegressRun& run) {
  return {{"test", run.test}, {"seed", run.seed}, {"amount", run.amount}};
}

RegressRun run_from(const Json& json) {
  RegressRun run{json.at("test"), json.at("seed"), json.at("amount")};
  if (find_test(run.test) == nullptr) throw UserError(fmt::format("test: found \"{}\"", run.test));
  return run;
}

Json to_json(const RegressPlan& plan) {
  Json runs = Json::array();
  for (const RegressRun& run : plan.suite.runs) runs.push_back(to_json(run));
  return {{"suite", plan.suite.name},
          {"about", plan.suite.about},
          {"coverage_closed", plan.suite.coverage_closed},
          {"limit_min", plan.suite.limit_min},
          {"program", plan.program},
          {"runs", runs}};
}

RegressPlan plan_from(const Json& json) {
  RegressPlan plan;
  plan.suite.name = json.at("suite");
  plan.suite.about = json.at("about");
  plan.suite.coverage_closed = json.at("coverage_closed");
  plan.suite.limit_min = json.at("limit_min");
  plan.program = json.at("program");
  for (const Json& run : json.at("runs")) plan.suite.runs.push_back(run_from(run));
  return plan;
}

// Calls `visit(name, array)` for each list of counts; the coverage may be const or not.
template <class AnyCoverage, class Visit>
void for_counts(AnyCoverage& coverage, const Visit& visit) {
  visit("states", coverage.states);
  for (std::size_t from = 0; from < coverage.arcs.size(); ++from)
    visit(fmt::format("arcs_{}", from).c_str(), coverage.arcs[from]);
  visit("latched", coverage.latched);
  visit("segments", coverage.segments);
  visit("functions", coverage.functions);
  visit("wrong_lengths", coverage.wrong_lengths);
  visit("exceptions", coverage.exceptions);
  visit("sensors", coverage.sensors);
  visit("points", coverage.points);
  visit("rose", coverage.toggles.rose);
  visit("fell", coverage.toggles.fell);
  visit("faults_in_state", coverage.crosses.in_state);
  visit("faults_at_once", coverage.crosses.at_once);
  visit("faults_while_one_stands", coverage.crosses.while_stands);
  visit("register_ends", coverage.ends.met);
}

// {"states": [[3, 17], ...], ...}: index and count of what is not 0.
Json to_json(const Coverage& coverage) {
  Json json = {{"crc_errors", coverage.crc_errors}};
  for_counts(coverage, [&](const char* name, const auto& counts) {
    Json list = Json::array();
    for (std::size_t i = 0; i < counts.size(); ++i)
      if (counts[i] != 0) list.push_back({i, static_cast<std::uint64_t>(counts[i])});
    if (!list.empty()) json[name] = list;
  });
  return json;
}

Coverage coverage_from(const Json& json) {
  Coverage coverage;
  coverage.crc_errors = json.at("crc_errors");
  for_counts(coverage, [&](const char* name, auto& counts) {
    if (!json.contains(name)) return;
    for (const Json& pair : json.at(name)) {
      using Count = std::remove_reference_t<decltype(counts[0])>;
      counts.at(pair.at(0).get<std::size_t>()) = static_cast<Count>(pair.at(1).get<std::uint64_t>());
    }
  });
  return coverage;
}

Json to_json(const RunResult& r) {
  return {{"run", to_json(r.run)},
          {"good", r.good},
          {"report", r.report},
          {"clocks", r.compared.clocks},
          {"pin_values", r.compared.pin_values},
          {"flop_values", r.compared.flop_values},
          {"resets", r.compared.resets},
          {"frames", r.compared.frames},
          {"samples", r.compared.samples},
          {"coverage", to_json(r.coverage)},
          {"wall_s", r.wall_s},
          {"host", r.host}};
}

RunResult result_from(const Json& json) {
  RunResult r;
  r.run = run_from(json.at("run"));
  r.good = json.at("good");
  r.report = json.at("report");
  r.compared = {json.at("clocks"), json.at("pin_values"), json.at("flop_values"),
                json.at("resets"), json.at("frames"),     json.at("samples")};
  r.coverage = coverage_from(json.at("coverage"));
  r.wall_s = json.at("wall_s");
  r.host = json.at("host");
  return r;
}

// Nothing for a result that isn't there, is damaged, or is of another run: that run is done again.
std::optional<RunResult> result_of(const fs::path& folder, const RegressPlan& plan, std::size_t number) {
  const fs::path path = result_file(folder, number);
  if (!fs::exists(path)) return std::nullopt;
  try {
    RunResult result = with_fields(path, [&] { return result_from(read_sealed(path, kResultFormat)); });
    if (result.run == plan.suite.runs.at(number)) return result;
  } catch (const UserError&) {
  } catch (const std::out_of_range&) {  // a count beyond the coverage of this program
  }
  return std::nullopt;
}

void add(Compared& sum, const Compared& c) {
  sum.clocks += c.clocks;
  sum.pin_values += c.pin_values;
  sum.flop_values += c.flop_values;
  sum.resets += c.resets;
  sum.frames += c.frames;
  sum.samples += c.samples;
}

}  // namespace

RegressPlan plan_for(const Suite& suite) {
  static const std::string program = sha256(read_file("/proc/self/exe", "this program"));
  return {suite, program};
}

bool holds(const fs::path& folder, const RegressPlan& plan) {
  if (!fs::exists(plan_file(folder))) return false;
  try {
    return read_sealed(plan_file(folder), kPlanFormat) == to_json(plan);
  } catch (const UserError&) {
    return false;
  }
}

void begin_regression(const fs::path& folder, const RegressPlan& plan) {
  fs::remove_all(folder / "results");
  fs::remove_all(folder / "failures");
  for (const char* verdict : {"junit.xml", "summary.json", "report.html"}) fs::remove(folder / verdict);
  fs::create_directories(folder / "results");
  write_sealed(plan_file(folder), kPlanFormat, to_json(plan));
}

RegressPlan read_regression(const fs::path& folder) {
  const fs::path path = plan_file(folder);
  if (!fs::exists(path))
    throw UserError(
        fmt::format("{}: not there, expected a folder that meltstage regress run made", path.string()));
  RegressPlan plan = with_fields(path, [&] { return plan_from(read_sealed(path, kPlanFormat)); });
  if (plan.program != plan_for({}).program)
    throw UserError(
        fmt::format("{}: is of another build of this program; run the suite again", path.string()));
  return plan;
}

RunResult do_planned_run(const fs::path& folder, const RegressPlan& plan, std::size_t number) {
  if (number >= plan.suite.runs.size())
    throw UserError(fmt::format("run: found {}, expected 0 to {}", number, plan.suite.runs.size() - 1));
  const RegressRun& run = plan.suite.runs[number];
  fs::create_directories(folder / "results");
  const auto write = [&](const RunResult& result) {
    write_sealed(result_file(folder, number), kResultFormat, to_json(result));
  };
  const Deadline deadline(std::chrono::duration<double, std::ratio<60>>(plan.suite.limit_min), [&] {
    write(overlong_run(run, plan.suite.limit_min));
    std::_Exit(1);  // the run itself can't be stopped
  });
  RunResult result = do_run(run, folder / "failures");
  deadline.met();
  write(result);
  return result;
}

std::vector<std::size_t> runs_to_do(const fs::path& folder, const RegressPlan& plan) {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < plan.suite.runs.size(); ++i)
    if (!result_of(folder, plan, i)) numbers.push_back(i);
  return numbers;
}

RegressVerdict join_runs(const fs::path& folder, const RegressPlan& plan) {
  RegressVerdict verdict;
  Coverage coverage;
  for (std::size_t i = 0; i < plan.suite.runs.size(); ++i) {
    const std::string name = name_of(plan.suite.runs[i]);
    verdict.results.push_back(result_of(folder, plan, i));
    const std::optional<RunResult>& result = verdict.results.back();
    if (!result) {
      ++verdict.missing;
      verdict.faults.push_back(name + ": no result");
      continue;
    }
    verdict.run_s += result->wall_s;
    coverage.add(result->coverage);
    if (result->coverage.toggles.any()) verdict.toggles_of[result->run.test].add(result->coverage.toggles);
    add(verdict.compared, result->compared);
    if (result->good) {
      ++verdict.good;
      continue;
    }
    ++verdict.failed;
    verdict.faults.push_back(fmt::format("{}: {}", name, first_line(result->report)));
  }
  verdict.holes = coverage.holes();
  verdict.toggles = coverage.toggles;
  for (const std::string& bit : verdict.toggles.still()) verdict.holes.push_back("flop bit " + bit);
  for (const std::string& cross : coverage.crosses.holes()) verdict.holes.push_back(cross);
  for (const std::string& end : coverage.ends.holes()) verdict.holes.push_back("register " + end);
  if (plan.suite.coverage_closed)
    for (const std::string& hole : verdict.holes) verdict.faults.push_back("not covered: " + hole);
  return verdict;
}

}  // namespace meltstage::tb
