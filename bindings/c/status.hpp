// SPDX-License-Identifier: Apache-2.0
// From C++ exceptions to a status and a line of text.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "bindings/c/meltstage.h"

namespace meltstage::c {

/// An exception that is a status of its own.
class StatusError : public std::runtime_error {
 public:
  StatusError(ms_status which, const std::string& message) : std::runtime_error(message), status(which) {}
  ms_status status;
};

/// Keeps the exception in flight for ms_last_error() and returns its status. Called in a handler.
ms_status status_of_exception() noexcept;

/// Runs what a function of the library does.
template <class Body>
ms_status guarded(Body&& body) noexcept {
  try {
    std::forward<Body>(body)();
    return MS_OK;
  } catch (...) {
    return status_of_exception();
  }
}

/// The thing behind a pointer of the caller. Throws StatusError.
template <class T>
T& required(T* pointer, const char* name) {
  if (pointer == nullptr)
    throw StatusError(MS_NULL, std::string(name) + ": found NULL, expected something behind it");
  return *pointer;
}

/// The number, if it is finite and of the range. Throws UserError.
double number(const char* name, double value, double least, double most);
double number(const char* name, double value);

}  // namespace meltstage::c
