// SPDX-License-Identifier: Apache-2.0
#include "app/live/access.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <httplib.h>
#include <netinet/in.h>
#include <openssl/crypto.h>

#include <algorithm>
#include <cstdint>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/number.hpp"
#include "base/place.hpp"
#include "base/sha256.hpp"

namespace meltstage::app::live {
namespace {

constexpr std::size_t kLeastToken = 16;
constexpr std::size_t kMostToken = 1024;
constexpr int kForbidden = 403, kUnauthorized = 401, kLengthRequired = 411, kTooLarge = 413, kNoJson = 415;

[[noreturn]] void refuse_address(const std::string& text) {
  throw UserError(
      fmt::format("--listen: found \"{}\", expected an address of this machine and a port such as "
                  "127.0.0.1:8123 or [::1]:0",
                  shown(text)));
}

std::optional<bool> is_loopback(const std::string& host) {
  in_addr four{};
  in6_addr six{};
  constexpr std::uint32_t kFirstByte = 127;
  if (inet_pton(AF_INET, host.c_str(), &four) == 1) return ntohl(four.s_addr) >> 24 == kFirstByte;
  if (inet_pton(AF_INET6, host.c_str(), &six) == 1) return IN6_IS_ADDR_LOOPBACK(&six) != 0;
  return std::nullopt;
}

// Hashes are as long as each other, so the time tells nothing of the token.
bool same(const std::string& a, const std::string& b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

Address parse_address(const std::string& text) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos) refuse_address(text);
  const auto port = number_in<int>(text.substr(colon + 1), 0, UINT16_MAX);
  std::string host = text.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']')
    host = host.substr(1, host.size() - 2);
  else if (host.find(':') != std::string::npos)
    refuse_address(text);
  if (host == "localhost") host = "127.0.0.1";
  const auto loopback = is_loopback(host);
  if (!port || !loopback) refuse_address(text);
  return {host, *port, *loopback};
}

std::string authority(const Address& address) {
  const bool six = address.host.find(':') != std::string::npos;
  return fmt::format("{}{}{}:{}", six ? "[" : "", address.host, six ? "]" : "", address.port);
}

std::string read_token(const std::filesystem::path& file) {
  std::string token = read_file(file, "a token", kMostToken);
  token.erase(std::find_if(token.begin(), token.end(), [](char c) { return c == '\n' || c == '\r'; }),
              token.end());
  const bool visible = std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < '\x7F'; });
  if (!visible || token.size() < kLeastToken)
    throw UserError(
        fmt::format("{}: found {}, expected a line of {} visible ASCII characters or more, such as `openssl "
                    "rand -hex 16` writes",
                    file.string(), visible ? fmt::format("{} characters", token.size()) : "other characters",
                    kLeastToken));
  return token;
}

Access::Access(Address address, std::optional<std::string> token) : address_(std::move(address)) {
  if (token) token_hash_ = sha256(*token);
}

bool Access::has_token(const httplib::Request& request) const {
  constexpr std::string_view kBearer = "Bearer ";
  const std::string header = request.get_header_value("Authorization");
  const std::string given =
      header.starts_with(kBearer) ? header.substr(kBearer.size()) : request.get_param_value("token");
  return same(sha256(given), *token_hash_);
}

std::optional<Refused> Access::refuse(const httplib::Request& request) const {
  const std::string host = request.get_header_value("Host");
  if (address_.loopback && host != authority(address_) && host != fmt::format("localhost:{}", address_.port))
    return Refused{kForbidden,
                   fmt::format("Host: found \"{}\", expected {}", shown(host), authority(address_))};
  const std::string origin = request.get_header_value("Origin");
  if (!origin.empty() && origin != "http://" + host)
    return Refused{kForbidden, fmt::format("Origin: found \"{}\", expected http://{}: another page asks",
                                           shown(origin), shown(host))};
  if (token_hash_ && !has_token(request))
    return Refused{kUnauthorized,
                   "token: found none or another one, expected that of the server; open the "
                   "address with ?token=..., or send Authorization: Bearer ..."};
  if (request.method != "POST") return std::nullopt;
  if (!request.get_header_value("Content-Type").starts_with("application/json"))
    return Refused{kNoJson, "Content-Type: expected application/json"};
  const auto length = number_in<std::uint64_t>(request.get_header_value("Content-Length"), 0, UINT64_MAX);
  if (!length || request.has_header("Transfer-Encoding"))
    return Refused{kLengthRequired, "Content-Length: found none, expected the number of bytes"};
  if (*length > kMostBodyBytes)
    return Refused{kTooLarge,
                   fmt::format("body: found {} bytes, expected {} at most", *length, kMostBodyBytes)};
  return std::nullopt;
}

}  // namespace meltstage::app::live
