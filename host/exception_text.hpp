// SPDX-License-Identifier: Apache-2.0
// What the chip's exception codes say to a person.
#pragma once

#include "cmodel/spec.hpp"

namespace meltstage::host {

inline const char* exception_text(int code) {
  switch (code) {
    case chip::spec::kExcFunction:
      return "illegal function";
    case chip::spec::kExcAddress:
      return "illegal data address";
    case chip::spec::kExcValue:
      return "illegal data value";
    case chip::spec::kExcDevice:
      return "not in this state";
    case chip::spec::kExcBusy:
      return "busy";
    default:
      return "unknown";
  }
}

}  // namespace meltstage::host
