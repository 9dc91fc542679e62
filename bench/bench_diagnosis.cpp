// SPDX-License-Identifier: Apache-2.0
// From fail logs back to the net: defects drawn at run time on the chip's scanned netlist, tested by the
// virtual tester, diagnosed from the log alone.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <random>
#include <string>
#include <vector>

#include "asic/dft/core/workers.hpp"
#include "asic/dft/diagnosis/findings.hpp"
#include "asic/dft/diagnosis/tester.hpp"
#include "asic/dft/program.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "bench/bench.hpp"
#include "bench/data_file.hpp"

namespace meltstage::app {

namespace {

using namespace dft;

// Each defect in as many chips as drawn; what the log tells beside the truth.
struct Score {
  std::size_t failing = 0, first = 0, alone = 0, first_five = 0;
  double tied = 0, time_s = 0, most_s = 0;
};

class Judge {
 public:
  explicit Judge(const ProgramOnNetlist& program)
      : program_(program), reader_(program), names_(program.view.circuit) {}

  // Captures and chains apart: a defect of both kinds may break a chain.
  void judge(const std::vector<TestedChip>& chips, Score& captures, Score& chains, const Progress& progress) {
    std::mutex mutex;
    std::size_t next = 0;
    in_parallel([&](unsigned worker) {
      for (;;) {
        std::size_t i = 0;
        {
          const std::lock_guard lock(mutex);
          if (next == chips.size()) return;
          i = next++;
        }
        if (worker == 0) tell(progress, "diagnosing", i, chips.size());
        const FailLog log = test_chip(program_.view, program_.stream, program_.scan_enable, chips[i]);
        if (log.fails.empty()) continue;
        const auto start = std::chrono::steady_clock::now();
        const Findings findings = reader_.findings(log);
        const double time_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        const std::lock_guard lock(mutex);
        count(chips[i], findings, time_s, findings.chains.empty() ? captures : chains);
      }
    });
  }

 private:
  void count(const TestedChip& chip, const Findings& findings, double time_s, Score& score) const {
    std::vector<std::string> truth;
    for (const ChipDefect& defect : chip.defects) {
      truth.push_back(names_.net_of(defect.line));
      if (is_bridge(defect.kind)) truth.push_back(names_.net_of(defect.other));
    }
    const auto is_true = [&](const std::string& net) {
      return std::find(truth.begin(), truth.end(), net) != truth.end();
    };
    ++score.failing;
    score.time_s += time_s;
    score.most_s = std::max(score.most_s, time_s);
    std::size_t named = 0;
    bool in_five = false;
    for (const auto& group : findings.blamed) {
      const bool hit = std::any_of(group.begin(), group.end(), is_true);
      if (&group == &findings.blamed[0]) {
        score.tied += static_cast<double>(group.size());
        score.first += hit ? 1 : 0;
        score.alone += hit && group.size() == 1 ? 1 : 0;
      }
      // a group counts whole where it begins among the first five
      in_five = in_five || (hit && named < 5);
      named += group.size();
    }
    score.first_five += in_five ? 1 : 0;
  }

  const ProgramOnNetlist& program_;
  LogReader reader_;
  LineNames names_;
};

class Draw {
 public:
  Draw(const CaptureView& view, std::uint64_t seed)
      : circuit_(view.circuit), random_(seed), lines_(data_lines(view)) {}
  ChipDefect defect(DefectKind kind) {
    if (!is_bridge(kind)) return {kind, line()};
    for (;;) {
      const Line a{source_of(circuit_, line()), kStem}, b{source_of(circuit_, line()), kStem};
      if (a.node != b.node && !leads_to(circuit_, a.node, b.node) && !leads_to(circuit_, b.node, a.node))
        return {kind, a, b};
    }
  }
  std::uint64_t seed() { return random_(); }

 private:
  const Line& line() { return lines_[random_() % lines_.size()]; }
  const Circuit& circuit_;
  std::mt19937_64 random_;
  std::vector<Line> lines_;
};

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 100.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

// `wanted`: single defects are to be found; of two at once the figures are told as they are.
void add_rows(const std::string& what, const Score& score, bool wanted, std::vector<BenchRow>& rows) {
  if (score.failing == 0) return;
  const auto count = static_cast<double>(score.failing);
  const auto at_least = [&](double bound) { return wanted ? std::optional(bound) : std::nullopt; };
  rows.push_back({what + ": chips that fail", count, "", {}, {}});
  rows.push_back({what + ": true net first", share(score.first, score.failing), "%", at_least(90.0), {}});
  rows.push_back({what + ": true net among the first five",
                  share(score.first_five, score.failing),
                  "%",
                  at_least(99.0),
                  {}});
  rows.push_back({what + ": true net first and alone", share(score.alone, score.failing), "%", {}, {}});
  rows.push_back({what + ": nets that share the first place", score.tied / count, "", {}, {}});
  rows.push_back({what + ": time a log", score.time_s / count, "s", {}, 1.0});
  rows.push_back({what + ": longest", score.most_s, "s", {}, {}});
}

}  // namespace

std::vector<BenchRow> bench_diagnosis(const BenchOptions& options) {
  const CellLibrary library = yosys_library();
  tell(options.progress, "generating tests", 0, 1);
  const TestProgram test = make_test_program(
      data_file("netlist.json", "./run bench diagnosis makes it, or the build's target chip_netlist"),
      library, {FaultModel::stuck_at, {}, {.seed = options.seed}});
  const ScanDesign& design = test.subject.design;
  ProgramOnNetlist program;
  program.stream = unrolled(test.stream);
  program.view = capture_view(design.netlist, library);
  program.captures = scan_view(design, library);
  program.scan_enable = design.scan_enable;
  program.patterns = captures_of(program.captures, program.stream, program.scan_enable);
  Judge judge(program);
  Draw draw(program.view, options.seed);
  const std::size_t count = options.quick ? 3 : 84;  // of each of the twelve ways: 1008 chips
  std::vector<BenchRow> rows;
  Score chains;
  const auto add = [&](const std::string& what, std::vector<std::vector<DefectKind>> ways, bool wanted) {
    std::vector<TestedChip> chips;
    for (const auto& kinds : ways) {
      for (std::size_t i = 0; i < count; ++i) {
        TestedChip& chip = chips.emplace_back();
        for (const DefectKind kind : kinds) chip.defects.push_back(draw.defect(kind));
        chip.seed = draw.seed();
      }
    }
    Score captures;
    Score both_chains;
    judge.judge(chips, captures, wanted ? chains : both_chains, options.progress);
    add_rows(what, captures, wanted, rows);
    if (!wanted) add_rows(what + ", a chain broken", both_chains, wanted, rows);
  };
  using enum DefectKind;
  add("stuck", {{stuck_at_0}, {stuck_at_1}}, true);
  add("slow", {{slow_to_rise}, {slow_to_fall}}, true);
  add("bridged", {{dominated_by}, {wired_and}, {wired_or}}, true);
  add_rows("a chain broken", chains, true, rows);
  add("two at once",
      {{stuck_at_0, stuck_at_1},
       {stuck_at_0, slow_to_rise},
       {stuck_at_1, dominated_by},
       {slow_to_fall, wired_and},
       {wired_or, stuck_at_1}},
      false);
  return rows;
}

}  // namespace meltstage::app
