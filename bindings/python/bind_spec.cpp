// SPDX-License-Identifier: Apache-2.0
// What the chip is: names, units and codes of spec/, as tuples that meltstage/spec.py makes tables of.
#include <pybind11/pybind11.h>

#include "bindings/python/parts.hpp"
#include "cmodel/spec.hpp"
#include "tb/pins/flop_table.hpp"
#include "tb/scenario/scenario.hpp"

namespace meltstage::python {

namespace py = pybind11;
namespace spec = chip::spec;

namespace {

py::list pins() {
  py::list list;
  for (const spec::PinInfo& pin : spec::kPins) list.append(py::make_tuple(pin.name, pin.width, pin.output));
  return list;
}

// Name, unit, address, value of one step, sign, readable, writable, least and greatest word.
py::list registers() {
  py::list list;
  for (std::size_t i = 0; i < spec::kInputCount; ++i) {
    const spec::InputInfo& reg = spec::kInput[i];
    list.append(py::make_tuple(reg.name, reg.unit, i, reg.scale, reg.is_signed, true, false, 0, 0));
  }
  for (std::size_t i = 0; i < spec::kHoldingCount; ++i) {
    const spec::RegisterInfo& reg = spec::kHolding[i];
    list.append(py::make_tuple(reg.name, reg.unit, spec::kHoldingBase + i, reg.scale, reg.is_signed,
                               reg.readable, true, reg.min, reg.max));
  }
  return list;
}

py::list flops() {
  py::list list;
  for (const tb::Flop* flop : tb::flops_in_order()) {
    if (flop != nullptr) list.append(py::make_tuple(tb::name_of(*flop), flop->place, flop->changeable));
  }
  return list;
}

template <class Table, class Entry>
py::dict dictionary(const Table& table, Entry&& entry) {
  py::dict made;
  for (const auto& one : table) {
    const auto [key, value] = entry(one);
    made[py::cast(key)] = value;
  }
  return made;
}

}  // namespace

void bind_spec(py::module_& module) {
  module.attr("CLOCK_HZ") = spec::kClkHz;
  module.attr("PV_NONE") = spec::kPvNone;
  module.attr("PINS") = pins();
  module.attr("REGISTERS") = registers();
  module.attr("FLOPS") = flops();
  module.attr("STATES") = dictionary(
      spec::kStates, [](const spec::StateInfo& state) { return std::pair(int{state.code}, state.name); });
  module.attr("COMMANDS") = dictionary(tb::kHostCommands, [](const tb::HostCommand& command) {
    return std::pair(command.name, static_cast<int>(command.code));
  });
  py::list faults;
  for (const spec::FaultInfo& fault : spec::kFaults) faults.append(py::make_tuple(fault.name, fault.doc));
  module.attr("FAULTS") = faults;
}

}  // namespace meltstage::python
