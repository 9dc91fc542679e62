// SPDX-License-Identifier: Apache-2.0
#include "tb/windows/windows.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "recording/text.hpp"
#include "tb/jobs/sealed_json.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/chip_pins.hpp"

namespace meltstage::tb {

namespace fs = std::filesystem;

namespace {

constexpr const char* kPlanFormat = "meltstage-windows";
constexpr const char* kResultFormat = "meltstage-window-result";
Json to_json(const WindowPlan& plan) {
  Json windows = Json::array();
  for (const PlannedWindow& w : plan.windows) {
    windows.push_back({{"first_cycle", w.first_cycle},
                       {"last_cycle", w.last_cycle},
                       {"start_state", w.start_state},
                       {"end_state", w.end_state},
                       {"stimulus", w.stimulus}});
  }
  return {{"job", plan.job},           {"seed", plan.seed},     {"build", plan.made_by.build},
          {"spec", plan.made_by.spec}, {"cycles", plan.cycles}, {"windows", std::move(windows)}};
}

WindowPlan plan_from(const Json& json) {
  WindowPlan plan{.job = json.at("job"),
                  .seed = json.at("seed"),
                  .made_by = {json.at("build"), json.at("spec")},
                  .cycles = json.at("cycles"),
                  .windows = {}};
  for (const Json& w : json.at("windows")) {
    plan.windows.push_back(
        {w.at("first_cycle"), w.at("last_cycle"), w.at("start_state"), w.at("end_state"), w.at("stimulus")});
  }
  return plan;
}

Json to_json(const WindowResult& r) {
  return {{"plan", r.plan},
          {"window", r.window},
          {"first_cycle", r.first_cycle},
          {"last_cycle", r.last_cycle},
          {"start_state", r.start_state},
          {"end_state", r.end_state},
          {"stimulus", r.stimulus},
          {"clocks", r.compared.clocks},
          {"pin_values", r.compared.pin_values},
          {"flop_bits", r.flop_bits},
          {"flop_values", r.compared.flop_values},
          {"resets", r.compared.resets},
          {"frames", r.compared.frames},
          {"samples", r.compared.samples},
          {"equal", r.equal},
          {"report", r.report},
          {"host", r.host},
          {"wall_s", r.wall_s}};
}

WindowResult result_from(const Json& json) {
  return {.file = {},
          .plan = json.at("plan"),
          .window = json.at("window"),
          .first_cycle = json.at("first_cycle"),
          .last_cycle = json.at("last_cycle"),
          .start_state = json.at("start_state"),
          .end_state = json.at("end_state"),
          .stimulus = json.at("stimulus"),
          .flop_bits = json.at("flop_bits"),
          .compared = {.clocks = json.at("clocks"),
                       .pin_values = json.at("pin_values"),
                       .flop_values = json.at("flop_values"),
                       .resets = json.at("resets"),
                       .frames = json.at("frames"),
                       .samples = json.at("samples")},
          .equal = json.at("equal"),
          .report = json.at("report"),
          .host = json.at("host"),
          .wall_s = json.at("wall_s")};
}

WindowResult read_result(const fs::path& path) {
  return with_fields(path, [&] { return result_from(read_sealed(path, kResultFormat)); });
}

fs::path numbered(const fs::path& folder, const char* part, std::size_t number, const char* ending) {
  return folder / part / fmt::format("{:06}.{}", number, ending);
}

std::string host_name() {
  char name[256] = {};
  gethostname(name, sizeof name - 1);
  return name;
}

// ---- The check of one window ----

SavedState load_border(const fs::path& folder, std::size_t border, const std::string& hash) {
  const fs::path path = state_file(folder, border);
  SavedState state = read_state(path);
  if (state_hash(state) != hash) {
    throw UserError(
        fmt::format("{}: not the state of this plan: found {:.12}..., expected {:.12}...; plan again",
                    path.string(), state_hash(state), hash));
  }
  return state;
}

void require_stimulus(const fs::path& path, const std::string& hash) {
  const std::string found = sha256(read_file(path, kPlanFile));
  if (found != hash) {
    throw UserError(
        fmt::format("{}: damaged or not of this plan: found SHA-256 {:.12}..., expected {:.12}...; "
                    "plan again",
                    path.string(), found, hash));
  }
}

std::string list_flops(const std::vector<FlopDifference>& flops, const char* who) {
  constexpr std::size_t kShown = 12;
  std::string text;
  for (std::size_t i = 0; i < flops.size() && i < kShown; ++i)
    text +=
        fmt::format("  flop {:<28} {}={:#x} saved={:#x}\n", flops[i].name, who, flops[i].dut, flops[i].model);
  if (flops.size() > kShown) text += fmt::format("  ... {} flops more\n", flops.size() - kShown);
  return text;
}

// One window's run; a difference is thrown as Mismatch.
class WindowRun {
 public:
  WindowRun(const fs::path& folder, const WindowPlan& plan, std::size_t window)
      : number_(window),
        planned_(plan.windows.at(window)),
        start_(load_border(folder, window, planned_.start_state)),
        end_(load_border(folder, window + 1, planned_.end_state)),
        repeat_(fmt::format("meltstage window {} {}", folder.string(), window)) {
    const fs::path path = stimulus_file(folder, window);
    require_stimulus(path, planned_.stimulus);
    pins_ = recording::read_text(path);
    const bool fits = pins_.header().pins == chip_pin_header("").pins &&
                      start_.cycle == planned_.first_cycle && pins_.first_cycle() == planned_.first_cycle &&
                      pins_.final_cycle() == planned_.last_cycle && end_.cycle == planned_.last_cycle + 1;
    if (!fits) {
      throw UserError(
          fmt::format("{}: pins or cycles are not those of window {}; plan again", path.string(), window));
    }
    auto rtl = make_verilated_rtl();
    rtl_ = rtl.get();
    // The first window begins with the RTL's own reset, which the first clock completes.
    if (start_.cycle > 0) rtl->load(start_.chip, start_.before);
    lockstep_.emplace(std::move(rtl), start_.chip, start_.cycle,
                      RunIdentity{fmt::format("window_{}", window), plan.seed, repeat_}, folder / "failures");
  }

  void run(const std::function<void(double share)>& progress) {
    constexpr std::uint64_t kTellEvery = 1 << 14;
    const auto clocks = static_cast<double>(planned_.last_cycle - planned_.first_cycle + 1);
    if (start_.cycle > 0 && !rtl_->flops_equal(start_.chip))
      fail("start", rtl_->differences(start_.chip), "RTL");
    recording::Cursor cursor(pins_);
    chip::Outputs left = start_.chip.outputs(start_.before);
    std::optional<std::uint64_t> event = planned_.first_cycle;
    chip::Inputs in;
    chip::Outputs recorded{};
    for (std::uint64_t cycle = planned_.first_cycle; cycle <= planned_.last_cycle; ++cycle) {
      if (event == cycle) {
        if (cursor.cycle() < cycle) cursor.next_event();
        in = inputs_of(cursor.values());
        recorded = outputs_of(cursor.values());
        event = cursor.next_event_cycle();
      }
      const chip::Outputs standing = before_clock(left, in);
      if (standing != recorded) fail_pins(cycle, recorded, standing);
      left = lockstep_->step(in);
      if (progress && cycle % kTellEvery == 0)
        progress(static_cast<double>(cycle - planned_.first_cycle) / clocks);
    }
    last_in_ = in;
    if (const auto flops = rtl_->differences(end_.chip); !flops.empty()) fail("end", flops, "RTL");
    if (const auto flops = flop_differences(lockstep_->model(), end_.chip); !flops.empty())
      fail("end", flops, "model");
  }

  WindowResult result(const std::string& plan) const {
    return {.file = {},
            .plan = plan,
            .window = number_,
            .first_cycle = planned_.first_cycle,
            .last_cycle = planned_.last_cycle,
            .start_state = state_hash(start_),
            .end_state = state_hash({lockstep_->cycle(), last_in_, lockstep_->model()}),
            .stimulus = planned_.stimulus,
            .flop_bits = rtl_->flop_bits(),
            .compared = lockstep_->compared(),
            .equal = false,
            .report = "",
            .host = host_name(),
            .wall_s = 0.0};
  }

 private:
  [[noreturn]] void fail(const char* where, const std::vector<FlopDifference>& flops, const char* who) const {
    throw Mismatch(
        fmt::format("MISMATCH at the {} of window {}, cycle {}: not the saved state\n{}  repeat: {}\n", where,
                    number_, lockstep_->cycle(), list_flops(flops, who), repeat_));
  }
  [[noreturn]] void fail_pins(std::uint64_t cycle, const chip::Outputs& recorded,
                              const chip::Outputs& standing) const {
    throw Mismatch(
        fmt::format("MISMATCH in window {}, cycle {}: not the recorded pins\n  pin  {}\n  repeat: {}\n",
                    number_, cycle, output_difference(recorded, standing), repeat_));
  }

  std::size_t number_;
  PlannedWindow planned_;
  SavedState start_;
  SavedState end_;
  std::string repeat_;
  recording::Stream pins_;
  VerilatedRtl* rtl_ = nullptr;  // owned by lockstep_
  std::optional<Lockstep> lockstep_;
  chip::Inputs last_in_;
};

// ---- Joining ----

// "3", "3-7": runs of numbers that follow each other.
std::string ranges(const std::vector<std::size_t>& numbers) {
  std::string text;
  for (std::size_t i = 0; i < numbers.size();) {
    std::size_t last = i;
    while (last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1) ++last;
    text += (text.empty() ? "" : ", ") +
            (last == i ? fmt::format("{}", numbers[i]) : fmt::format("{}-{}", numbers[i], numbers[last]));
    i = last + 1;
  }
  return text;
}

// Why a result can't be taken for its window; empty when it can.
std::string defect(const WindowPlan& plan, const std::string& hash, const WindowResult& r) {
  if (r.plan != hash) return "is of another plan";
  if (r.window >= plan.windows.size()) return fmt::format("is not one of the plan's {}", plan.windows.size());
  if (r.first_cycle > r.last_cycle) return "ends before it begins";
  if (r.stimulus != plan.windows[r.window].stimulus) return "ran on another stimulus";
  if (!r.equal) return "";
  const std::uint64_t clocks = r.last_cycle - r.first_cycle + 1;
  if (r.compared.clocks != clocks) return fmt::format("compared {} clocks of {}", r.compared.clocks, clocks);
  if (r.compared.pin_values == 0 || r.flop_bits == 0 || r.compared.flop_values != clocks * r.flop_bits)
    return fmt::format("compared {} pin values and {} flop values, too few", r.compared.pin_values,
                       r.compared.flop_values);
  return "";
}

// "FILE: " of a result that was read from one.
std::string place_of(const WindowResult& r) { return r.file.empty() ? "" : r.file.string() + ": "; }

std::string first_lines(const std::string& report) {
  constexpr int kLines = 3;
  std::size_t end = 0;
  for (int i = 0; i < kLines && end < report.size(); ++i)
    end = std::min(report.find('\n', end), report.size() - 1) + 1;
  return report.substr(0, end == 0 ? 0 : end - 1);
}

void add(Compared& sum, const Compared& c) {
  sum.clocks += c.clocks;
  sum.pin_values += c.pin_values;
  sum.flop_values += c.flop_values;
  sum.resets += c.resets;
  sum.frames += c.frames;
  sum.samples += c.samples;
}

class Joiner {
 public:
  Joiner(const WindowPlan& plan, const std::vector<WindowResult>& results)
      : plan_(plan), hash_(plan_hash(plan)), by_number_(plan.windows.size()) {
    joined_.windows.resize(plan.windows.size(), WindowState::missing);
    joined_.cycles = plan.cycles;
    for (const WindowResult& r : results) take(r);
  }

  JoinedWindows join() {
    report_missing();
    chain();
    joined_.whole = joined_.faults.empty() && joined_.compared.clocks == plan_.cycles && plan_.cycles > 0;
    return std::move(joined_);
  }

 private:
  void fault(std::string line) { joined_.faults.push_back(std::move(line)); }

  void take(const WindowResult& r) {
    if (const std::string why = defect(plan_, hash_, r); !why.empty()) {
      fault(fmt::format("{}window {}: its result {}", place_of(r), r.window, why));
      if (r.window < joined_.windows.size()) joined_.windows[r.window] = WindowState::unusable;
      return;
    }
    if (by_number_[r.window] != nullptr) {
      fault(fmt::format("{}window {}: more than one result; only one is counted", place_of(r), r.window));
      return;
    }
    by_number_[r.window] = &r;
    if (!r.equal) {
      joined_.windows[r.window] = WindowState::differs;
      fault(fmt::format("window {} differs: {}", r.window, first_lines(r.report)));
      return;
    }
    joined_.windows[r.window] = WindowState::equal;
    ++joined_.equal;
    add(joined_.compared, r.compared);
    if (joined_.flop_bits != 0 && joined_.flop_bits != r.flop_bits)
      fault(fmt::format("window {}: {} flop bits compared a clock, others {}", r.window, r.flop_bits,
                        joined_.flop_bits));
    joined_.flop_bits = r.flop_bits;
  }

  void report_missing() {
    std::vector<std::size_t> missing;
    for (std::size_t i = 0; i < by_number_.size(); ++i) {
      if (joined_.windows[i] == WindowState::missing) missing.push_back(i);
    }
    if (!missing.empty())
      fault(fmt::format("window{} {}: no result", missing.size() == 1 ? "" : "s", ranges(missing)));
  }

  // From reset to the last clock along the windows' own numbers; the plan's borders play no part.
  void chain() {
    std::vector<const WindowResult*> chain;
    for (const WindowResult* r : by_number_) {
      if (r != nullptr && r->equal) chain.push_back(r);
    }
    std::stable_sort(chain.begin(), chain.end(),
                     [](const auto* a, const auto* b) { return a->first_cycle < b->first_cycle; });
    std::uint64_t next = 0;
    std::string state = state_hash({});
    for (const WindowResult* r : chain) {
      if (r->first_cycle > next) {
        fault(fmt::format("gap before window {}: cycles {} to {} not checked", r->window, next,
                          r->first_cycle - 1));
      } else if (r->first_cycle < next) {
        fault(fmt::format("window {} begins at cycle {}, inside the window before it", r->window,
                          r->first_cycle));
      } else if (r->start_state != state) {
        fault(fmt::format("window {} does not start in the state that {}", r->window,
                          next == 0 ? "reset gives" : "the window before it ended in"));
      }
      next = r->last_cycle + 1;
      state = r->end_state;
    }
    if (next < plan_.cycles)
      fault(fmt::format("gap at the end: cycles {} to {} not checked", next, plan_.cycles - 1));
    if (next > plan_.cycles)
      fault(fmt::format("windows go to cycle {}, the run to {}", next - 1, plan_.cycles - 1));
  }

  const WindowPlan& plan_;
  std::string hash_;
  std::vector<const WindowResult*> by_number_;
  JoinedWindows joined_;
};

}  // namespace

namespace {

constexpr std::string_view kShare = ".share";

fs::path share_file(const fs::path& folder, std::size_t window) {
  return result_file(folder, window).replace_extension(kShare);
}

}  // namespace

std::string plan_hash(const WindowPlan& plan) { return content_hash(to_json(plan)); }

fs::path plan_file(const fs::path& folder) { return folder / "plan.json"; }
fs::path state_file(const fs::path& folder, std::size_t border) {
  return numbered(folder, "states", border, "state");
}
fs::path stimulus_file(const fs::path& folder, std::size_t window) {
  return numbered(folder, "stimulus", window, "mvec");
}
fs::path result_file(const fs::path& folder, std::size_t window) {
  return numbered(folder, "results", window, "json");
}

bool holds_plan(const fs::path& folder) {
  return fs::is_regular_file(plan_file(folder)) && is_sealed(plan_file(folder), kPlanFormat);
}

void write_plan(const fs::path& folder, const WindowPlan& plan) {
  write_sealed(plan_file(folder), kPlanFormat, to_json(plan));
}

WindowPlan read_plan(const fs::path& folder) {
  const fs::path path = plan_file(folder);
  if (!fs::exists(path)) {
    throw UserError(
        fmt::format("{}: no window plan there (no plan.json), expected the work folder of a print with "
                    "--rtl full or of \"windows plan\"",
                    folder.string()));
  }
  WindowPlan plan = with_fields(path, [&] { return plan_from(read_sealed(path, kPlanFormat)); });
  require_this_build(path, plan.made_by);
  return plan;
}

void check_files(const fs::path& folder, const WindowPlan& plan) {
  for (std::size_t i = 0; i < plan.windows.size(); ++i) {
    load_border(folder, i, plan.windows[i].start_state);
    require_stimulus(stimulus_file(folder, i), plan.windows[i].stimulus);
  }
  if (!plan.windows.empty()) load_border(folder, plan.windows.size(), plan.windows.back().end_state);
}

WindowResult check_window(const fs::path& folder, const WindowPlan& plan, std::size_t window,
                          const std::function<void(double share)>& progress) {
  if (window >= plan.windows.size()) {
    throw UserError(fmt::format("{}: found window {}, expected 0 to {}", folder.string(), window,
                                plan.windows.empty() ? 0 : plan.windows.size() - 1));
  }
  const auto begin = std::chrono::steady_clock::now();
  WindowRun run(folder, plan, window);
  std::string report;
  try {
    run.run(progress);
  } catch (const Mismatch& mismatch) {
    report = mismatch.what();
  }
  WindowResult result = run.result(plan_hash(plan));
  result.report = report;
  result.equal = report.empty();
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

void write_share(const fs::path& folder, std::size_t window, double share) {
  std::ofstream(share_file(folder, window)) << share << "\n";
}

double shares_under_way(const fs::path& folder) {
  double sum = 0.0;
  std::error_code gone;  // a file that a worker has just taken away
  for (const auto& entry : fs::directory_iterator(folder / "results", gone)) {
    if (entry.path().extension() != kShare) continue;
    double share = 0.0;
    if (std::ifstream(entry.path()) >> share) sum += std::clamp(share, 0.0, 1.0);
  }
  return sum;
}

void write_result(const fs::path& folder, const WindowResult& result) {
  // Two workers of one window must not write into one file.
  const fs::path path = result_file(folder, result.window);
  const fs::path own = path.string() + fmt::format(".{}.{}", result.host, getpid());
  fs::create_directories(path.parent_path());
  write_sealed(own, kResultFormat, to_json(result));
  fs::rename(own, path);
  fs::remove(share_file(folder, result.window));
}

ReadResults read_results(const fs::path& folder) {
  std::vector<fs::path> files;
  if (fs::exists(folder / "results")) {
    for (const auto& entry : fs::directory_iterator(folder / "results")) {
      if (entry.path().extension() == ".json") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  ReadResults read;
  for (const fs::path& file : files) {
    try {
      read.results.push_back(read_result(file));
      read.results.back().file = file;
    } catch (const UserError& error) {
      read.unreadable.push_back(error.what());
    }
  }
  return read;
}

JoinedWindows join_windows(const WindowPlan& plan, const std::vector<WindowResult>& results) {
  return Joiner(plan, results).join();
}

JoinedWindows join_folder(const fs::path& folder, const WindowPlan& plan) {
  ReadResults read = read_results(folder);
  JoinedWindows joined = join_windows(plan, read.results);
  joined.faults.insert(joined.faults.end(), read.unreadable.begin(), read.unreadable.end());
  joined.whole = joined.whole && read.unreadable.empty();
  return joined;
}

std::vector<std::size_t> windows_to_run(const fs::path& folder, const WindowPlan& plan) {
  std::vector<std::size_t> list;
  const std::string hash = plan_hash(plan);
  for (std::size_t i = 0; i < plan.windows.size(); ++i) {
    try {
      const fs::path path = result_file(folder, i);
      if (fs::exists(path)) {
        const WindowResult result = read_result(path);
        if (result.window == i && defect(plan, hash, result).empty()) continue;
      }
    } catch (const UserError&) {
      // An unreadable result counts as none: the window runs again and replaces it.
    }
    list.push_back(i);
  }
  return list;
}

}  // namespace meltstage::tb
