// SPDX-License-Identifier: Apache-2.0
#include "app/live/feed.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <utility>

#include "base/number.hpp"

namespace meltstage::app::live {

Feed::Feed()
    : run_(fmt::format("{}-{}", std::chrono::system_clock::now().time_since_epoch().count(), getpid())) {}

// The mutex is held.
std::string Feed::add(const std::string& name, std::string_view data) {
  std::string event =
      fmt::format("id: {}/{}\nevent: {}\ndata: {}\n\n", run_, first_ + events_.size(), name, data);
  events_.push_back(event);
  if (events_.size() > kMostKept) {
    events_.pop_front();
    ++first_;
  }
  changed_.notify_all();
  return event;
}

void Feed::tell(const std::string& name, std::string_view data) {
  const std::lock_guard lock(mutex_);
  add(name, data);
}

void Feed::tell_state(const std::string& name, std::string_view data) {
  const std::lock_guard lock(mutex_);
  states_[name] = add(name, data);
}

void Feed::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

// The number of the event behind that one, if all from there on are kept.
std::optional<std::uint64_t> Feed::number_behind(std::string_view last_id) const {
  if (!last_id.starts_with(run_ + "/") || events_.empty()) return std::nullopt;
  last_id.remove_prefix(run_.size() + 1);
  const auto seen = number_in<std::uint64_t>(last_id, 0, first_ + events_.size() - 1);
  if (!seen || *seen + 1 < first_) return std::nullopt;
  return *seen + 1;
}

std::unique_ptr<Feed::Stream> Feed::listen(std::string_view last_id) {
  const std::lock_guard lock(mutex_);
  if (closed_ || listeners_ >= kMostListeners) return nullptr;
  ++listeners_;
  std::string begin = "retry: 1000\n\n";
  const auto missed_from = number_behind(last_id);
  if (!missed_from)
    for (const auto& [name, event] : states_) begin += event;
  return std::unique_ptr<Stream>(
      new Stream(*this, std::move(begin), missed_from.value_or(first_ + events_.size())));
}

Feed::Stream::Stream(Feed& feed, std::string begin, std::uint64_t number)
    : feed_(feed), begin_(std::move(begin)), number_(number) {}

Feed::Stream::~Stream() {
  const std::lock_guard lock(feed_.mutex_);
  --feed_.listeners_;
}

std::optional<std::string> Feed::Stream::next(std::chrono::milliseconds patience) {
  std::unique_lock lock(feed_.mutex_);
  if (!begin_.empty()) return std::exchange(begin_, {});
  const auto there = [&] { return feed_.closed_ || number_ < feed_.first_ + feed_.events_.size(); };
  if (!feed_.changed_.wait_for(lock, patience, there)) return ":\n\n";
  if (feed_.closed_ || number_ < feed_.first_) return std::nullopt;
  std::string text;
  for (; number_ < feed_.first_ + feed_.events_.size(); ++number_)
    text += feed_.events_[number_ - feed_.first_];
  return text;
}

}  // namespace meltstage::app::live
