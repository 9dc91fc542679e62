// SPDX-License-Identifier: Apache-2.0
#include "bindings/c/status.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <new>

#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::c {
namespace {

// No allocation, so that it also holds what is said of memory that has run out.
thread_local char last_error[1024] = "";

ms_status keep(ms_status status, const char* message) noexcept {
  std::snprintf(last_error, sizeof last_error, "%s", message);
  return status;
}

}  // namespace

ms_status status_of_exception() noexcept {
  try {
    try {
      throw;
    } catch (const StatusError& error) {
      return keep(error.status, escaped(error.what()).c_str());
    } catch (const UserError& error) {
      return keep(MS_WRONG, escaped(error.what()).c_str());
    }
  } catch (const std::bad_alloc&) {
    return keep(MS_NO_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    return keep(MS_FAILED, error.what());
  } catch (...) {
    return keep(MS_FAILED, "an exception without a message");
  }
}

double number(const char* name, double value, double least, double most) {
  if (!(value >= least && value <= most))  // false for NaN too
    throw UserError(fmt::format("{}: found {:g}, expected {:g} to {:g}", name, value, least, most));
  return value;
}

double number(const char* name, double value) {
  if (!std::isfinite(value))
    throw UserError(fmt::format("{}: found {:g}, expected a finite number", name, value));
  return value;
}

}  // namespace meltstage::c

extern "C" const char* ms_last_error(void) { return meltstage::c::last_error; }
extern "C" const char* ms_version(void) { return MELTSTAGE_VERSION; }
