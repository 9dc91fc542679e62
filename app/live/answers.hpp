// SPDX-License-Identifier: Apache-2.0
// What became of the commands, by their ids: one that comes twice is done once.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>

#include "app/live/command.hpp"

namespace meltstage::app::live {

class Answers {
 public:
  static constexpr std::size_t kMostKept = 1000;

  /// That of the id; nothing for one that is new, or older than the last ones.
  std::optional<Answer> find(const std::string& id) const;
  /// The answer of its id from now on.
  void put(const Answer& answer);

 private:
  std::map<std::string, Answer> answers_;
  std::deque<std::string> ids_;  // oldest first
};

}  // namespace meltstage::app::live
