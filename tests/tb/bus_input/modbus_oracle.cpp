// SPDX-License-Identifier: Apache-2.0
#include "modbus_oracle.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace meltstage::tb {
namespace {

constexpr std::size_t kLeastBytes = 4;
constexpr std::size_t kMostBytes = 256;
constexpr double kPauseChars = 1.5;  // t1.5: within a frame

std::uint16_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

bool sound(std::span<const UartChar> chars, std::uint8_t unit, Bytes& bytes) {
  if (chars.size() < kLeastBytes || chars.size() > kMostBytes) return false;
  bytes.clear();
  for (const UartChar& c : chars) {
    if (c.wrong_parity || c.missing_stop) return false;
    bytes.push_back(c.data);
  }
  const std::uint16_t crc = crc_of(std::span(bytes).first(bytes.size() - 2));
  const bool good = bytes[bytes.size() - 2] == (crc & 0xFF) && bytes.back() == crc >> 8;
  return good && (bytes[0] == unit || bytes[0] == 0);
}

}  // namespace

Segment segment_of(std::span<const std::uint8_t> bytes) {
  Segment segment;
  for (const std::uint8_t byte : bytes) segment.chars.push_back({.data = byte});
  return segment;
}

std::string describe(const Segment& segment) {
  std::string text;
  for (const UartChar& c : segment.chars) {
    if (c.gap_bits > 0) text += fmt::format("({} bits) ", c.gap_bits);
    text += fmt::format("{:02x}{}{} ", c.data, c.wrong_parity ? "p" : "", c.missing_stop ? "s" : "");
  }
  for (const BitFlip& flip : segment.flips) text += fmt::format("flip {}.{} ", flip.character, flip.bit);
  return text;
}

std::uint16_t crc_of(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1) ^ 0xA001U : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

Bytes sealed(Bytes body) {
  const std::uint16_t crc = crc_of(body);
  body.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  body.push_back(static_cast<std::uint8_t>(crc >> 8));
  return body;
}

std::uint16_t SoundFrame::first_register() const { return bytes.size() >= 6 ? word_at(bytes, 2) : 0; }

std::vector<std::uint16_t> SoundFrame::values() const {
  if (function() == 6 && bytes.size() == 8) return {word_at(bytes, 4)};
  std::vector<std::uint16_t> list;
  if (function() != 16 || bytes.size() < 9 || bytes.size() != 9U + bytes[6] ||
      bytes[6] != 2 * word_at(bytes, 4))
    return list;
  for (std::size_t at = 7; at + 2 < bytes.size(); at += 2) list.push_back(word_at(bytes, at));
  return list;
}

bool SoundFrame::writes(std::uint16_t address) const {
  return address >= first_register() && address < first_register() + values().size();
}

Meaning meaning_of(const Segment& segment, std::uint8_t unit, int char_bits) {
  Meaning meaning;
  const std::span chars(segment.chars);
  // Places at which a frame may begin or end, besides both ends.
  std::vector<std::size_t> cuts{0};
  for (std::size_t i = 1; i < chars.size(); ++i) {
    if (chars[i].gap_bits > kPauseChars * char_bits) cuts.push_back(i);
  }
  cuts.push_back(chars.size());
  Bytes bytes;
  for (std::size_t from = 0; from + 1 < cuts.size(); ++from) {
    for (std::size_t to = from + 1; to < cuts.size(); ++to) {
      // Every bit of a frame is covered by parity, stop bit or CRC.
      const bool flipped = std::any_of(segment.flips.begin(), segment.flips.end(), [&](const BitFlip& flip) {
        return flip.character >= cuts[from] && flip.character < cuts[to];
      });
      if (flipped || !sound(chars.subspan(cuts[from], cuts[to] - cuts[from]), unit, bytes)) continue;
      (cuts.size() == 2 ? meaning.certain : meaning.possible).push_back({bytes});
    }
  }
  return meaning;
}

bool is_exception(std::span<const std::uint8_t> reply) { return reply.size() == 5 && (reply[1] & 0x80) != 0; }

std::string fault_of_reply(const SoundFrame& request, std::span<const std::uint8_t> reply) {
  if (reply.size() < kLeastBytes) return fmt::format("reply of {} bytes", reply.size());
  const std::uint16_t crc = crc_of(reply.first(reply.size() - 2));
  if (reply[reply.size() - 2] != (crc & 0xFF) || reply.back() != crc >> 8) return "CRC of the reply";
  if (reply[0] != request.bytes[0]) return "address of the reply";
  if (is_exception(reply) && reply[1] == (request.function() | 0x80)) {
    return reply[2] >= 1 && reply[2] <= 6 ? "" : "exception code";
  }
  if (reply[1] != request.function()) return "function code of the reply";
  const auto repeats = [&](std::size_t count) {
    return reply.size() == count + 2 && std::equal(reply.begin(), reply.end() - 2, request.bytes.begin());
  };
  switch (request.function()) {
    case 3:
    case 4: {
      const unsigned bytes = 2U * word_at(request.bytes, 4);
      return reply[2] == bytes && reply.size() == 5U + bytes ? "" : "byte count of the reply";
    }
    case 6:
    case 8:
    case 16:
      return repeats(6) ? "" : "echo of the request";
    default:
      return "";
  }
}

}  // namespace meltstage::tb
