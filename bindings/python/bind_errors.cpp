// SPDX-License-Identifier: Apache-2.0
// C++ exceptions as those of meltstage/errors.py.
#include <pybind11/pybind11.h>

#include <exception>

#include "base/error.hpp"
#include "base/place.hpp"
#include "bindings/python/errors.hpp"
#include "bindings/python/parts.hpp"
#include "recording/text.hpp"

namespace meltstage::python {

namespace py = pybind11;

namespace {

// The instance, to be filled in. Names of files may hold any bytes.
py::object make(const char* type, const char* what) {
  return py::module_::import("meltstage.errors").attr(type)(escaped(what));
}

void raise(const py::object& error) {
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(error.ptr())), error.ptr());
}

void translate(std::exception_ptr thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const ScenarioError& defect) {
    const py::object error = make("UserError", defect.what());
    error.attr("line") = defect.line;
    error.attr("found") = defect.found;
    error.attr("expected") = defect.expected;
    raise(error);
  } catch (const recording::FormatError& defect) {
    const py::object error = make("UserError", defect.what());
    error.attr("line") = defect.line();
    error.attr("column") = defect.column();
    raise(error);
  } catch (const UserError& mistake) {
    raise(make("UserError", mistake.what()));
  } catch (const Refused& refusal) {
    const py::object error = make("Refused", refusal.what());
    error.attr("code") = static_cast<int>(refusal.code);
    raise(error);
  }
}

}  // namespace

void bind_errors(py::module_&) { py::register_local_exception_translator(translate); }

}  // namespace meltstage::python
