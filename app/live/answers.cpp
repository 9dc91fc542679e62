// SPDX-License-Identifier: Apache-2.0
#include "app/live/answers.hpp"

namespace meltstage::app::live {

std::optional<Answer> Answers::find(const std::string& id) const {
  const auto at = answers_.find(id);
  return at == answers_.end() ? std::nullopt : std::optional(at->second);
}

void Answers::put(const Answer& answer) {
  const bool is_new = answers_.insert_or_assign(answer.id, answer).second;
  if (!is_new) return;
  ids_.push_back(answer.id);
  if (ids_.size() > kMostKept) {
    answers_.erase(ids_.front());
    ids_.pop_front();
  }
}

}  // namespace meltstage::app::live
