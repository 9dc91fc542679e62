// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <string_view>
#include <thread>
#include <vector>

#include "base/progress.hpp"

namespace meltstage {

// body(0) .. body(count - 1) on all cores; an exception of one of them is thrown at the end. Each that is
// done is told as a part of `step`.
template <class Body>
void in_parallel(std::size_t count, const Body& body, const Progress& progress = {},
                 std::string_view step = "") {
  std::atomic<std::size_t> next{0};
  std::size_t done = 0;
  std::exception_ptr failed;
  std::mutex mutex;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) {
        body(i);
        const std::lock_guard lock(mutex);
        tell(progress, step, ++done, count);
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failed = std::current_exception();
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
  threads.clear();
  if (failed) std::rethrow_exception(failed);
}

}  // namespace meltstage
