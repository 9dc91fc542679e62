// SPDX-License-Identifier: Apache-2.0
// Who may ask: what a request must bring before anything else of it is looked at.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace httplib {
struct Request;
}

namespace meltstage::app::live {

struct Address {
  std::string host;  // as it is bound: "127.0.0.1", "::1"
  int port;          // 0: a free one
  bool loopback;
};

/// "127.0.0.1:8123", "[::1]:0" or "localhost:8123". Throws UserError.
Address parse_address(const std::string& text);

/// "127.0.0.1:8123" or "[::1]:8123".
std::string authority(const Address& address);

/// The first line of the file. Throws UserError where it has fewer than 16 characters, or others than visible
/// ASCII.
std::string read_token(const std::filesystem::path& file);

/// Most bytes of a body.
inline constexpr std::size_t kMostBodyBytes = std::size_t{64} * 1024;

struct Refused {
  int status;  // of HTTP
  std::string text;
};

class Access {
 public:
  /// `address` with the port that it was given. Without a token none is asked for.
  Access(Address address, std::optional<std::string> token);

  /// Why the request is refused; nothing when it may go on. On a loopback address the Host must be one, so
  /// that no other page's name can be led here (DNS rebinding); where there is an Origin it must be this
  /// server's; a token must be right; what is posted must be JSON of a known, small size.
  std::optional<Refused> refuse(const httplib::Request& request) const;

 private:
  bool has_token(const httplib::Request& request) const;

  Address address_;
  std::optional<std::string> token_hash_;
};

}  // namespace meltstage::app::live
