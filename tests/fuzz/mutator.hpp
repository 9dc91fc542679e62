// SPDX-License-Identifier: Apache-2.0
// Random changes of a text: bytes, pieces, numbers at the ends of their ranges, repetitions.
#pragma once

#include <string>
#include <vector>

#include "base/rng.hpp"

namespace meltstage {

/// One of `corpus`, which holds some, with one to eight changes.
std::string mutated(const std::vector<std::string>& corpus, Rng& random);

}  // namespace meltstage
