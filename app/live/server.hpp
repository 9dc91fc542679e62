// SPDX-License-Identifier: Apache-2.0
// The page, its events and its commands over HTTP.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "app/live/access.hpp"
#include "app/live/bench.hpp"
#include "app/live/feed.hpp"

namespace httplib {
struct Request;
struct Response;
class Server;
}  // namespace httplib

namespace meltstage::app::live {

/// JSON that is asked for by a path, made anew each time. The path is a regular expression; what its group
/// matched is handed over, empty without one. A UserError is told as "not found".
using Documents = std::map<std::string, std::function<std::string(const std::string& matched)>>;

/// A port that is had. What connects to it waits for a server.
struct Listener {
  /// Throws UserError where the address can't be had.
  explicit Listener(const Address& wanted);
  ~Listener();
  Listener(Listener&&) noexcept;

  std::unique_ptr<httplib::Server> http;
  Address address;  // with the port that it was given
};

class Server {
 public:
  /// Answers from now on. All must outlive the server.
  Server(Listener listener, const std::optional<std::string>& token, Feed& feed, Bench& bench,
         Documents documents);
  /// Ends all connections.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// It can't listen any more.
  bool ended() const { return ended_; }

 private:
  void answer_requests();
  void stream(const httplib::Request& request, httplib::Response& response);
  void command(const httplib::Request& request, httplib::Response& response);

  Feed& feed_;
  Bench& bench_;
  Documents documents_;
  std::unique_ptr<httplib::Server> http_;
  Access access_;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

}  // namespace meltstage::app::live
