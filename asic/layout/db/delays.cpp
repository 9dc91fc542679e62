// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/delays.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>

#include "asic/netlist/liberty_syntax.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

using liberty::Group;

/// Only nanoseconds and picofarads are read: a number of another unit would pass for one of these.
void require_units(const Group& library, const std::string& file) {
  const std::string time = library.text("time_unit");
  if (!time.empty() && time != "1ns")
    throw UserError(defect_at(file, library.find("time_unit")->place, "time_unit " + shown(time), "1ns"));
  const liberty::Attribute* load = library.find("capacitive_load_unit");
  if (load == nullptr) return;
  const bool is_pf = load->values.size() == 2 && number_in(load->values[0], 1.0, 1.0).has_value() &&
                     (load->values[1] == "pf" || load->values[1] == "pF");
  if (!is_pf)
    throw UserError(
        defect_at(file, load->place,
                  "capacitive_load_unit " + shown(fmt::format("{}", fmt::join(load->values, " "))), "1 pf"));
}

DelayTable table_of(const Group& library, const Group& table, const std::string& file) {
  const Group* shape = nullptr;
  for (const Group& group : library.groups) {
    if (group.name == "lu_table_template" && group.label() == table.label()) shape = &group;
  }
  const auto index = [&](const char* key) {
    const Group& said = table.find(key) == nullptr && shape != nullptr ? *shape : table;
    return said.numbers(key, file);
  };
  DelayTable result{index("index_1"), index("index_2"), table.numbers("values", file)};
  const auto is_rising = [](const std::vector<double>& axis) {
    return std::adjacent_find(axis.begin(), axis.end(), std::greater_equal<>()) == axis.end();
  };
  if (!is_rising(result.slews_ns) || !is_rising(result.loads_pf))
    throw UserError(
        defect_at(file, table.place, "an index that doesn't rise", "index_1 and index_2 that rise"));
  const bool is_by_load_first =
      shape != nullptr && shape->text("variable_1") == "total_output_net_capacitance";
  if (!is_by_load_first) return result;
  DelayTable turned{result.loads_pf, result.slews_ns, {}};
  if (result.values_ns.size() != turned.slews_ns.size() * turned.loads_pf.size()) return turned;
  for (std::size_t s = 0; s < turned.slews_ns.size(); ++s) {
    for (std::size_t l = 0; l < turned.loads_pf.size(); ++l)
      turned.values_ns.push_back(result.values_ns[l * turned.slews_ns.size() + s]);
  }
  return turned;
}

DelayPin pin_of(const Group& library, const Group& pin, const std::string& file) {
  DelayPin result;
  result.capacitance_pf = pin.number("capacitance", file);
  result.max_capacitance_pf = pin.number("max_capacitance", file);
  result.is_clock = pin.text("clock") == "true";
  result.function = pin.text("function");
  for (const Group& timing : pin.groups) {
    // an arc of one edge alone is that of an asynchronous set or reset
    const std::array<const Group*, 4> tables{
        timing.find_group("cell_rise"), timing.find_group("rise_transition"), timing.find_group("cell_fall"),
        timing.find_group("fall_transition")};
    if (timing.name != "timing" || std::count(tables.begin(), tables.end(), nullptr) > 0) continue;
    const std::string sense = timing.text("timing_sense");
    const DelayArc arc{timing.text("related_pin"),
                       table_of(library, *tables[0], file),
                       table_of(library, *tables[1], file),
                       table_of(library, *tables[2], file),
                       table_of(library, *tables[3], file),
                       sense == "positive_unate"   ? Unateness::positive
                       : sense == "negative_unate" ? Unateness::negative
                                                   : Unateness::none};
    const auto is_full = [](const DelayTable& t) {
      return !t.slews_ns.empty() && !t.loads_pf.empty() &&
             t.values_ns.size() == t.slews_ns.size() * t.loads_pf.size();
    };
    if (is_full(arc.delay) && is_full(arc.slew) && is_full(arc.fall_delay) && is_full(arc.fall_slew))
      result.arcs.push_back(arc);
  }
  return result;
}

/// The interval of an axis for a value, and how far into it the value lies.
std::pair<std::size_t, double> place_on(const std::vector<double>& axis, double value) {
  if (axis.size() < 2) return {0, 0.0};
  std::size_t k = 0;
  while (k + 2 < axis.size() && axis[k + 1] <= value) ++k;
  return {k, (value - axis[k]) / (axis[k + 1] - axis[k])};
}

}  // namespace

double DelayTable::at(double slew_ns, double load_pf) const {
  const auto [s, u] = place_on(slews_ns, slew_ns);
  const auto [l, v] = place_on(loads_pf, load_pf);
  const auto value = [&](std::size_t i, std::size_t j) {
    return values_ns[std::min(i, slews_ns.size() - 1) * loads_pf.size() + std::min(j, loads_pf.size() - 1)];
  };
  return (1 - u) * ((1 - v) * value(s, l) + v * value(s, l + 1)) +
         u * ((1 - v) * value(s + 1, l) + v * value(s + 1, l + 1));
}

Delays parse_delays(std::string_view text, const std::string& name) {
  const Group library = liberty::parse(text, name);
  require_units(library, name);
  Delays delays;
  for (const Group& cell : library.groups) {
    if (cell.name != "cell") continue;
    DelayCell& result = delays[cell.label()];
    result.is_flop = cell.find_group("ff") != nullptr;
    result.is_clock_gate = cell.find("clock_gating_integrated_cell") != nullptr;
    for (const Group& pin : cell.groups) {
      if (pin.name != "pin") continue;
      for (const std::string& pin_name : pin.arguments) result.pins[pin_name] = pin_of(library, pin, name);
    }
  }
  if (delays.empty()) throw UserError(fmt::format("{}: found no cell, expected a Liberty library", name));
  return delays;
}

Delays read_delays(const std::filesystem::path& path) {
  return parse_delays(read_file(path, "a Liberty file"), path.string());
}

}  // namespace meltstage::layout
