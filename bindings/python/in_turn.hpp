// SPDX-License-Identifier: Apache-2.0
// An object that works without the GIL is used by one thread at a time.
#pragma once

#include <atomic>
#include <stdexcept>
#include <utility>

namespace meltstage::python {

/// Holds a T of Python's. `Turn(held)` is the way to it; a second one at the same time, from another thread
/// or from a signal's handler, throws, as waiting would hold up the whole interpreter.
template <class T>
class Held {
 public:
  template <class... Arguments>
  explicit Held(Arguments&&... arguments) : value_{std::forward<Arguments>(arguments)...} {}

  class Turn {
   public:
    explicit Turn(Held& held) : held_(held) {
      if (held.busy_.exchange(true, std::memory_order_acquire))
        throw std::runtime_error(
            "found the object at work in another thread, expected one thread at a time; make a copy, or "
            "wait");
    }
    ~Turn() { held_.busy_.store(false, std::memory_order_release); }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

    T* operator->() const { return &held_.value_; }
    T& operator*() const { return held_.value_; }

   private:
    Held& held_;
  };

 private:
  T value_;
  std::atomic<bool> busy_ = false;
};

}  // namespace meltstage::python
