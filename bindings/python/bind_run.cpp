// SPDX-License-Identifier: Apache-2.0
// The chip on its heated head, by a scenario.
#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings/common/run_pins.hpp"
#include "bindings/python/errors.hpp"
#include "bindings/python/held_chip.hpp"
#include "bindings/python/in_turn.hpp"
#include "bindings/python/parts.hpp"
#include "bindings/python/without_gil.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/scenario/scripted_run.hpp"

namespace meltstage::python {

namespace py = pybind11;

namespace {

using HeldRun = Held<tb::ScriptedRun>;
using Turn = HeldRun::Turn;

constexpr std::uint64_t kClocksOfSlice = chip::spec::kClkHz / 10;

[[noreturn]] void refuse(const tb::ScenarioDefect& defect, const std::string& where) {
  throw ScenarioError(fmt::format("{}: found {}, expected {}", where, defect.found, defect.expected),
                      defect.line, defect.found, defect.expected);
}

tb::Scenario scenario_of(const std::string& text) {
  tb::ParsedScenario parsed = tb::parse_scenario(text);
  if (parsed.defect) refuse(*parsed.defect, fmt::format("scenario, line {}", parsed.defect->line));
  return std::move(parsed.scenario);
}

void until(HeldRun& held, std::uint64_t cycle) {
  const Turn run(held);
  without_gil([&] {
    run->until(std::min(cycle, run->cycle() + kClocksOfSlice));
    return run->cycle() < cycle;
  });
}

void add(HeldRun& held, const std::string& text, std::uint64_t cycle) {
  tb::ParsedEvent parsed = tb::parse_event(text, cycle);
  if (parsed.defect) refuse(*parsed.defect, "event");
  Turn(held)->add(std::move(parsed.event));
}

py::array_t<tb::TraceRow> rows(HeldRun& held) {
  const Turn run(held);
  return py::array_t<tb::TraceRow>(static_cast<py::ssize_t>(run->rows().size()), run->rows().data());
}

// Time, what, answer, bytes of request and reply, failed, line (0: none) of each.
template <class Entries>
py::list entries(const Entries& log) {
  const auto bytes = [](const std::vector<std::uint8_t>& from) {
    return py::bytes(reinterpret_cast<const char*>(from.data()), from.size());
  };
  py::list list;
  for (const tb::LogEntry& entry : log)
    list.append(py::make_tuple(entry.time_s, entry.what, entry.answer, bytes(entry.request),
                               bytes(entry.reply), entry.failed, entry.line));
  return list;
}

py::list failures(HeldRun& held) {
  const Turn run(held);
  py::list list = entries(run->failures());
  for (const py::handle entry : entries(run->unanswered())) list.append(entry);
  return list;
}

// Cycles, and the levels of all pins from there on: a column a pin.
std::pair<py::array_t<std::uint64_t>, py::array_t<std::uint8_t>> pins(HeldRun& held, std::uint64_t begin,
                                                                      std::uint64_t end) {
  const std::vector<tb::PinChange> changes = Turn(held)->pins(begin, end);
  const auto count = static_cast<py::ssize_t>(changes.size());
  py::array_t<std::uint64_t> cycles(count);
  py::array_t<std::uint8_t> levels({count, static_cast<py::ssize_t>(tb::kChipPinCount)});
  auto at = cycles.mutable_unchecked<1>();
  auto level = levels.mutable_unchecked<2>();
  for (py::ssize_t row = 0; row < count; ++row) {
    const tb::PinChange& change = changes[static_cast<std::size_t>(row)];
    at(row) = change.cycle;
    py::ssize_t pin = 0;
    for (const std::uint64_t value : bindings::levels_of(change))
      level(row, pin++) = static_cast<std::uint8_t>(value);
  }
  return {std::move(cycles), std::move(levels)};
}

void record(HeldRun& held, const std::string& path) {
  bindings::record_pins(*Turn(held), path, "meltstage.Run.record");
}

}  // namespace

void bind_run(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(tb::TraceRow, time_s, set_point_degc, reading_degc, block_degc, heater_degc,
                       duty_percent, state, faults, pin_changes, pins_hash);
  py::class_<HeldRun>(module, "Run")
      .def(py::init([](const std::string& text) { return std::make_unique<HeldRun>(scenario_of(text)); }),
           py::arg("scenario"))
      .def("until", until, py::arg("cycle"))
      .def("add", add, py::arg("event"), py::arg("cycle"))
      .def("rows", rows)
      .def("log", [](HeldRun& held) { return entries(Turn(held)->log()); })
      .def("failures", failures)
      .def("failed",
           [](HeldRun& held) {
             const Turn run(held);
             return run->failed() + run->unanswered().size();
           })
      .def("events_to_come", [](HeldRun& held) { return Turn(held)->events_to_come().size(); })
      .def("fault", [](HeldRun& held) { return Turn(held)->fault(); })
      .def("pins", pins, py::arg("begin"), py::arg("end"))
      .def("record", record, py::arg("path"))
      .def("chip", [](HeldRun& held) { return std::make_unique<HeldChip>(bindings::chip_of(*Turn(held))); })
      .def_property_readonly("cycle", [](HeldRun& held) { return Turn(held)->cycle(); });
  module.def("event_usages", [] {
    py::list list;
    for (const tb::EventUsage& usage : tb::event_usages())
      list.append(py::make_tuple(usage.word, usage.arguments, usage.summary));
    return list;
  });
}

}  // namespace meltstage::python
