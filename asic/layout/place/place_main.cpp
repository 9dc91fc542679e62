// SPDX-License-Identifier: Apache-2.0
// Places a netlist of library cells: writes DEF, Verilog and a summary.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "asic/layout/db/fixed_metal.hpp"
#include "asic/layout/layout_main.hpp"
#include "asic/layout/place/drivers.hpp"
#include "asic/layout/place/place.hpp"
#include "asic/layout/place/rails.hpp"
#include "asic/layout/place/spef.hpp"
#include "asic/layout/place/trees.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/number.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"

namespace {

using namespace meltstage::layout;

struct Options {
  std::vector<std::filesystem::path> lef;
  std::filesystem::path netlist;
  std::filesystem::path again;
  std::filesystem::path def;
  std::filesystem::path verilog;
  double utilization = 0.7;
  double density = 0.9;
  double margin_um = 10.0;
  int passes = 6;
  std::string fillers;
  std::string strap_layer;
  double strap_width_um = 2.0;
  double strap_pitch_um = 50.0;
  std::filesystem::path spef;
  std::filesystem::path liberty;
  std::string clock;
  std::vector<std::string> buffers;
  std::vector<std::string> tie_high;
  std::vector<std::string> tie_low;
  double leaf_load_pf = 0.2;
  std::size_t fanout = 40;
  DriverOptions drivers;
};

/// Of the processor.
double seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Nm nm(double um) { return std::llround(um * 1000.0); }

/// A row of the summary.
void print(const char* what, const std::string& value, const char* unit) {
  fmt::print("{}\t{}\t{}\n", what, value, unit);
}

/// What the library doesn't say of a cell would count as nothing.
void require_delays(const Design& design, const Technology& technology, const Delays& delays,
                    const std::string& file) {
  bool has_flop = false;
  for (const Component& component : design.components) {
    const Macro& macro = technology.macros[static_cast<std::size_t>(component.macro)];
    const auto cell = delays.find(macro.name);
    if (cell == delays.end())
      throw meltstage::UserError(fmt::format("{}: found no cell {}, expected each cell of the netlist", file,
                                             meltstage::shown(macro.name)));
    has_flop = has_flop || cell->second.is_flop || cell->second.is_clock_gate;
    for (const MacroPin& pin : macro.pins) {
      if (pin.direction != PinDirection::input || is_supply(pin.use)) continue;
      const auto its = cell->second.pins.find(pin.name);
      if (its == cell->second.pins.end() || its->second.capacitance_pf <= 0.0)
        throw meltstage::UserError(fmt::format("{}: cell {}: found no capacitance of pin {}, expected one",
                                               file, meltstage::shown(macro.name),
                                               meltstage::shown(pin.name)));
    }
  }
  if (!has_flop)
    throw meltstage::UserError(fmt::format(
        "{}: found no flop (ff) and no clock gate among the cells of {}, expected some for --clock", file,
        design.file));
}

/// The same netlist, nothing placed, without cells that only fill and without pins of supplies.
Design not_placed(const Design& from, const Technology& technology) {
  Design to;
  to.name = from.name;
  to.file = from.file;
  std::vector<int> component(from.components.size(), -1);
  std::vector<int> pin(from.pins.size(), -1);
  for (const Net& net : from.nets) {
    Net copy;
    copy.name = net.name;
    copy.use = net.use;
    for (const PinRef& ref : net.pins) {
      const auto k = static_cast<std::size_t>(ref.component == kDiePin ? ref.pin : ref.component);
      int& index = ref.component == kDiePin ? pin[k] : component[k];
      if (index < 0 && ref.component == kDiePin) {
        index = static_cast<int>(to.pins.size());
        to.pins.push_back({from.pins[k].name,
                           static_cast<int>(to.nets.size()),
                           from.pins[k].direction,
                           Use::signal,
                           false,
                           {},
                           from.pins[k].where});
      } else if (index < 0) {
        index = static_cast<int>(to.components.size());
        to.components.push_back(
            {from.components[k].name, from.components[k].macro, {}, Orientation::N, false, false});
      }
      copy.pins.push_back(ref.component == kDiePin ? PinRef{kDiePin, index} : PinRef{index, ref.pin});
    }
    to.nets.push_back(std::move(copy));
  }
  make_floorplan(to, technology, {1.0, 0});
  return to;
}

/// Places the cells of a finished layout again on rows of the same area, and prints both wirelengths.
int place_again(const Options& o) {
  const Technology technology = read_lef(o.lef);
  const Design theirs = read_def(o.again, technology);
  Design ours = not_placed(theirs, technology);
  if (theirs.components.empty())
    throw meltstage::UserError(o.again.string() + ": found no COMPONENTS, expected a placed design");
  Rect box = outline(theirs.components.front(), technology);
  for (const Component& c : theirs.components) {
    const Rect r = outline(c, technology);
    box = {std::min(box.x0, r.x0), std::min(box.y0, r.y0), std::max(box.x1, r.x1), std::max(box.y1, r.y1)};
  }
  double cells = 0.0;
  for (const Component& c : ours.components) {
    const Rect r = outline(c, technology);
    cells += um(r.width()) * um(r.height());
  }
  const double used = cells / (um(box.width()) * um(box.height()));
  if (used > 1.0)
    throw meltstage::UserError(fmt::format(
        "{}: found cells of {:.3g} times the area that they lie in, expected cells that don't overlap",
        theirs.file, used));
  make_floorplan(ours, technology, {used, 0});
  meltstage::ProgressLine line;
  place_globally(ours, technology, {.progress = shown_on(line)});
  legalize(ours, technology);
  improve(ours, technology, o.passes, shown_on(line));
  line.clear();
  const std::vector<std::string> errors = placement_errors(ours, technology);
  const double before = um(wirelength(theirs, technology)) / 1000;
  const double now = um(wirelength(ours, technology)) / 1000;
  print("cells", fmt::format("{}", ours.components.size()), "");
  print("utilization of the rows", fmt::format("{:.1f}", 100 * utilization(ours, technology)), "%");
  print("wirelength of the file", fmt::format("{:.2f}", before), "mm");
  print("wirelength placed again", fmt::format("{:.2f}", now), "mm");
  print("ratio", fmt::format("{:.3f}", now / before), "");
  print("placement errors", fmt::format("{}", errors.size()), "");
  return errors.empty() ? 0 : 1;
}

int run(const Options& o) {
  std::vector<std::filesystem::path> inputs = o.lef;
  for (const auto& input : {o.netlist, o.again, o.liberty})
    if (!input.empty()) inputs.push_back(input);
  meltstage::require_other_files({o.def, o.spef, o.verilog}, inputs);
  if (!o.again.empty()) return place_again(o);
  const double start = seconds();
  const Technology technology = read_lef(o.lef);
  Design design = read_netlist(o.netlist, technology);
  if (design.components.empty())
    throw meltstage::UserError(
        fmt::format("{}: found no cells, expected a mapped netlist with at least one", o.netlist.string()));
  if (!o.tie_high.empty()) add_ties(design, technology, Use::power, o.tie_high.at(0), o.tie_high.at(1));
  if (!o.tie_low.empty()) add_ties(design, technology, Use::ground, o.tie_low.at(0), o.tie_low.at(1));
  require_like_rails(design, technology);
  make_floorplan(design, technology, {o.utilization, nm(o.margin_um)});
  Delays delays;
  if (!o.clock.empty()) {
    delays = read_delays(o.liberty);
    require_delays(design, technology, delays, o.liberty.string());
    mark_clock(design, technology, delays, o.clock);
  }
  GlobalPlacement global;
  global.density = o.density;
  meltstage::ProgressLine line;
  global.progress = shown_on(line);
  place_globally(design, technology, global);
  const double spread = static_cast<double>(wirelength(design, technology)) / 1e6;
  int fanout_buffers = 0;
  SizedDrivers sized;
  ClockTree tree;
  TreeOptions trees;
  trees.buffers = o.buffers;
  trees.leaf_load_pf = o.leaf_load_pf;
  if (!o.clock.empty()) {
    fanout_buffers =
        buffer_nets(design, technology, delays, o.clock, o.fanout, o.drivers.most_slew_ns, trees);
    sized = size_drivers(design, technology, delays, o.clock, o.drivers, trees);
    tree = build_clock_tree(design, technology, delays, o.clock, trees);
  }
  const double used = utilization(design, technology);
  const std::size_t cells = design.components.size();
  legalize(design, technology);
  const double legal = static_cast<double>(wirelength(design, technology)) / 1e6;
  improve(design, technology, o.passes, shown_on(line));
  if (!o.clock.empty()) {
    balance_clock(design, technology, delays, o.clock, trees);
    legalize(design, technology);
  }
  const double improved = static_cast<double>(wirelength(design, technology)) / 1e6;
  if (!o.fillers.empty()) add_fillers(design, technology, o.fillers);
  if (!o.strap_layer.empty())
    add_power_grid(design, technology, {o.strap_layer, nm(o.strap_width_um), nm(o.strap_pitch_um)});
  line.clear();
  std::vector<std::string> errors = placement_errors(design, technology);
  for (std::string& fault : supply_faults(design, technology)) errors.push_back(std::move(fault));
  for (std::string& fault : die_pin_faults(design, technology)) errors.push_back(std::move(fault));
  for (const std::string& error : errors) fmt::print(stderr, "{}\n", error);
  const auto mm2 = [](Nm x, Nm y) { return static_cast<double>(x) * static_cast<double>(y) / 1e6; };
  print("cells placed", fmt::format("{}", cells), "");
  print("die", fmt::format("{:.1f} x {:.1f}", um(design.die.x1), um(design.die.y1)), "um");
  print("area of the die", fmt::format("{:.0f}", mm2(design.die.x1, design.die.y1)), "um2");
  print("area of the core (rows)", fmt::format("{:.0f}", core_area(design, technology) / 1e6), "um2");
  print("utilization of the rows", fmt::format("{:.1f}", 100 * used), "%");
  print("half-perimeter wirelength", fmt::format("{:.2f}", improved), "mm");
  print("the same before improvement", fmt::format("{:.2f}", legal), "mm");
  print("the same before legal sites", fmt::format("{:.2f}", spread), "mm");
  if (!o.clock.empty()) {
    const ClockTree now = measure_clock(design, technology, delays, o.clock);
    print("flops on the clock", fmt::format("{}", now.sinks), "");
    print("buffers of the clock tree", fmt::format("{}", tree.buffers), "");
    print("levels of the clock tree", fmt::format("{}", now.levels), "");
    print("clock latency (Elmore)", fmt::format("{:.3f}", now.latency_ns), "ns");
    print("clock skew (Elmore)", fmt::format("{:.3f}", now.skew_ns), "ns");
    print("buffers in nets of many inputs", fmt::format("{}", fanout_buffers), "");
    print("drivers made stronger", fmt::format("{}", sized.resized), "");
    print("drivers helped by a buffer", fmt::format("{}", sized.buffered), "");
  }
  print("processor time of placement", fmt::format("{:.1f}", seconds() - start), "s");
  print("placement errors", fmt::format("{}", errors.size()), "");
  meltstage::write_all_whole({{o.def, o.def.empty() ? "" : def_text(design, technology)},
                              {o.spef, o.spef.empty() ? "" : spef_text(design, technology)},
                              {o.verilog, o.verilog.empty() ? "" : verilog_text(design, technology)}});
  return errors.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  const auto within = [](double least, double most) {
    return [=](const std::string& text) {
      return meltstage::number_in(text, least, most)
                 ? std::string()
                 : fmt::format("found {}, expected a number from {:g} to {:g}", meltstage::shown(text), least,
                               most);
    };
  };
  constexpr double kMostUm = 1e5, kMostNs = 1e6;
  CLI::App app{"Places a netlist of library cells", "place"};
  app.add_option("--lef", o.lef, "LEF files, technology first")->required();
  auto* input = app.add_option_group("input");
  input->add_option("--netlist", o.netlist, "netlist (Yosys write_json)");
  auto* again =
      input->add_option("--again", o.again, "DEF whose cells are placed again, to compare wirelengths");
  input->require_option(1);
  app.add_option("--def", o.def, "placed design to write");
  app.add_option("--verilog", o.verilog, "its netlist to write");
  app.add_option("--utilization", o.utilization, "area of the cells over that of the rows")
      ->check(within(0.01, 1));
  app.add_option("--density", o.density, "highest share of a region that cells may take")
      ->check(within(0.01, 1));
  app.add_option("--margin", o.margin_um, "from the edge to the rows, um")->check(within(0, kMostUm));
  app.add_option("--passes", o.passes, "of improvement")->check(CLI::Range(0, 1000));
  app.add_option("--fillers", o.fillers, "first letters of the fillers' names");
  app.add_option("--strap-layer", o.strap_layer, "layer of the power straps");
  app.add_option("--strap-width", o.strap_width_um, "um")->check(within(0.001, kMostUm));
  app.add_option("--strap-pitch", o.strap_pitch_um, "um, from pair to pair")->check(within(0.001, kMostUm));
  app.add_option("--spef", o.spef, "expected wires to write");
  auto* liberty = app.add_option("--liberty", o.liberty, "delays of the cells");
  auto* buffers = app.add_option("--buffers", o.buffers, "cells for trees, weakest first");
  app.add_option("--clock", o.clock, "port of the clock: its tree and those of large nets are built")
      ->needs(liberty)
      ->needs(buffers);
  app.add_option("--leaf-load", o.leaf_load_pf, "what a buffer of a tree drives at most, pF")
      ->check(within(1e-6, 1e3));
  app.add_option("--fanout", o.fanout, "most inputs on a net without a tree")
      ->check(CLI::Range(2, 1'000'000));
  app.add_option("--most-slew", o.drivers.most_slew_ns, "slowest edge before a driver is made stronger, ns")
      ->check(within(1e-6, kMostNs));
  app.add_option("--most-path", o.drivers.most_path_ns,
                 "longest path from flop to flop before drivers on it are made stronger, ns (typical corner)")
      ->check(within(1e-6, kMostNs));
  app.add_option("--tie-high", o.tie_high, "cell and pin that give a 1")->expected(2);
  app.add_option("--tie-low", o.tie_low, "cell and pin that give a 0")->expected(2);
  // what is placed again is measured, not written
  for (CLI::Option* option : app.get_options())
    if (option != again && !option->check_name("--help") && !option->check_name("--lef") &&
        !option->check_name("--passes"))
      again->excludes(option);
  return meltstage::layout::layout_main(app, argc, argv, [&] { return run(o); });
}
