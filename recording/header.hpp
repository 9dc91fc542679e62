// SPDX-License-Identifier: Apache-2.0
// What a recording says about itself: pins, clock, origin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace meltstage::recording {

/// Seen from the pin's owner.
enum class Direction { in, out, inout };

/// "in", "out" or "inout".
std::string_view to_string(Direction direction);

struct Pin {
  std::string name;  ///< identifier [A-Za-z_][A-Za-z0-9_]*, unique in the header
  Direction direction = Direction::in;
  unsigned width = 1;  ///< bits, 1 to 64
  std::string owner;   ///< whose pin it is, an identifier: "chip", "stage"

  bool operator==(const Pin&) const = default;
};

struct Header {
  std::vector<Pin> pins;
  double clock_hz = 0.0;                    ///< 1 Hz to 10 GHz
  std::string origin;                       ///< who recorded: tool, test, seed; not empty
  std::map<std::string, std::string> meta;  ///< keys [A-Za-z0-9_.-]+, any values

  bool operator==(const Header&) const = default;
};

/// From `cycle` on the pin (an index into Header::pins) has `value`. A cycle's values are those sampled just
/// before its rising clock edge.
struct Change {
  std::uint64_t cycle = 0;
  std::uint32_t pin = 0;
  std::uint64_t value = 0;

  bool operator==(const Change&) const = default;
};

inline constexpr std::size_t kMaxPins = 4096;
/// Leaves room for cycle counts and differences in 64 bits: 18,000 years at 16 MHz.
inline constexpr std::uint64_t kMaxCycle = ~std::uint64_t{0} >> 1;
inline constexpr std::size_t kMaxNameBytes = 255;
inline constexpr std::size_t kMaxStringBytes = 65536;  ///< origin and each meta value
inline constexpr double kMinClock_hz = 1.0;
inline constexpr double kMaxClock_hz = 1e10;

/// Throws std::invalid_argument with one line when a field is outside what is said above.
void validate(const Header& header);

/// Index of the pin with that name.
std::optional<std::uint32_t> find_pin(const Header& header, std::string_view name);

/// True for [A-Za-z_][A-Za-z0-9_]* of at most kMaxNameBytes.
bool is_identifier(std::string_view text);
/// True for [A-Za-z0-9_.-]+ of at most kMaxNameBytes.
bool is_meta_key(std::string_view text);
/// True for a clock in [min_clock_hz, max_clock_hz]; false for NaN.
bool is_valid_clock(double clock_hz);
/// The largest value of `width` bits (1 to 64).
constexpr std::uint64_t max_value(unsigned width) { return ~std::uint64_t{0} >> (64 - width); }

}  // namespace meltstage::recording
