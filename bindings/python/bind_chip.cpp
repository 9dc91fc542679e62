// SPDX-License-Identifier: Apache-2.0
// The chip's model, clock by clock.
#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <span>
#include <string>
#include <vector>

#include "bindings/python/errors.hpp"
#include "bindings/python/held_chip.hpp"
#include "bindings/python/parts.hpp"
#include "bindings/python/without_gil.hpp"
#include "cmodel/host_access.hpp"
#include "host/exception_text.hpp"
#include "host/register_word.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/pins/fault_sentence.hpp"
#include "tb/pins/flop_table.hpp"

namespace meltstage::python {

namespace py = pybind11;
namespace spec = chip::spec;

namespace {

using Turn = HeldChip::Turn;

constexpr std::uint64_t kClocksOfSlice = 100'000;      // some milliseconds, clock by clock
constexpr std::uint64_t kSkippedOfSlice = 12'000'000;  // as long where most clocks are skipped

void step(HeldChip& held, std::uint64_t clocks) {
  const Turn chip(held);
  in_parts(clocks, kClocksOfSlice, [&](std::uint64_t begin, std::uint64_t end) { chip->step(end - begin); });
}

void advance(HeldChip& held, std::uint64_t clocks) {
  const Turn chip(held);
  in_parts(clocks, kSkippedOfSlice,
           [&](std::uint64_t begin, std::uint64_t end) { chip->advance(end - begin); });
}

using Levels = py::array_t<std::uint8_t, py::array::c_style>;

// A row of `levels` a clock, a column each of `pins`; returns the output pins behind each clock.
Levels drive(HeldChip& held, const std::vector<std::uint32_t>& pins, const Levels& levels) {
  const auto given = levels.unchecked<2>();
  if (given.shape(1) != static_cast<py::ssize_t>(pins.size()))
    throw std::invalid_argument("drive: found a column too many or too few");
  for (const std::uint32_t pin : pins) {
    if (pin >= spec::kInputPins) throw std::invalid_argument("drive: found an output pin");
  }
  Levels outputs({given.shape(0), static_cast<py::ssize_t>(spec::kOutputPins)});
  auto made = outputs.mutable_unchecked<2>();
  const Turn chip(held);
  auto standing = tb::pin_levels(chip->in, {});
  in_parts(static_cast<std::uint64_t>(given.shape(0)), kClocksOfSlice,
           [&](std::uint64_t begin, std::uint64_t end) {
             for (auto clock = static_cast<py::ssize_t>(begin); clock < static_cast<py::ssize_t>(end);
                  ++clock) {
               for (std::size_t i = 0; i < pins.size(); ++i)
                 standing[pins[i]] = given(clock, static_cast<py::ssize_t>(i));
               chip->in = tb::inputs_of(standing);
               const auto after = tb::pin_levels(chip->in, chip->chip.step(chip->in));
               for (std::uint32_t i = 0; i < spec::kOutputPins; ++i)
                 made(clock, i) = static_cast<std::uint8_t>(after[spec::kInputPins + i]);
             }
             chip->cycle += end - begin;
           });
  return outputs;
}

std::uint64_t pin(HeldChip& held, std::uint32_t number) { return Turn(held)->pin(number); }

void set_pin(HeldChip& held, std::uint32_t number, std::uint64_t level) {
  if (number >= spec::kInputPins) throw std::invalid_argument("set_pin: found an output pin");
  Turn(held)->set_pin(number, level);
}

const tb::Flop& flop_at(std::size_t place) {
  const tb::Flop* flop = tb::flops_in_order().at(place);
  if (flop == nullptr) throw std::invalid_argument("flop: found a word without flops");
  return *flop;
}

std::uint64_t flop(HeldChip& held, std::size_t place) {
  const Turn chip(held);
  const tb::Flop& found = flop_at(place);
  return found.get(chip->chip, found.word);
}

void set_flops(HeldChip& held, const std::vector<std::pair<std::size_t, std::uint64_t>>& values) {
  const Turn chip(held);
  for (const auto& [place, value] : values) {
    const tb::Flop& found = flop_at(place);
    found.set(chip->chip, found.word, value & found.changeable);
  }
  chip->chip.mem.refresh_params();
}

void require_done(spec::Exception answer, const std::string& asked) {
  if (answer != spec::kExcNone)
    throw Refused(fmt::format("{}: the chip refuses with exception {}: {}", asked, static_cast<int>(answer),
                              host::exception_text(answer)),
                  answer);
}

std::uint16_t host_read(HeldChip& held, std::uint16_t address, const std::string& asked) {
  const Turn chip(held);
  std::array<std::uint16_t, 1> word{};
  require_done(chip::host_read(chip->chip, address, word), asked);
  return word[0];
}

void host_write(HeldChip& held, std::uint16_t address, std::uint16_t word, const std::string& asked) {
  const Turn chip(held);
  require_done(chip::host_write(chip->chip, address, std::array{word}), asked);
}

// The word of a holding register, and why there is none; one of them is empty.
std::pair<std::uint16_t, std::string> register_word(std::uint16_t address, double value) {
  const auto word = host::register_word(spec::kHolding.at(address - spec::kHoldingBase), value);
  return {word.word, word.expected};
}

py::list differences(HeldChip& held, HeldChip& other) {
  const Turn one(held), two(other);
  py::list list;
  tb::for_each_changed(one->chip, two->chip, [&](const tb::Flop& found) {
    list.append(py::make_tuple(tb::name_of(found), found.get(one->chip, found.word),
                               found.get(two->chip, found.word)));
  });
  return list;
}

}  // namespace

void bind_chip(py::module_& module) {
  py::class_<HeldChip>(module, "Chip")
      .def(py::init<>())
      .def("step", step, py::arg("clocks"))
      .def("advance", advance, py::arg("clocks"))
      .def("drive", drive, py::arg("pins"), py::arg("levels"))
      .def("pin", pin, py::arg("number"))
      .def("set_pin", set_pin, py::arg("number"), py::arg("level"))
      .def("flop", flop, py::arg("place"))
      .def("set_flops", set_flops, py::arg("values"))
      .def("differences", differences, py::arg("other"))
      .def(
          "peek",
          [](HeldChip& held, std::uint16_t address) { return Turn(held)->chip.read_register(address); },
          py::arg("address"))
      .def("host_read", host_read, py::arg("address"), py::arg("asked"))
      .def("host_write", host_write, py::arg("address"), py::arg("word"), py::arg("asked"))
      .def("copy", [](HeldChip& held) { return std::make_unique<HeldChip>(*Turn(held)); })
      .def("fault", [](HeldChip& held) { return tb::latched_fault(Turn(held)->chip, "Now"); })
      .def_property_readonly("state", [](HeldChip& held) { return int{Turn(held)->chip.sysctrl.state_q}; })
      .def_property(
          "cycle", [](HeldChip& held) { return Turn(held)->cycle; },
          [](HeldChip& held, std::uint64_t cycle) { Turn(held)->cycle = cycle; });
  module.def("register_word", register_word, py::arg("address"), py::arg("value"));
}

}  // namespace meltstage::python
