// SPDX-License-Identifier: Apache-2.0
// A serial port that other programs can open, under a name of the caller's choice.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace meltstage::app {

// The name of a file or link, whether it is there or not, in one spelling; a link by its own name.
std::filesystem::path whole_name(const std::filesystem::path& name);

// Tells who serves a link from who served it once: a socket named after the link, in the kernel's own name
// space, which goes with the process however that ends.
class LinkClaim {
 public:
  explicit LinkClaim(const std::filesystem::path& link);
  LinkClaim(const LinkClaim&) = delete;
  LinkClaim& operator=(const LinkClaim&) = delete;
  ~LinkClaim();
  // False when another process has it.
  bool held() const { return socket_ >= 0; }

 private:
  int socket_ = -1;
};

// The far end of a pseudo-terminal, and a symbolic link to its near end; both go with the object.
class PseudoTerminal {
 public:
  // A link that an ended process left is replaced, when the pseudo-terminal it leads to has gone. Throws
  // UserError when anything else exists at `link`, or it can't be made.
  explicit PseudoTerminal(std::filesystem::path link);
  ~PseudoTerminal();
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  // Device that the link leads to.
  const std::string& device() const { return device_; }
  // Waits for bytes, at most so long; false when none came. Returns early on a signal.
  bool wait(int timeout_ms);
  // What has come, at once, a few kilobytes at most; nothing when nothing has.
  std::vector<std::uint8_t> read();
  // Lost when no program has the port open, as on a wire, or when it takes nothing for a long time.
  void write(std::span<const std::uint8_t> bytes);

 private:
  void free_name() const;
  bool look(int timeout_ms);

  std::filesystem::path link_;
  LinkClaim claim_;
  std::string device_;
  int far_end_ = -1;
  bool opened_ = false;  // by some program, when last looked at
};

}  // namespace meltstage::app
