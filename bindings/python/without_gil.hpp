// SPDX-License-Identifier: Apache-2.0
// Long work beside Python: other threads run meanwhile, and Ctrl-C ends it.
#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

namespace meltstage::python {

/// At the interpreter's end a daemon thread stays here: there is nothing left that it could come back to, and
/// Python would end it without C++'s knowledge.
inline void stay_if_python_ends() {
  while (_Py_IsFinalizing() != 0) pause();
}

/// The GIL is free as long as this lives.
class Released {
 public:
  Released() : thread_(PyEval_SaveThread()) {}
  ~Released() noexcept(false) {
    stay_if_python_ends();
    PyEval_RestoreThread(thread_);
  }
  Released(const Released&) = delete;
  Released& operator=(const Released&) = delete;

 private:
  PyThreadState* thread_;
};

/// Raises what a signal's handler raised, KeyboardInterrupt by default. Called with the GIL.
inline void look_at_signals() {
  if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
}

/// The same where the GIL is free.
inline void look_at_signals_from_outside() {
  stay_if_python_ends();
  const pybind11::gil_scoped_acquire acquired;
  look_at_signals();
}

/// Calls slice() without the GIL until it returns false, and looks at signals in between; so a slice should
/// take some milliseconds.
template <class Slice>
void without_gil(Slice&& slice) {
  for (bool more = true; more;) {
    {
      const Released released;
      more = slice();
    }
    look_at_signals();
  }
}

/// The same for a number of like things: calls part(begin, end) for ranges of at most `most` of them.
template <class Part>
void in_parts(std::uint64_t count, std::uint64_t most, Part&& part) {
  std::uint64_t begin = 0;
  without_gil([&] {
    const std::uint64_t end = begin + std::min(most, count - begin);
    part(begin, end);
    begin = end;
    return begin < count;
  });
}

}  // namespace meltstage::python
