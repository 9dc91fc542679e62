// SPDX-License-Identifier: Apache-2.0
#include "app/print/print.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

#include "app/command_line.hpp"
#include "app/print/job_plan.hpp"
#include "app/print/print_folder.hpp"
#include "app/print/report/report.hpp"
#include "base/build_stamp.hpp"
#include "base/count.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"
#include "recording/text.hpp"
#include "recording/vcd.hpp"
#include "tb/windows/window_plan.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;

// Plays one recording into several sinks.
class Tee final : public recording::Sink {
 public:
  void add(recording::Sink& sink) { sinks_.push_back(&sink); }
  void begin(const recording::Header& header) override {
    for (recording::Sink* sink : sinks_) sink->begin(header);
  }
  void change(const recording::Change& change) override {
    for (recording::Sink* sink : sinks_) sink->change(change);
  }
  void end(std::uint64_t final_cycle) override {
    for (recording::Sink* sink : sinks_) sink->end(final_cycle);
  }

 private:
  std::vector<recording::Sink*> sinks_;
};

double setpoint_degc(const tb::PrintJob& job) {
  for (const tb::RegisterValue& r : job.registers) {
    if (r.reg == spec::kRegSetpoint) return static_cast<std::int16_t>(r.value) * 0.1;
  }
  return spec::kHolding[spec::kRegSetpoint].reset * 0.1;
}

constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

// NaN for a phase that the print didn't come to.
double phase_length_s(const tb::PrintResult& result, std::string_view name) {
  for (const tb::PhaseTime& phase : result.phases) {
    if (phase.name == name) return phase.end_s - phase.begin_s;
  }
  return kNotMeasured;
}

// At temperature the print begins; a heat-up that ends otherwise didn't get there.
double heat_up_s(const tb::PrintResult& result) {
  return std::isnan(phase_length_s(result, "print")) ? kNotMeasured : phase_length_s(result, "heat-up");
}

std::string seconds_or_none(double time_s) {
  return std::isnan(time_s) ? "none" : fmt::format("{:.1f} s", time_s);
}

// Largest distance from the set-point while printing, degC; NaN without a reading.
double largest_error_while_printing(const tb::PrintResult& result) {
  double worst = kNotMeasured;
  for (const tb::PhaseTime& phase : result.phases) {
    if (phase.name != "print") continue;
    for (const tb::Reading& r : result.readings) {
      if (r.t_s >= phase.begin_s && r.t_s <= phase.end_s)
        worst = std::fmax(worst, std::abs(r.reading_degc - r.setpoint_degc));
    }
  }
  return worst;
}

double overshoot_degc(const tb::PrintResult& result, double setpoint) {
  double peak = kNotMeasured;
  for (const tb::Reading& r : result.readings) peak = std::fmax(peak, r.reading_degc);
  return std::isnan(peak) ? peak : std::max(0.0, peak - setpoint);
}

Path path_of(const std::vector<motion::Point>& points, double cost) {
  Path path{.points = {}, .cost = cost};
  for (const motion::Point& p : points) path.points.push_back({p.x_mm, p.y_mm});
  return path;
}

std::vector<NamedText> settings_of(const LoadedJob& loaded, const PrintOptions& options) {
  const tb::PrintJob& job = loaded.job;
  std::vector<NamedText> settings{
      {"Command", options.command},
      {"Coordinates",
       fmt::format("{}, {}", loaded.coordinates.filename().string(), counted(job.bumps.size(), "bump"))},
      {"Plant", std::string(job.head.plant.name)},
      {"Sensor", fmt::format("{}, noise {} degC", job.head.sensor, job.head.sensor_noise_degc)},
      {"Path metric", loaded.plan_metric},
      {"Printing", job.fly_by ? "on the fly" : "stop at each bump"},
      {"Moves", !job.stage.quiet ? "as fast as the limits allow"
                : job.fly_by     ? "quiet but for the rows on the fly"
                                 : "quiet"},
      {"Seed", fmt::format("{}", job.head.seed)},
  };
  if (loaded.alignment)
    settings.push_back(
        {"Alignment",
         fmt::format(
             "{}, within {:.6g} um, stage {}", counted(loaded.alignment->marks_mm.size(), "mark"),
             1e3 * loaded.alignment->limits.place_mm,
             loaded.alignment->knowledge == tb::StageKnowledge::nominal ? "as drawn" : "calibrated")});
  for (const tb::RegisterValue& r : job.registers) {
    const spec::RegisterInfo& info = spec::kHolding[r.reg];
    const double raw = info.is_signed ? static_cast<std::int16_t>(r.value) : r.value;
    settings.push_back({std::string(info.name), fmt::format("{:.6g} {}", raw * info.scale, info.unit)});
  }
  return settings;
}

// The board of the job, brought to where the print expects it; nothing if the job has no [alignment].
// Throws UserError if that can't be.
std::optional<tb::AlignedBoard> align_board(const LoadedJob& loaded, const PrintOptions& options) {
  if (!loaded.alignment) return std::nullopt;
  if (options.align == nullptr) continue_as("meltstage-aligned");
  try {
    ProgressLine line;
    return options.align(*loaded.alignment, shown_on(line));
  } catch (const motion::MotionError& error) {
    throw UserError(fmt::format("{}: [alignment]: {}", options.job.string(), error.what()));
  }
}

PrintReport make_report(const LoadedJob& loaded, const std::optional<tb::AlignedBoard>& board,
                        const tb::PrintResult& result, const PrintOptions& options) {
  const double setpoint = setpoint_degc(loaded.job);
  const auto of_droplets = [&](double value) { return result.droplets == 0 ? kNotMeasured : value; };
  PrintReport report;
  report.job = loaded.job.name;
  report.date = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::chrono::system_clock::now()));
  report.versions = {
      {"meltstage", version()}, {"Verilator", verilator_version()}, {"Compiler", compiler_version()}};
  report.good = result.good;
  report.verdict = result.verdict;
  report.key_figures = {
      {"Set-point", setpoint, "degC"},
      {"Time from RUN to at-temperature", heat_up_s(result), "s"},
      {"Overshoot", overshoot_degc(result, setpoint), "degC"},
      {"Largest error while printing", largest_error_while_printing(result), "degC"},
      {"Peak of the heater node", result.peak_heater_degc, "degC"},
      {"Heater energy", result.heater_energy_j, "J"},
      {"Droplets", static_cast<double>(result.droplets), ""},
      {"Print time", phase_length_s(result, "print"), "s"},
      {"Path, file order", loaded.plan.cost_before, loaded.plan_unit},
      {"Path, planned", loaded.plan.cost_after, loaded.plan_unit},
      {"Path, lower bound", loaded.plan.lower_bound, loaded.plan_unit},
      {"Path, at most above the cheapest", most_above_cheapest_percent(loaded.plan), "%"},
      {"Stops and moves, file order", loaded.moves_before_s, "s"},
      {loaded.rows_s ? "Rows on the fly, planned" : "Stops and moves, planned",
       loaded.rows_s.value_or(loaded.moves_after_s), "s"},
      {"Homing", result.homing_s > 0.0 ? result.homing_s : kNotMeasured, "s"},
      {"Largest miss of a droplet", of_droplets(1e3 * result.largest_miss_mm), "um"},
      {"Mean miss of a droplet", of_droplets(1e3 * result.mean_miss_mm), "um"},
      {"Miss of a good droplet, at most", 1e3 * loaded.job.place_tolerance_mm, "um"},
      {"Droplets beyond that", of_droplets(static_cast<double>(result.misplaced)), ""},
      {"Chip clocks", static_cast<double>(result.cycles), ""},
      {"Modbus frames accepted", static_cast<double>(result.frames), ""},
  };
  if (board) {
    const auto& looks = board->result.looks;
    report.key_figures.push_back({"Board marks off, first look", 1e3 * looks.front().worst_mm, "um"});
    report.key_figures.push_back({"Board marks off, aligned", 1e3 * looks.back().worst_mm, "um"});
    report.key_figures.push_back({"Moves of the alignment", static_cast<double>(looks.size() - 1), ""});
  }
  for (const tb::Reading& r : result.readings) {
    report.temperature.push_back(
        {r.t_s, r.reading_degc, r.heater_degc, r.run ? r.setpoint_degc : kNotMeasured});
    report.duty.push_back({r.t_s, r.duty});
  }
  for (const tb::PhaseTime& p : result.phases) report.phases.push_back({p.name, p.begin_s, p.end_s});
  report.path_before = path_of(loaded.bumps_in_file_order, loaded.plan.cost_before);
  report.path_after = path_of(loaded.job.bumps, loaded.plan.cost_after);
  report.path_unit = loaded.plan_unit;
  report.path_bound = loaded.plan.lower_bound;
  for (const tb::Landed& landed : result.landed)
    report.droplets.push_back({landed.bump, landed.t_s, 1e3 * landed.miss_mm.x(), 1e3 * landed.miss_mm.y()});
  report.good_miss_um = 1e3 * loaded.job.place_tolerance_mm;
  for (const tb::CheckedWindow& w : result.windows) {
    report.lockstep.push_back({w.name, w.first_cycle, w.last_cycle, w.compared.clocks, w.flop_bits,
                               w.compared.flop_values + w.compared.pin_values, 0});
  }
  for (const tb::PrintFault& f : result.faults) report.faults.push_back({f.t_s, f.sentence});
  report.settings = settings_of(loaded, options);
  return report;
}

const char* to_text(tb::WindowState state) {
  switch (state) {
    case tb::WindowState::missing:
      return "missing";
    case tb::WindowState::equal:
      return "equal";
    case tb::WindowState::differs:
      return "differs";
    case tb::WindowState::unusable:
      return "unusable";
  }
  return "";
}

// Runs of white space become one space.
std::string in_one_line(const std::string& text) {
  std::istringstream words(text);
  std::string line;
  for (std::string word; words >> word;) line += (line.empty() ? "" : " ") + word;
  return line;
}

// The check of the whole job, as part of the report and of its verdict.
void add_windows(PrintReport& report, const CheckedRun& run) {
  const tb::JoinedWindows& joined = run.joined;
  WindowCheck check{.whole = joined.whole,
                    .windows = {},
                    .equal = joined.equal,
                    .cycles = joined.cycles,
                    .clocks = joined.compared.clocks,
                    .flop_values = joined.compared.flop_values,
                    .pin_values = joined.compared.pin_values,
                    .clock_hz = spec::kClkHz,
                    .faults = joined.faults,
                    .lost_workers = run.notes,
                    .workers = run.workers,
                    .wall_s = run.wall_s};
  for (std::size_t i = 0; i < run.plan.windows.size(); ++i) {
    const tb::PlannedWindow& w = run.plan.windows[i];
    check.windows.push_back(
        {w.first_cycle, w.last_cycle, to_text(joined.windows[i]), w.start_state, w.end_state});
  }
  const auto differing = std::count(joined.windows.begin(), joined.windows.end(), tb::WindowState::differs);
  report.lockstep.push_back({fmt::format("whole job in {} windows", check.windows.size()), 0,
                             joined.cycles == 0 ? 0 : joined.cycles - 1, check.clocks, joined.flop_bits,
                             check.flop_values + check.pin_values, static_cast<std::uint64_t>(differing)});
  if (!joined.whole) {
    report.good = false;
    report.verdict += "; RTL and model: " + in_one_line(joined.faults.front());
  }
  report.windows = std::move(check);
}

// Before the print: what a user may not expect of it.
void tell_of_job(const LoadedJob& loaded) {
  for (const std::string& note : loaded.notes) fmt::print("note: {}\n", note);
  if (loaded.rows_s && *loaded.rows_s > loaded.moves_after_s)
    fmt::print(
        "note: on the fly the rows take {:.2f} s, with a stop at each bump {:.2f} s: mode = \"stop\" is "
        "sooner\n",
        *loaded.rows_s, loaded.moves_after_s);
}

// Events that the job was over before.
void tell_of_events(const tb::PrintJob& job, const tb::PrintResult& result) {
  const double over_s = static_cast<double>(result.cycles) / spec::kClkHz;
  for (const tb::PrintEvent& event : job.events)
    if (event.at_s > over_s)
      fmt::print("note: the [[event]] at {:.6g} s never came: the job was over at {:.1f} s\n", event.at_s,
                 over_s);
}

/// Whether the board lies as it has to, after the stage has moved it. A job without marks has none to align.
bool lies_well(LoadedJob& loaded, const std::optional<tb::AlignedBoard>& board, const PrintOptions& options) {
  if (!board) return true;
  const auto& looks = board->result.looks;
  const auto aligned =
      fmt::format("board marks {:.1f} um off, {:.1f} um after {} move{}, wanted {:.1f} um",
                  1e3 * looks.front().worst_mm, 1e3 * looks.back().worst_mm, looks.size() - 1,
                  looks.size() == 2 ? "" : "s", 1e3 * loaded.alignment->limits.place_mm);
  if (!board->result.aligned) {
    on_stderr(fmt::format("meltstage: {}: [alignment]: {}; nothing printed, nothing written\n",
                          options.job.string(), aligned));
    return false;
  }
  fmt::print("{}: {}\n", loaded.job.name, aligned);
  if (motion::looks_the_same_flipped(loaded.alignment->marks_mm, loaded.alignment->limits.board_mm))
    fmt::print(
        "note: these marks look the same with the board turned over or round; one more mark would tell\n");
  loaded.job.board = board->place;
  return true;
}

/// The print on the simulated machine; its pins go to the folder's files and to `planner`.
tb::PrintResult simulate(const LoadedJob& loaded, const PrintFolder& folder, const PrintOptions& options,
                         tb::WindowPlanner* planner) {
  recording::TextWriter text(folder.file("pins.mvec"));
  std::optional<recording::VcdWriter> vcd;
  Tee sink;
  sink.add(text);
  if (options.vcd) sink.add(vcd.emplace(folder.file("pins.vcd"), recording::BusForm::bits));
  if (planner != nullptr) sink.add(*planner);
  ProgressLine line;
  std::optional<double> first_degc;
  const double wanted_degc = setpoint_degc(loaded.job);
  const std::size_t bumps = loaded.job.bumps.size();
  return tb::run_print(loaded.job, sink, [&](const tb::PrintProgress& p) {
    throw_if_interrupted();
    if (!first_degc) first_degc = p.reading_degc;
    const std::string detail = fmt::format("{:.1f} s, {:.2f} degC of {:.1f}, {} of {} droplets", p.t_s,
                                           p.reading_degc, wanted_degc, p.droplets, bumps);
    if (p.phase == "heat-up")
      line.show_share(p.phase, (p.reading_degc - *first_degc) / (wanted_degc - *first_degc), detail);
    else if (p.phase == "print")
      line.show_share(p.phase, static_cast<double>(p.droplets) / static_cast<double>(bumps), detail);
    else
      line.show(fmt::format("{}  {}", p.phase, detail));
  });
}

void tell_of_lockstep(const PrintReport& report) {
  std::uint64_t clocks = 0, comparisons = 0;
  for (const LockstepWindow& w : report.lockstep) {
    clocks += w.clocks;
    comparisons += w.comparisons;
  }
  fmt::print("lockstep: {}, {} clocks, {} values compared, 0 mismatches\n",
             counted(report.lockstep.size(), "window"), clocks, comparisons);
}

void tell_of_print(const LoadedJob& loaded, const tb::PrintResult& result, const PrintReport& report) {
  fmt::print("{}: {}\n", escaped(loaded.job.name), report.verdict);
  fmt::print(
      "path {:.3f} {} in file order, {:.3f} {} planned, at most {:.2f} % above the cheapest; heat-up {}; "
      "print {}; {} chip clocks\n",
      loaded.plan.cost_before, loaded.plan_unit, loaded.plan.cost_after, loaded.plan_unit,
      most_above_cheapest_percent(loaded.plan), seconds_or_none(heat_up_s(result)),
      seconds_or_none(phase_length_s(result, "print")), result.cycles);
  tell_of_events(loaded.job, result);
}

}  // namespace

int print_job(const PrintOptions& options) {
  LoadedJob loaded = [&] {
    ProgressLine line;
    return load_job(options.job, [&](double share) { line.show_share("planning the path", share); });
  }();
  if (options.rtl) loaded.job.rtl = *options.rtl;
  if (loaded.job.rtl != tb::RtlWindows::full && !options.for_full_rtl.empty()) {
    throw UserError(
        fmt::format("{}: is for the full job in RTL; add --rtl full or leave it out", options.for_full_rtl));
  }
  tell_of_job(loaded);
  loaded.job.identity = {loaded.job.name, loaded.job.head.seed, options.command};
  loaded.job.failures = options.out.string() + ".failures";

  const std::optional<tb::AlignedBoard> board = align_board(loaded, options);
  if (!lies_well(loaded, board, options)) return 1;

  require_outside(options.out, loaded.inputs);
  catch_interrupts();
  PrintFolder folder(options.out);
  const std::filesystem::path work =
      options.work.empty() ? std::filesystem::path(options.out.string() + ".windows") : options.work;
  std::optional<tb::WindowPlanner> planner;
  if (loaded.job.rtl == tb::RtlWindows::full) {
    planner.emplace(work, tb::WindowRunName{loaded.job.name, loaded.job.head.seed}, options.borders);
  }
  tb::PrintResult result;
  std::optional<CheckedRun> checked;
  try {
    result = simulate(loaded, folder, options, planner ? &*planner : nullptr);
    if (planner) {
      planner->publish();
      checked = check_run(work, options.windows);
    }
  } catch (const Interrupted&) {
    on_stderr("meltstage: interrupted; nothing written\n");
    if (std::filesystem::exists(tb::plan_file(work)) && planner)
      on_stderr(
          fmt::format("{}: windows checked so far; the same command goes on from there\n", work.string()));
    return 1;
  } catch (const tb::Mismatch& mismatch) {
    on_stderr(mismatch.what());
    return 1;
  }
  PrintReport report = make_report(loaded, board, result, options);
  if (checked) add_windows(report, *checked);
  write_report(folder.file("report.html"), report);
  write_whole(folder.file("summary.json"), summary_json(report));
  folder.publish();

  tell_of_print(loaded, result, report);
  if (!checked) {
    tell_of_lockstep(report);
  } else {
    fmt::print("{}", describe(*checked));
    if (!checked->joined.whole)
      fmt::print("work folder: {}\n", escaped(work.string()));
    else if (options.work.empty())
      std::filesystem::remove_all(work);
  }
  fmt::print("page: {}\n", escaped((options.out / "report.html").string()));
  return report.good ? 0 : 1;
}

}  // namespace meltstage::app
