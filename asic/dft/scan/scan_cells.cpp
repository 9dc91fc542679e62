// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/scan_cells.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"

namespace meltstage::dft {

namespace {

using Op = Expression::Op;

}  // namespace

const Cell* find_cell(const CellLibrary& library, const std::string& type) {
  const auto found = library.find(type);
  return found == library.end() ? nullptr : &found->second;
}

std::string only_pin(const Expression& e) {
  if (e.op == Op::pin) return e.pin;
  if (e.op == Op::inv && e.args[0].op == Op::pin) return e.args[0].pin;
  return "";
}

MuxCell find_mux(const CellLibrary& library, const std::string& file) {
  for (const auto& [name, cell] : library) {
    if (cell.flop || !cell.defect.empty() || cell.pins.size() != 4) continue;
    for (const CellPin& out : cell.pins) {
      if (!out.is_output || !out.function || out.function->op != Op::any || out.function->args.size() != 2)
        continue;
      MuxCell mux{&cell, "", "", "", out.name};
      for (const Expression& side : out.function->args) {
        if (side.op != Op::all || side.args.size() != 2) continue;
        for (std::size_t i = 0; i < 2; ++i) {
          const Expression &control = side.args[i], &data = side.args[1 - i];
          if (control.op == Op::inv && only_pin(control) != "" && data.op == Op::pin) {
            mux.select = only_pin(control);
            mux.zero = data.pin;
          }
        }
      }
      for (const CellPin& pin : cell.pins) {
        if (!pin.is_output && pin.name != mux.select && pin.name != mux.zero) mux.one = pin.name;
      }
      if (!mux.select.empty() && !mux.one.empty()) return mux;
    }
  }
  throw UserError(
      fmt::format("{}: found no two-way multiplexer in the library, expected one for scan", file));
}

std::optional<BufferCell> find_buffer(const CellLibrary& library) {
  std::optional<BufferCell> best;
  for (const auto& [name, cell] : library) {
    if (cell.flop || cell.gate || cell.has_latch || !cell.defect.empty() || cell.pins.size() != 2) continue;
    for (const CellPin& pin : cell.pins) {
      if (!pin.is_output || !pin.function || pin.function->op != Op::pin) continue;
      if (!best || cell.area < best->cell->area) best = BufferCell{&cell, pin.function->pin, pin.name};
    }
  }
  return best;
}

const Cell* scan_form(const CellLibrary& library, const Cell& plain) {
  const Cell* best = nullptr;
  for (const auto& [name, cell] : library) {
    if (!cell.scan || !cell.flop || cell.has_latch || !cell.defect.empty()) continue;
    if (!(cell.scan->next_state == plain.flop->next_state) ||
        !(cell.flop->clocked_on == plain.flop->clocked_on) || cell.flop->clear != plain.flop->clear ||
        cell.flop->preset != plain.flop->preset)
      continue;
    const bool same_pins =
        std::all_of(plain.pins.begin(), plain.pins.end(),
                    [&form = cell](const CellPin& pin) { return form.find(pin.name) != nullptr; });
    if (same_pins && (best == nullptr || cell.area < best->area)) best = &cell;
  }
  return best;
}

const Cell* testable_form(const CellLibrary& library, const Cell& plain) {
  const Cell* best = nullptr;
  for (const auto& [name, cell] : library) {
    if (cell.gate && cell.defect.empty() && !cell.gate->test.empty() &&
        (best == nullptr || cell.area < best->area))
      best = &cell;
  }
  return plain.gate->test.empty() ? best : &plain;
}

}  // namespace meltstage::dft
