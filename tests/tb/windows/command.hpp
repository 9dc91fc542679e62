// SPDX-License-Identifier: Apache-2.0
// The `meltstage` command from outside: look at its workers, kill them.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "tests/support/run_command.hpp"

namespace meltstage::tb {

// `meltstage ARGUMENTS` in the background.
class Background {
 public:
  explicit Background(const std::string& arguments);
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  pid_t pid() const { return pid_; }
  Ran wait();

 private:
  std::filesystem::path log_;
  pid_t pid_;
};

// A process that checks a window of `folder`, if there is one now.
std::optional<pid_t> find_worker(const std::filesystem::path& folder, const std::string& verb = "window");

// Looks every few milliseconds until `condition` holds; false when it does not in time.
bool wait_until(const std::function<bool()>& condition,
                std::chrono::seconds limit = std::chrono::seconds(120));

std::size_t count_results(const std::filesystem::path& folder);

// The first `clocks` of the lively recording, planned by the command into `folder`.
Ran plan_by_command(const std::filesystem::path& folder, std::uint64_t clocks, std::uint64_t window_clocks);

// Flips a bit of a flop in the saved state of a border and makes every hash fit again: a model and an RTL
// that part there.
void seed_difference(const std::filesystem::path& folder, std::size_t border, const std::string& flop);

}  // namespace meltstage::tb
