// SPDX-License-Identifier: Apache-2.0
#include "app/chip/pseudo_terminal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <system_error>
#include <thread>
#include <utility>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/sha256.hpp"

namespace meltstage::app {

namespace {

std::string reason(int error) { return std::generic_category().message(error); }

// Bytes pass as they are; a program that opens the port may set it otherwise.
void make_raw(int near_end) {
  termios settings{};
  cfmakeraw(&settings);
  settings.c_cflag |= CREAD;
  cfsetspeed(&settings, B115200);
  tcsetattr(near_end, TCSANOW, &settings);
}

// The kernel gives pseudo-terminals numbers, and takes the name away with the last that has one open.
bool was_pseudo_terminal(const std::filesystem::path& device) {
  std::error_code ignored;
  const std::string number = device.filename().string();
  return device.parent_path() == "/dev/pts" && number_in<unsigned>(number, 0, UINT32_MAX) &&
         std::filesystem::symlink_status(device, ignored).type() == std::filesystem::file_type::not_found;
}

}  // namespace

std::filesystem::path whole_name(const std::filesystem::path& name) {
  std::error_code ignored;
  const auto folder =
      std::filesystem::weakly_canonical(std::filesystem::absolute(name, ignored).parent_path(), ignored);
  return folder / name.filename();
}

LinkClaim::LinkClaim(const std::filesystem::path& link)
    : socket_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  Sha256 hash;
  hash.update(whole_name(link).string());
  const std::string name = "meltstage " + hash.finish();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(name.begin(), name.end(), address.sun_path + 1);  // behind a zero: no file
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) == 0) return;
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
}

LinkClaim::~LinkClaim() {
  if (socket_ >= 0) close(socket_);
}

PseudoTerminal::PseudoTerminal(std::filesystem::path link) : link_(std::move(link)), claim_(link_) {
  free_name();

  far_end_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  std::array<char, 128> name{};
  if (far_end_ < 0 || grantpt(far_end_) != 0 || unlockpt(far_end_) != 0 ||
      ptsname_r(far_end_, name.data(), name.size()) != 0) {
    const int error = errno;
    if (far_end_ >= 0) close(far_end_);
    throw std::runtime_error(fmt::format("no pseudo-terminal to be had: {}", reason(error)));
  }
  device_ = name.data();
  if (const int near_end = ::open(device_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC); near_end >= 0) {
    make_raw(near_end);
    close(near_end);
  }
  // symlink(2) takes the name or fails; nobody else's file is replaced even when it has just appeared.
  if (symlink(device_.c_str(), link_.c_str()) != 0) {
    const int error = errno;
    close(far_end_);
    throw UserError(fmt::format("{}: cannot be made: found \"{}\", expected a folder that can be written to",
                                link_.string(), reason(error)));
  }
}

// What a `chip serve` that was killed has left makes room: a link to a pseudo-terminal that has gone. One
// that is there may be anybody's, and so may the link.
void PseudoTerminal::free_name() const {
  std::error_code ignored;
  const auto status = std::filesystem::symlink_status(link_, ignored);
  const auto refuse = [&](const std::string& found) {
    throw UserError(
        fmt::format("{}: found {}, expected a name that is free; remove it, or choose another --port",
                    link_.string(), found));
  };
  if (std::filesystem::is_symlink(status)) {
    const auto leads_to = std::filesystem::read_symlink(link_, ignored);
    if (!claim_.held())
      throw UserError(
          fmt::format("{}: found a link to {} that another `chip serve` uses, expected a name that is free; "
                      "choose another --port",
                      link_.string(), leads_to.string()));
    if (!was_pseudo_terminal(leads_to)) refuse(fmt::format("a link to {}", leads_to.string()));
    std::filesystem::remove(link_, ignored);
  } else if (std::filesystem::exists(status)) {
    refuse("something there");
  }
}

PseudoTerminal::~PseudoTerminal() {
  std::error_code ignored;
  if (std::filesystem::read_symlink(link_, ignored) == device_) std::filesystem::remove(link_, ignored);
  close(far_end_);
}

// Looks at the port, for at most so long; true when bytes have come. opened_ is up to date then.
bool PseudoTerminal::look(int timeout_ms) {
  pollfd state{.fd = far_end_, .events = POLLIN, .revents = 0};
  ::poll(&state, 1, timeout_ms);
  const bool open = (state.revents & POLLHUP) == 0;
  if (opened_ && !open) {
    // What that program left unread is not for the next one, nor are its settings: a tcsetattr(3) that
    // changes nothing and asks for parity, which no pseudo-terminal has, is refused.
    if (const int near_end = ::open(device_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
        near_end >= 0) {
      tcflush(near_end, TCIFLUSH);
      make_raw(near_end);
      close(near_end);
    }
  }
  opened_ = open;
  return (state.revents & POLLIN) != 0;
}

bool PseudoTerminal::wait(int timeout_ms) {
  if (look(timeout_ms)) return true;
  // poll(2) does not wait for a port that nobody has open.
  if (!opened_ && timeout_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(timeout_ms));
  return false;
}

std::vector<std::uint8_t> PseudoTerminal::read() {
  std::vector<std::uint8_t> bytes(4096);
  // Refused when nothing is there (EAGAIN) or nobody has the port open (EIO).
  const ssize_t n = ::read(far_end_, bytes.data(), bytes.size());
  bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  return bytes;
}

void PseudoTerminal::write(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  look(0);
  if (!opened_) return;
  // A program that never reads fills the kernel's few kilobytes; what comes then is lost, as on a wire.
  while (!bytes.empty()) {
    const ssize_t n = ::write(far_end_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

}  // namespace meltstage::app
