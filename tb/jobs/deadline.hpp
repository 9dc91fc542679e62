// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace meltstage::tb {

// Calls `late` from a thread of its own when its time is over, unless it was met or has gone by then.
class Deadline {
 public:
  Deadline(std::chrono::duration<double> time, std::function<void()> late)
      : watch_([this, time, late = std::move(late)] {
          std::unique_lock lock(mutex_);
          if (!changed_.wait_for(lock, time, [this] { return met_; })) late();
        }) {}
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;
  ~Deadline() {
    met();
    watch_.join();
  }

  // What was to be done is done. Returns once `late` can't begin any more.
  void met() const {
    {
      const std::lock_guard lock(mutex_);
      met_ = true;
    }
    changed_.notify_one();
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  mutable bool met_ = false;
  std::thread watch_;
};

}  // namespace meltstage::tb
