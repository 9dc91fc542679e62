// SPDX-License-Identifier: Apache-2.0
#include <pybind11/pybind11.h>

#include "bindings/python/parts.hpp"

PYBIND11_MODULE(_core, module) {
  using namespace meltstage::python;
  module.attr("__version__") = MELTSTAGE_VERSION;
  bind_errors(module);
  bind_spec(module);
  bind_chip(module);
  bind_run(module);
  bind_motion(module);
  bind_recording(module);
}
