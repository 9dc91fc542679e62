// SPDX-License-Identifier: Apache-2.0
// The parts of the module. They take what meltstage/*.py has checked already.
#pragma once

#include <pybind11/pybind11.h>

namespace meltstage::python {

void bind_errors(pybind11::module_& module);
void bind_spec(pybind11::module_& module);
void bind_chip(pybind11::module_& module);
void bind_run(pybind11::module_& module);
void bind_motion(pybind11::module_& module);
void bind_recording(pybind11::module_& module);

}  // namespace meltstage::python
