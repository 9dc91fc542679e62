// SPDX-License-Identifier: Apache-2.0
// route: a placed DEF becomes a routed one. Exits with 1 when a net is open or two nets share a place, with 2
// on wrong input.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "asic/layout/db/design.hpp"
#include "asic/layout/db/technology.hpp"
#include "asic/layout/layout_main.hpp"
#include "asic/layout/route/inputs.hpp"
#include "asic/layout/route/route.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"

namespace {

using namespace meltstage::layout;

constexpr std::size_t kNamesTold = 20;

void tell(std::string& text, const char* what, const std::vector<std::string>& names) {
  text += fmt::format("{}: {}\n", what, names.size());
  for (std::size_t i = 0; i < std::min(names.size(), kNamesTold); ++i)
    text += fmt::format("  {}\n", names[i]);
  if (names.size() > kNamesTold) text += fmt::format("  and {} more\n", names.size() - kNamesTold);
}

std::string report_text(const RouteReport& report, const Design& design, const Technology& technology,
                        double seconds) {
  std::string text =
      fmt::format("nets: {}\nwires: {:.1f} mm", report.nets, static_cast<double>(report.wire_nm) * 1e-6);
  for (std::size_t i = 0; i < report.wire_nm_of_layer.size(); ++i)
    if (report.wire_nm_of_layer[i] > 0)
      text += fmt::format(", {} {:.1f}", technology.layers[i].name,
                          static_cast<double>(report.wire_nm_of_layer[i]) * 1e-6);
  text += fmt::format("\nvias: {}\nrounds: {}\ntime: {:.0f} s\n", report.vias, report.rounds, seconds);
  tell(text, "pins without access", report.no_access);
  tell(text, "cells with crowded pins", report.crowded);
  tell(text, "open nets", report.open);
  tell(text, "nets in conflict", report.conflicting);
  std::vector<std::string> antenna;
  for (const AntennaFault& fault : report.antenna) antenna.push_back(antenna_text(fault, design, technology));
  tell(text, "antenna rules broken", antenna);
  text += fmt::format("antenna diodes: {}\n", report.diodes);
  return text;
}

/// Without them a SPEF would say that wires are nothing.
void require_wire_models(const Technology& technology) {
  for (const int index : technology.routing_layers()) {
    const Layer& layer = technology.layers[static_cast<std::size_t>(index)];
    if (layer.resistance_ohm <= 0.0 || (layer.area_cap_pf_um2 <= 0.0 && layer.edge_cap_pf_um <= 0.0))
      throw meltstage::UserError(
          fmt::format("--spef: found no RESISTANCE or no CAPACITANCE of layer {} in {}, expected both",
                      meltstage::shown(layer.name), technology.files));
  }
}

int run(const std::vector<std::filesystem::path>& lef, const std::filesystem::path& def,
        const std::filesystem::path& out, const std::filesystem::path& netlist,
        const std::filesystem::path& spef, const std::filesystem::path& report_path, RouteOptions options) {
  std::vector<std::filesystem::path> inputs = lef;
  inputs.push_back(def);
  meltstage::require_other_files({out, netlist, spef, report_path}, inputs);
  const Technology technology = read_lef(lef);
  Design design = read_def(def, technology);
  if (!spef.empty()) require_wire_models(technology);
  require_routable(design, technology);
  meltstage::ProgressLine line;
  options.progress = shown_on(line);
  const auto start = std::chrono::steady_clock::now();
  const RouteReport report = route(design, technology, options);
  line.clear();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::string text = report_text(report, design, technology, seconds);
  meltstage::write_all_whole({{out, def_text(design, technology)},
                              {netlist, netlist.empty() ? "" : verilog_text(design, technology)},
                              {spef, spef.empty() ? "" : routed_spef_text(design, technology, report)},
                              {report_path, text}});
  fmt::print("{}", text);
  return report.is_clean() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Routes a placed design: DEF in, DEF out", "route"};
  std::vector<std::filesystem::path> lef;
  std::filesystem::path def, out, netlist, spef, report;
  RouteOptions options;
  app.add_option("--lef", lef, "LEF files, layers first")->required();
  app.add_option("--def", def, "placed DEF")->required();
  app.add_option("--out", out, "routed DEF")->required();
  app.add_option("--netlist", netlist, "Verilog of the cells, with the diodes that were added");
  app.add_option("--spef", spef, "resistances and capacitances of the wires");
  app.add_option("--report", report, "what is printed, as a file");
  app.add_option("--rounds", options.rounds, "most rounds of rip-up")->check(CLI::Range(1, 1000));
  return meltstage::layout::layout_main(app, argc, argv,
                                        [&] { return run(lef, def, out, netlist, spef, report, options); });
}
