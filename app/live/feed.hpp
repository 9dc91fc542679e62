// SPDX-License-Identifier: Apache-2.0
// What happens, to all who listen: server-sent events (WHATWG HTML, 9.2). The last ones are kept once for all
// listeners, so that one who is slow or comes back costs nothing and is dropped when it is too far behind.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

namespace meltstage::app::live {

class Feed {
 public:
  static constexpr std::size_t kMostListeners = 16;
  static constexpr std::size_t kMostKept = 1024;

  Feed();

  /// To all. `data` is one line. The last one of each name that is a state is told first to whoever comes.
  void tell_state(const std::string& name, std::string_view data);
  /// To all who listen now; whoever comes later has missed it.
  void tell(const std::string& name, std::string_view data);
  /// Ends all streams.
  void close();

  class Stream {
   public:
    ~Stream();
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;
    /// What is to be sent next: events, or after `patience` without one a comment. Nothing when the stream
    /// ends: the feed was closed, or this listener is too far behind.
    std::optional<std::string> next(std::chrono::milliseconds patience);

   private:
    friend class Feed;
    Stream(Feed& feed, std::string begin, std::uint64_t number);
    Feed& feed_;
    std::string begin_;
    std::uint64_t number_;  // of the next event
  };
  /// A new listener; nothing when there are too many. `last_id` is that of the last event that it has seen,
  /// empty for none: what it has missed is sent, as far as it is kept.
  std::unique_ptr<Stream> listen(std::string_view last_id);

 private:
  std::string add(const std::string& name, std::string_view data);
  std::optional<std::uint64_t> number_behind(std::string_view last_id) const;

  const std::string run_;  // of this server; an earlier one's numbers mean nothing here
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> events_;  // numbers first_ to first_ + size - 1
  std::uint64_t first_ = 0;
  std::map<std::string, std::string> states_;
  std::size_t listeners_ = 0;
  bool closed_ = false;
};

}  // namespace meltstage::app::live
