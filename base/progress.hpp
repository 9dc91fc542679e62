// SPDX-License-Identifier: Apache-2.0
// How far long work is, told by the work and shown by whoever called it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>

namespace meltstage {

/// The step that the work is at, and the share 0..1 of that step that is done. Calls come one after another.
using Progress = std::function<void(std::string_view step, double share)>;

/// Pieces as small as a clock are told so many at a time.
inline constexpr std::uint64_t kTellEvery = std::uint64_t{1} << 14;

/// Of `count` like pieces `done` are done; nobody need listen.
inline void tell(const Progress& progress, std::string_view step, std::size_t done, std::size_t count) {
  if (progress) progress(step, count == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(count));
}

}  // namespace meltstage
