// SPDX-License-Identifier: Apache-2.0
#include "app/live/server.hpp"

#include <fmt/format.h>
#include <httplib.h>
#include <sys/socket.h>

#include <cerrno>
#include <semaphore>
#include <system_error>

#include "base/error.hpp"
#include "base/place.hpp"
#include "live_page.hpp"

namespace meltstage::app::live {
namespace {

using namespace std::chrono_literals;

constexpr int kOk = 200, kAccepted = 202, kBadRequest = 400, kNotFound = 404, kConflict = 409,
              kUnavailable = 503, kSilent = 504;
constexpr std::size_t kMostConnections = Feed::kMostListeners + 32;
// A client that sends or takes nothing for so long is dropped.
constexpr auto kPatience = 5s;
constexpr auto kAnswerPatience = 10s;
constexpr auto kHeartbeat = 2s;

// A thread a connection, and no more connections than threads: what comes then waits in the system's queue.
class BoundedPool : public httplib::TaskQueue {
 public:
  void enqueue(std::function<void()> serve) override {
    free_.acquire();
    pool_.enqueue([this, serve = std::move(serve)] {
      serve();
      free_.release();
    });
  }
  void shutdown() override { pool_.shutdown(); }

 private:
  std::counting_semaphore<kMostConnections> free_{kMostConnections};
  httplib::ThreadPool pool_{kMostConnections};
};

// The library would let several servers share a port.
void allow_a_port_again(int socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

// The page takes what it holds, and asks this server alone.
const httplib::Headers kSafety{{"Content-Security-Policy",
                                "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
                                "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
                                "frame-ancestors 'none'"},
                               {"X-Content-Type-Options", "nosniff"},
                               {"X-Frame-Options", "DENY"},
                               {"Referrer-Policy", "no-referrer"},
                               {"Cross-Origin-Resource-Policy", "same-origin"},
                               {"Cache-Control", "no-store"}};

void say(httplib::Response& response, int status, const std::string& line) {
  response.status = status;
  response.set_content(escaped(line) + "\n", "text/plain; charset=utf-8");
}

int status_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::waiting:
      return kAccepted;
    case Outcome::done:
      return kOk;
    case Outcome::refused:
      return kConflict;
    case Outcome::unknown:
      return kSilent;
  }
  return kUnavailable;
}

std::unique_ptr<httplib::Server> make_http() {
  auto http = std::make_unique<httplib::Server>();
  http->new_task_queue = [] { return new BoundedPool; };
  http->set_socket_options(allow_a_port_again);
  http->set_tcp_nodelay(true);
  http->set_keep_alive_max_count(1);
  http->set_read_timeout(kPatience);
  http->set_write_timeout(kPatience);
  http->set_payload_max_length(kMostBodyBytes);
  http->set_default_headers(kSafety);
  return http;
}

}  // namespace

Listener::Listener(const Address& wanted) : http(make_http()), address(wanted) {
  errno = 0;
  const bool had = wanted.port == 0 ? (address.port = http->bind_to_any_port(wanted.host)) > 0
                                    : http->bind_to_port(wanted.host, wanted.port);
  if (!had)
    throw UserError(
        fmt::format("--listen: {} can't be had ({}), expected an address of this machine and a free "
                    "port; choose another, 0 for any",
                    authority(wanted), std::generic_category().message(errno)));
}
Listener::~Listener() = default;
Listener::Listener(Listener&&) noexcept = default;

Server::Server(Listener listener, const std::optional<std::string>& token, Feed& feed, Bench& bench,
               Documents documents)
    : feed_(feed),
      bench_(bench),
      documents_(std::move(documents)),
      http_(std::move(listener.http)),
      access_(listener.address, token) {
  answer_requests();
  thread_ = std::thread([this] {
    http_->listen_after_bind();
    ended_ = true;
  });
}

Server::~Server() {
  feed_.close();
  while (!http_->is_running() && !ended_) std::this_thread::sleep_for(1ms);  // a stop() before would be lost
  http_->stop();
  thread_.join();
}

void Server::answer_requests() {
  using httplib::Request;
  using httplib::Response;
  http_->set_pre_routing_handler([this](const Request& request, Response& response) {
    const auto refused = access_.refuse(request);
    if (!refused) return httplib::Server::HandlerResponse::Unhandled;
    say(response, refused->status, refused->text);
    return httplib::Server::HandlerResponse::Handled;
  });
  http_->Get("/", [](const Request&, Response& response) {
    response.set_content(page_text::kPage, sizeof(page_text::kPage) - 1, "text/html; charset=utf-8");
  });
  for (const auto& [path, document] : documents_)
    http_->Get(path, [&make = document](const Request& request, Response& response) {
      try {
        response.set_content(make(request.matches.size() > 1 ? request.matches[1].str() : ""),
                             "application/json");
      } catch (const UserError& none) {
        say(response, kNotFound, none.what());
      }
    });
  http_->Get("/events", [this](const Request& request, Response& response) { stream(request, response); });
  http_->Post("/command", [this](const Request& request, Response& response) { command(request, response); });
}

void Server::stream(const httplib::Request& request, httplib::Response& response) {
  std::shared_ptr<Feed::Stream> stream = feed_.listen(request.get_header_value("Last-Event-ID"));
  if (!stream)
    return say(response, kUnavailable,
               fmt::format("events: {} listen, expected no more; close another page", Feed::kMostListeners));
  response.set_chunked_content_provider("text/event-stream",
                                        [stream = std::move(stream)](std::size_t, httplib::DataSink& sink) {
                                          const auto text = stream->next(kHeartbeat);
                                          return text && sink.write(text->data(), text->size());
                                        });
}

void Server::command(const httplib::Request& request, httplib::Response& response) {
  std::optional<Answer> answer;
  try {
    answer = bench_.ask(parse_command(request.body), kAnswerPatience);
  } catch (const UserError& wrong) {
    return say(response, kBadRequest, wrong.what());
  }
  if (!answer)
    return say(response, kUnavailable,
               fmt::format("command: {} wait, expected no more; try again", Bench::kMostWaiting));
  response.status = status_of(answer->outcome);
  response.set_content(answer_json(*answer), "application/json");
}

}  // namespace meltstage::app::live
