// SPDX-License-Identifier: Apache-2.0
// The chip behind the page, real or virtual. One thread alone uses it.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "app/live/command.hpp"
#include "host/register_map.hpp"

namespace meltstage::app::live {

class Source {
 public:
  Source() = default;
  virtual ~Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// Where the chip is, for people: "/dev/ttyUSB0, address 1".
  virtual std::string place() const = 0;
  /// A virtual head, to which things can happen.
  virtual bool is_virtual() const = 0;

  /// Opens it, anew where it was open, and returns who answers. Throws host::BusError when nobody does,
  /// UserError for a port that can't be opened and for another device.
  virtual std::string connect() = 0;
  /// Seconds since the start, on the clock of its readings.
  virtual double now_s() = 0;
  /// Words of these registers. Throws host::BusError.
  virtual std::vector<std::uint16_t> read(std::span<const host::Register* const> wanted) = 0;
  /// Does it once, and returns what there is to say beyond that. Throws UserError before anything is sent,
  /// host::NoAnswer when it may have been done, host::BusError when the chip refuses.
  virtual std::string carry_out(const Command& command) = 0;
  /// What stands around a virtual chip, as it was set last: {"speed": "1", "sensor": "open"}.
  virtual std::map<std::string, std::string> around() const { return {}; }
};

}  // namespace meltstage::app::live
