// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "app/number_range.hpp"
#include "app/print/job_file.hpp"
#include "app/verbs.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"
#include "motion/surface/conformal.hpp"
#include "motion/surface/conformal_trial.hpp"
#include "motion/surface/measuring_points.hpp"
#include "motion/surface/print_program.hpp"
#include "motion/surface/trial_calibration.hpp"

namespace meltstage::app {

namespace {

enum class Rule { spline, chord, even };

// How the points are chosen; probe and print have to be told the same.
struct Choice {
  Rule rule = Rule::spline;
  motion::SplineChoice spline;
  double chord_error_mm = 0.02;
  double capability = 1.33;
  double confidence = 0.95;
};

struct Settings {
  std::filesystem::path tool_path, touches, probe_program, out;
  std::string unit;  // of the tool path's numbers, where it says none; empty: not given
  Choice choice;
  motion::ProbeProgramOptions probe;
  motion::ReconstructionOptions reconstruction;
  std::optional<double> effective_radius_mm;
  bool as_published = false, measured_again = false;
  motion::PrintProgramOptions print;
  std::vector<double> heights_mm;
  std::vector<double> probe_station_mm, head_station_mm, tilt_centre_mm, rotary_centre_mm, tilt_limits_deg,
      rotary_limits_deg;
  std::uint64_t seed = 1;
  std::uint64_t starts = 0;
};

constexpr int kFitIterations = 160, kLastIterations = 200;

std::vector<motion::MeasuringPoint> choose(const motion::ClLine& line, const Choice& choice) {
  if (choice.rule == Rule::spline) return choose_by_spline(line, choice.spline);
  const std::vector<Eigen::Vector3d> points = positions_mm(line);
  return measuring_points(
      line, choice.rule == Rule::chord
                ? motion::choose_by_chord(points, choice.chord_error_mm)
                : motion::choose_evenly(points,
                                        motion::measuring_point_count(choice.capability, choice.confidence)));
}

std::vector<motion::ProbeLine> probe_lines(const std::vector<motion::ClLine>& lines, const Settings& s) {
  Choice choice = s.choice;
  choice.spline.ball_radius_mm = s.probe.ball_radius_mm;
  std::vector<motion::ProbeLine> out;
  for (const motion::ClLine& line : lines) {
    try {
      out.push_back({line.name, choose(line, choice)});
    } catch (const motion::MotionError& error) {
      throw motion::MotionError(fmt::format("{}: {}", line.name, error.what()));
    }
  }
  return out;
}

// Of an option's number; a program with one beyond would fail the machine, or never end.
void require(const char* option, double value, double least, double most) {
  if (!(value >= least && value <= most))
    throw UserError(fmt::format("{}: found {:g}, expected {:g} to {:g}", option, value, least, most));
}

void require_place(const char* option, const std::vector<double>& value_mm) {
  constexpr double kFarthest_mm = 1e4;
  for (const double value : value_mm) require(option, value, -kFarthest_mm, kFarthest_mm);
}

void check_choice(const Settings& s) {
  const Choice& c = s.choice;
  require("--tolerance", c.spline.tolerance_mm, 1e-4, 10.0);
  require("--wavelength", c.spline.form_wavelength_mm, 0.01, 1e4);
  require("--placement", c.spline.placement_mm, 1e-4, 100.0);
  require("--chord-error", c.chord_error_mm, 1e-4, 10.0);
  require("--ball-radius", s.probe.ball_radius_mm, 0.01, 100.0);
  require("--approach", s.probe.approach_mm, 0.01, 1000.0);
  require("--overtravel", s.probe.overtravel_mm, 0.01, 1000.0);
}

void check_probe(const Settings& s) {
  check_choice(s);
  require("--touch-feed", s.probe.touch_mm_min, 0.1, 1e4);
  require_place("--safe-z", {s.probe.safe_z_mm});
  require_place("--station", s.probe_station_mm);
  const std::string& name = s.probe.points_file;  // it stands in a comment, (PROBEOPEN name)
  const bool fits = std::all_of(name.begin(), name.end(), [](char c) {
    return c != '(' && c != ')' && static_cast<unsigned char>(c) >= 0x20;
  });
  if (!fits || name.find_first_not_of(' ') == std::string::npos)
    throw UserError(fmt::format(
        "--points-file: found \"{}\", expected the name of a file, without brackets and control characters",
        shown(name)));
}

// The probe triggers a little behind the contact, by a few to a hundred micrometres: so much smaller, or on a
// badly measured ball larger, is the effective radius. Beyond that the number is another: a slipped decimal
// point, a diameter, another ball.
void check_effective_radius(const Settings& s) {
  if (!s.effective_radius_mm) return;
  const double nominal_mm = s.probe.ball_radius_mm, away_mm = std::min(0.2, 0.5 * nominal_mm);
  if (!(std::abs(*s.effective_radius_mm - nominal_mm) <= away_mm))
    throw UserError(
        fmt::format("--effective-radius: found {:g} mm, expected {:g} to {:g} mm: pre-travel makes it differ "
                    "little from the ball's radius (--ball-radius, {:g} mm)",
                    *s.effective_radius_mm, nominal_mm - away_mm, nominal_mm + away_mm, nominal_mm));
}

void check_print(const Settings& s) {
  check_choice(s);
  check_effective_radius(s);
  require("--noise", s.reconstruction.noise_mm, 0.0, 10.0);
  for (const double height_mm : s.heights_mm) require("--height", height_mm, 1e-3, 1000.0);
  require("--feed", s.print.feed_mm_s, 1e-3, 1e4);
  require("--rotary-speed", s.print.rotary_deg_s, 1e-3, 1e5);
  require("--axis-speed", s.print.linear_mm_s, 1e-3, 1e5);
  require("--normal-acceleration", s.print.normal_acceleration_mm_s2, 1e-3, 1e7);
  require("--singular", s.print.singular_deg, 0.0, 45.0);
  require("--on-delay", s.print.on_delay_s, 0.0, 3600.0);
  require("--off-delay", s.print.off_delay_s, 0.0, 3600.0);
  require("--retract", s.print.retract_mm, 1e-3, 1e4);
  require_place("--safe-z", {s.print.safe_z_mm});
  require_place("--station", s.head_station_mm);
  require_place("--tilt-centre", s.tilt_centre_mm);
  require_place("--rotary-centre", s.rotary_centre_mm);
  constexpr double kMostTurned_deg = 1e6;
  for (const double limit : s.tilt_limits_deg) require("--tilt-limits", limit, -180.0, 180.0);
  for (const double limit : s.rotary_limits_deg)
    require("--rotary-limits", limit, -kMostTurned_deg, kMostTurned_deg);
}

void take(const std::vector<double>& from, Eigen::Vector3d& to) {
  if (!from.empty()) to = {from[0], from[1], from[2]};
}

void take(const std::vector<double>& from, motion::Range& to) {
  if (!from.empty()) to = {from[0], from[1]};
}

std::vector<motion::ClLine> read_path(const Settings& s) {
  std::optional<double> unit_mm;
  if (!s.unit.empty()) {
    unit_mm = motion::length_unit_mm(s.unit);
    if (!unit_mm)
      throw UserError(
          fmt::format("--unit: found \"{}\", expected mm, um, cm, m, inch or mil", shown(s.unit)));
  }
  return motion::read_tool_path(s.tool_path, unit_mm);
}

int write_probe(Settings& s) {
  check_probe(s);
  take(s.probe_station_mm, s.probe.station_offset_mm);
  require_other_file(s.out, {s.tool_path});
  const auto lines = read_path(s);
  const auto points = probe_lines(lines, s);
  write_whole(s.out, write_probe_program(points, s.tool_path.filename().string(), s.probe));
  std::size_t all = 0;
  for (const motion::ProbeLine& line : points) {
    fmt::print("{:<20} {:>4} points on {:.3f} mm\n", line.name, line.points.size(),
               line.points.back().length_mm);
    all += line.points.size();
  }
  for (const motion::ClLine& line : lines)
    for (const std::string& note : notes_on_ramps(line)) fmt::print("note: {}\n", note);
  fmt::print("{}: {} touches on {} lines\n", escaped(s.out.string()), all, points.size());
  return 0;
}

// A line for each touch that its neighbours contradict.
std::string suspects_told(const std::vector<motion::RealLine>& real,
                          const std::vector<motion::ProbeLine>& points) {
  std::string text;
  for (std::size_t i = 0; i < real.size(); ++i)
    for (const motion::SuspectTouch& suspect : real[i].suspects) {
      const Eigen::Vector3d& at = points[i].points[suspect.touch].position_mm;
      text += fmt::format(
          "{}: touch {} of {} at X{:.3f} Y{:.3f} Z{:.3f}: {:+.0f} um off what its neighbours say\n",
          real[i].name, suspect.touch + 1, points[i].points.size(), at.x(), at.y(), at.z(),
          1e3 * suspect.off_mm);
    }
  return text;
}

int write_print(Settings& s) {
  check_print(s);
  take(s.head_station_mm, s.print.station_offset_mm);
  take(s.tilt_centre_mm, s.print.table.tilt_centre_mm);
  take(s.rotary_centre_mm, s.print.table.rotary_centre_mm);
  take(s.tilt_limits_deg, s.print.table.tilt_deg);
  take(s.rotary_limits_deg, s.print.table.rotary_deg);
  require_other_file(s.out, {s.tool_path, s.touches, s.probe_program});
  const auto lines = read_path(s);
  std::vector<double> heights = s.heights_mm;
  if (heights.empty()) heights = {0.1};
  if (heights.size() == 1) heights.assign(lines.size(), heights[0]);
  const auto points = probe_lines(lines, s);
  constexpr std::uint64_t kMostProgramBytes = std::uint64_t{1} << 28;
  require_probe_program(s.probe_program.string(),
                        read_file(s.probe_program, "the program that probe wrote", kMostProgramBytes), points,
                        s.probe);
  // The nominal radius places the touches; the effective one takes the surface out of them.
  s.reconstruction.ball_radius_mm = s.effective_radius_mm.value_or(s.probe.ball_radius_mm);
  s.reconstruction.tolerance_mm = s.choice.spline.tolerance_mm;
  const auto touches = assign_touches(points, motion::read_touches(s.touches), s.probe);
  std::vector<motion::RealLine> real;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    real.push_back(s.as_published
                       ? reconstruct_as_published(lines[i], points[i], touches[i], s.reconstruction)
                       : reconstruct(lines[i], points[i], touches[i], s.reconstruction));
  }
  if (const std::string suspects = suspects_told(real, points); !suspects.empty() && !s.measured_again) {
    fmt::print("{}{}: not written; measure these touches again, or say --measured-again if they were\n",
               suspects, s.out.string());
    return 1;
  }
  write_whole(s.out, write_print_program(real, s.tool_path.filename().string(), s.print, heights));
  fmt::print("{:<20} {:>8} {:>12} {:>14} {:>12}\n", "line", "touches", "shift um", "largest um", "error um");
  for (std::size_t i = 0; i < real.size(); ++i) {
    const motion::RealLine& line = real[i];
    const std::string untouched =
        line.untouched_faces == 0 ? "" : fmt::format(" {} faces too short to touch", line.untouched_faces);
    const std::string unjudged =
        line.unjudged_faces == 0
            ? ""
            : fmt::format(" not known on {} faces of fewer than 5 touches", line.unjudged_faces);
    fmt::print("{:<20} {:>8} {:>+12.1f} {:>14.1f} {:>12}{}{}{}{}\n", line.name, points[i].points.size(),
               1e3 * line.shift_mean_mm, 1e3 * line.shift_largest_mm,
               line.estimated_error_mm ? fmt::format("{:.1f}", 1e3 * *line.estimated_error_mm) : "-",
               line.smoothed ? " smoothed" : "", untouched, unjudged,
               line.estimated_error_mm > s.choice.spline.tolerance_mm
                   ? " over the tolerance: choose a shorter --wavelength"
                   : "");
  }
  fmt::print("{}: {} lines\n", escaped(s.out.string()), real.size());
  return 0;
}

// The paper's part, as its CAM system has it and as a probe finds it.
int write_trial(const Settings& s) {
  check_choice(s);
  for (const char* name : {"lines.apt", "points.txt"})
    if (const auto file = s.out / name; std::filesystem::exists(std::filesystem::symlink_status(file)))
      throw UserError(
          fmt::format("{}: is there already; give another folder by --out, or remove it", file.string()));
  std::error_code error;
  std::filesystem::create_directories(s.out, error);
  if (error)
    throw UserError(fmt::format("{}: can't be made, found \"{}\", expected a place for a folder",
                                s.out.string(), error.message()));
  const auto lines = motion::trial_lines();
  std::string apt = "PARTNO/free-form part, nine lines\nUNITS/MM\nMULTAX\n";
  for (const motion::ClLine& line : lines) {
    apt += fmt::format("TOOL PATH/{}\nRAPID\n", line.name);
    for (const motion::ClPoint& p : line.points)
      apt += fmt::format("GOTO/{:.6f},{:.6f},{:.6f},{:.8f},{:.8f},{:.8f}\n", p.position_mm.x(),
                         p.position_mm.y(), p.position_mm.z(), p.axis.x(), p.axis.y(), p.axis.z());
  }
  apt += "FINI\n";
  const auto points = probe_lines(lines, s);
  const motion::RealPart part = motion::make_trial_part({}, s.seed);
  motion::TouchProbe probe(motion::TouchProbeModel{}, s.seed);
  std::string touches;
  for (const Eigen::Vector3d& p : touch_all(part, points, s.probe, probe))
    touches += fmt::format("{:.6f} {:.6f} {:.6f} 0 0 0 0 0 0\n", p.x(), p.y(), p.z());
  write_all_whole({{s.out / "lines.apt", apt}, {s.out / "points.txt", touches}});
  fmt::print("{}: lines.apt (nine lines), points.txt (touches; effective ball radius {:.4f} mm)\n",
             s.out.string(), effective_radius_mm(motion::TouchProbeModel{}));
  return 0;
}

motion::TrialFit fit_shown(const std::string& what, const motion::TrialFit& start, int iterations) {
  ProgressLine line;
  return fit_first_group(start, iterations, [&](double share) { line.show_share(what, share); });
}

void print_fit(const motion::TrialFit& fit, const std::string& whence) {
  const auto after =
      run_trial(make_trial_part(fit.error), motion::Compensation::as_published, fit.deposition, 1);
  double mean_ohm = 0.0;
  for (const motion::TrialLineResult& line : after)
    mean_ohm += line.resistance_ohm / static_cast<double>(after.size());
  fmt::print(
      "objective {:.3f}, of it the first group {:.3f}; {:.3f} ohm after the paper's compensation: {}\n",
      fit.objective, fit.misfit, mean_ohm, whence);
}

// How the numbers in deposition.hpp and paper_error() came about.
int calibrate(const Settings& s) {
  motion::TrialFit best = motion::assess_fit({}, motion::paper_error());
  print_fit(best, "as stored");
  for (std::uint64_t seed = 1; seed <= s.starts; ++seed) {
    const motion::TrialFit fit =
        fit_shown(fmt::format("fit {} of {}", seed, s.starts), motion::draw_start(seed), kFitIterations);
    print_fit(fit, fmt::format("from start {}", seed));
    if (seed == 1 || fit.objective < best.objective) best = fit;
  }
  // Again from where it stands, as the damping starts anew, until that gains nothing.
  for (double before = INFINITY; before - best.objective > 0.01;) {
    before = best.objective;
    best = fit_shown("fit from the best", best, kLastIterations);
  }
  print_fit(best, "best");
  const motion::DepositionModel& d = best.deposition;
  fmt::print(
      "section_mm2 {:.6g}\nslit_gap_mm {:.6g}\nstringing_gap_mm {:.6g}\n"
      "stringing_mm {:.6g}\n"
      "least_share {:.6g}\nthinning {:.6g}\nresistivity_ohm_mm {:.6g}\nend_excess {:.6g}\nend_mm {:.6g}\n"
      "width_noise_mm {:.6g}\nmodes, um:\n",
      d.section_mm2, d.slit_gap_mm, d.stringing_gap_mm, d.stringing_mm, d.least_share, d.thinning,
      d.resistivity_ohm_mm, d.end_excess, d.end_mm, d.width_noise_mm);
  for (int i = 0; i < motion::FaceError::kAlong; ++i) {
    for (int j = 0; j < motion::FaceError::kAcross; ++j)
      fmt::print("{:.3f},{}", 1e3 * best.error.modes_mm(i, j),
                 j + 1 == motion::FaceError::kAcross ? "\n" : " ");
  }
  return 0;
}

void add_choice_options(CLI::App* command, Settings& s) {
  Choice& c = s.choice;
  command->add_option("--rule", c.rule, "Points: spline (default), chord (the paper's), even (eq. (1))")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Rule>{
          {"spline", Rule::spline}, {"chord", Rule::chord}, {"even", Rule::even}}));
  command->add_option("--tolerance", c.spline.tolerance_mm, "spline: of the rebuilt line, mm (0.02)");
  command->add_option("--wavelength", c.spline.form_wavelength_mm,
                      "spline: shortest wavelength of the form error, mm (8)");
  command->add_option("--placement", c.spline.placement_mm,
                      "spline: how far beside its place the part may lie, mm (0.2)");
  command->add_option("--chord-error", c.chord_error_mm, "chord: mm (0.02)");
  command->add_option("--capability", c.capability, "even: process capability K (1.33)");
  command->add_option("--confidence", c.confidence, "even: gamma (0.95)");
  command->add_option("--ball-radius", s.probe.ball_radius_mm, "Nominal radius of the probe's ball, mm (1)");
  command->add_option("--approach", s.probe.approach_mm, "Where a touch begins off the surface, mm (2)");
  command->add_option("--overtravel", s.probe.overtravel_mm, "How far below it a touch may go, mm (2)");
}

void add_path_options(CLI::App* command, Settings& s, const char* what) {
  command->add_option("PATH", s.tool_path, what)->required();
  command->add_option("--unit", s.unit, "Of the path's numbers, if it says none: mm, um, cm, m, inch, mil");
}

CLI::Option* add_vector(CLI::App* command, const char* name, std::vector<double>& value, const char* what,
                        int size = 3) {
  return command->add_option(name, value, what)->delimiter(',')->expected(size);
}

}  // namespace

Action add_conformal_command(CLI::App& cli, const std::string&) {
  const auto s = std::make_shared<Settings>();
  CLI::App* command =
      cli.add_subcommand("conformal", "Print on a measured surface (docs/motion/conformal.md)");
  command->require_subcommand(1);

  CLI::App* probe =
      command->add_subcommand("probe", "Write the program that measures the lines of a tool path");
  show_example(probe, "conformal probe part/lines.apt --out probe.ngc");
  add_path_options(probe, *s, "Tool path: .apt, .cls, .ngc, .nc, .csv");
  probe->add_option("--out", s->out, "Program to write")->required();
  add_choice_options(probe, *s);
  probe->add_option("--touch-feed", s->probe.touch_mm_min, "mm/min (60)");
  probe->add_option("--safe-z", s->probe.safe_z_mm, "Height between lines, mm (50)");
  probe->add_option("--points-file", s->probe.points_file, "File the control writes (points.txt)");
  add_vector(probe, "--station", s->probe_station_mm, "Offset of the probe on the spindle X,Y,Z, mm");

  CLI::App* print = command->add_subcommand("print", "Write the program that prints on the measured lines");
  show_example(print, "conformal print part/lines.apt part/points.txt --probe probe.ngc --out print.ngc");
  add_path_options(print, *s, "Tool path that was measured");
  print->add_option("POINTS", s->touches, "What the probe program wrote")->required();
  print
      ->add_option("--probe", s->probe_program,
                   "The probe program, for the points and the ball it touched with")
      ->required();
  print->add_option("--out", s->out, "Program to write")->required();
  add_choice_options(print, *s);
  print->add_option("--effective-radius", s->effective_radius_mm,
                    "Of the ball, calibrated with the pre-travel in it, mm (the nominal one)");
  print->add_option("--noise", s->reconstruction.noise_mm, "Standard deviation of a touch, mm (0)");
  print->add_flag("--measured-again", s->measured_again,
                  "Touches that stand out from their neighbours were measured again, and stand");
  print->add_flag("--as-published", s->as_published, "NURBS through the touches alone, as in the paper");
  print->add_option("--height", s->heights_mm, "Of the tip over the surface, mm; one, or one a line (0.1)")
      ->delimiter(',');
  print->add_option("--feed", s->print.feed_mm_s, "Of the tip, mm/s (5)");
  print->add_option("--rotary-speed", s->print.rotary_deg_s, "Largest of a rotary axis, degrees/s (30)");
  print->add_option("--axis-speed", s->print.linear_mm_s, "Largest of a linear axis, mm/s (100)");
  print->add_option("--normal-acceleration", s->print.normal_acceleration_mm_s2,
                    "Of the tip where the line bends, mm/s2 (500)");
  print->add_option("--rtcp", s->print.rtcp, "Who follows the tip: post (X Y Z of the machine), control")
      ->transform(CLI::CheckedTransformer(std::map<std::string, motion::PrintProgramOptions::Rtcp>{
          {"post", motion::PrintProgramOptions::Rtcp::post},
          {"control", motion::PrintProgramOptions::Rtcp::control}}));
  print->add_option("--tilt-axis", s->print.table.tilt, "a (about x) or b (about y)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, motion::TwinRotaryTable::Tilt>{
          {"a", motion::TwinRotaryTable::Tilt::a}, {"b", motion::TwinRotaryTable::Tilt::b}}));
  add_vector(print, "--tilt-centre", s->tilt_centre_mm, "A point of the tilting axis X,Y,Z, mm");
  add_vector(print, "--rotary-centre", s->rotary_centre_mm, "A point of the turning axis X,Y,Z, mm");
  print
      ->add_option("--tilt-sign", s->print.table.tilt_sign,
                   "1: turns right-handed (as LinuxCNC's trt kinematics), -1: the other way")
      ->check(CLI::IsMember({1, -1}));
  print->add_option("--rotary-sign", s->print.table.rotary_sign, "1 or -1")->check(CLI::IsMember({1, -1}));
  add_vector(print, "--tilt-limits", s->tilt_limits_deg, "From,to in degrees (-100,100)", 2);
  add_vector(print, "--rotary-limits", s->rotary_limits_deg, "From,to in degrees (-3600,3600)", 2);
  print->add_option("--singular", s->print.singular_deg, "Cone in which C is led through, degrees (0.5)");
  print->add_option("--on-delay", s->print.on_delay_s, "From opening the valve until paste flows, s (0.05)");
  print->add_option("--off-delay", s->print.off_delay_s, "From closing it until none flows, s (0.05)");
  print->add_option("--retract", s->print.retract_mm, "Along the tool before and after a line, mm (5)");
  print->add_option("--safe-z", s->print.safe_z_mm, "Of the machine between lines, mm (80)");
  print->add_option("--output", s->print.pressure_output, "Digital output of the valve (0)");
  add_vector(print, "--station", s->head_station_mm, "Offset of the head on the spindle X,Y,Z, mm");

  CLI::App* trial = command->add_subcommand(
      "trial", "Write the tool path and the touches of a simulated part, to try it out");
  show_example(trial, "conformal trial --out part");
  trial->add_option("--out", s->out, "Folder to write")->required();
  add_choice_options(trial, *s);
  trial->add_option("--seed", s->seed, "Of the part's errors and the probe's noise (1)")
      ->check(whole_number_from(0, UINT64_MAX));

  CLI::App* calibration = command->add_subcommand(
      "calibrate", "Fit deposition model and part to the paper's first group, from the stored numbers");
  show_example(calibration, "conformal calibrate");
  calibration->add_option("--starts", s->starts, "Search from so many drawn starts instead (0)")
      ->check(whole_number_from(0, 100'000));

  return [=] {
    try {
      if (*calibration) return calibrate(*s);
      if (*probe) return write_probe(*s);
      if (*print) return write_print(*s);
      return write_trial(*s);
    } catch (const motion::MotionError& error) {
      throw UserError(*trial ? std::string(error.what())
                             : fmt::format("{}: {}", s->tool_path.string(), error.what()));
    } catch (const motion::ArgumentError& error) {
      throw UserError(error.naming(error.argument() == "unit_mm" ? "--unit" : "--ball-radius"));
    } catch (const motion::CoordinateError& error) {
      throw UserError(error.what());
    }
  };
}

}  // namespace meltstage::app
