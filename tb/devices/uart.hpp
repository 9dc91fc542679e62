// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "base/rng.hpp"
#include "tb/devices/no_event.hpp"

namespace meltstage::tb {

enum class UartParity : std::uint8_t { none, even, odd };

/// Eight data bits, least significant first.
struct UartFormat {
  UartParity parity;
  int stop_bits;  ///< 1 or 2
  constexpr int bits() const { return 1 + 8 + (parity == UartParity::none ? 0 : 1) + stop_bits; }
};
inline constexpr UartFormat k8E1{UartParity::even, 1};
inline constexpr UartFormat k8O1{UartParity::odd, 1};
inline constexpr UartFormat k8N1{UartParity::none, 1};
inline constexpr UartFormat k8N2{UartParity::none, 2};

/// The one that the chip's register FORMAT says.
UartFormat uart_format(std::uint16_t format_register);

/// A serial line in units of the chip clock.
struct UartLine {
  double clock_hz;
  double baud;
  UartFormat format = k8E1;
  double bit_cycles() const { return clock_hz / baud; }
  double char_cycles() const { return bit_cycles() * format.bits(); }
};

/// A character to send, with what may be wrong with it.
struct UartChar {
  std::uint8_t data = 0;
  double gap_bits = 0.0;  ///< idle time before the start bit
  bool wrong_parity = false;
  bool missing_stop = false;
};

/// How far a transmitter is from ideal.
struct UartTiming {
  double baud_error_ratio = 0.0;  ///< +0.02 = 2 % fast
  double jitter_bits = 0.0;       ///< each edge uniform within +-this, below 0.5
};

/// Bit-level transmitter. `step` gives the line level at a cycle; it changes at `next_event()` only.
class UartTransmitter {
 public:
  /// Throws std::invalid_argument when a bit has fewer than 2 cycles or jitter is outside [0, 0.5).
  UartTransmitter(const UartLine& line, const UartTiming& timing, Rng jitter);

  /// Queues a character; it starts as soon as the line is free, earliest at the next step.
  void send(const UartChar& character);
  /// Inverts the line during [cycle, cycle + length_cycles).
  void glitch(std::uint64_t cycle, std::uint64_t length_cycles);

  bool step(std::uint64_t cycle) {
    if (cycle >= next_event_) advance(cycle);
    return level_;
  }

  /// All queued characters are out, stop bits included.
  bool idle() const { return !sending_ && queue_.empty(); }
  /// Cycle at which the last character's stop bit ended.
  std::uint64_t last_end_cycle() const { return last_end_cycle_; }
  std::uint64_t next_event() const { return next_event_; }

 private:
  struct Glitch {
    std::uint64_t begin;
    std::uint64_t end;
  };
  void advance(std::uint64_t cycle);
  void load(double start_cycle);
  void schedule_edge();

  UartLine line_;
  UartTiming timing_;
  Rng jitter_;
  double bit_cycles_;
  std::deque<UartChar> queue_;
  std::deque<Glitch> glitches_;
  bool sending_ = false;
  double start_cycle_ = 0.0;  // nominal, fractional: rounding does not add up over characters
  unsigned frame_bits_ = 0;   // bit 0 is the start bit
  int edge_ = 0;              // next bit boundary
  std::uint64_t edge_cycle_ = kNoEvent;
  std::uint64_t last_end_cycle_ = 0;
  bool line_level_ = true;
  bool level_ = true;
  std::uint64_t next_event_ = kNoEvent;
};

/// A received character.
struct UartByte {
  std::uint8_t data;
  bool parity_error;
  bool framing_error;
  std::uint64_t start_cycle;  ///< falling edge of the start bit
  std::uint64_t end_cycle;    ///< nominal end of the last stop bit
};

/// Bit-level receiver sampling mid-bit. It needs a `step` at each level change only: samples due before are
/// taken with the level that held.
class UartReceiver {
 public:
  explicit UartReceiver(const UartLine& line);

  void step(std::uint64_t cycle, bool level) {
    if (level == level_ && cycle < next_event_) return;
    advance(cycle, level);
  }

  /// The oldest character not yet taken.
  std::optional<UartByte> take();
  /// A character is under way.
  bool receiving() const { return next_event_ != kNoEvent; }
  /// Start bits that were gone at their middle.
  std::uint64_t false_starts() const { return false_starts_; }
  std::uint64_t next_event() const { return next_event_; }

 private:
  void advance(std::uint64_t cycle, bool level);
  void sample(bool level);

  UartLine line_;
  bool level_ = true;
  std::uint64_t start_cycle_ = 0;
  int bit_ = 0;
  unsigned bits_ = 0;
  std::uint64_t next_event_ = kNoEvent;
  std::uint64_t false_starts_ = 0;
  std::deque<UartByte> received_;
};

}  // namespace meltstage::tb
