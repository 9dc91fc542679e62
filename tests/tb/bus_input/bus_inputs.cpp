// SPDX-License-Identifier: Apache-2.0
#include "bus_inputs.hpp"

#include <algorithm>
#include <array>

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

constexpr std::size_t kMostBytes = 256;

bool has_parity(std::uint8_t format) { return uart_format(format).parity != UartParity::none; }

std::uint8_t byte_of(unsigned value) { return static_cast<std::uint8_t>(value); }

Bytes four_words(std::uint8_t unit, std::uint8_t function, unsigned first, unsigned second) {
  return sealed({unit, function, byte_of(first >> 8), byte_of(first), byte_of(second >> 8), byte_of(second)});
}

Bytes write_block(std::uint8_t unit, unsigned first, const std::vector<std::uint16_t>& values) {
  Bytes body{unit,
             16,
             byte_of(first >> 8),
             byte_of(first),
             0,
             byte_of(static_cast<unsigned>(values.size())),
             byte_of(static_cast<unsigned>(2 * values.size()))};
  for (const std::uint16_t value : values) {
    body.push_back(byte_of(value >> 8));
    body.push_back(byte_of(value));
  }
  return sealed(body);
}

constexpr unsigned holding(unsigned index) { return spec::kHoldingBase + index; }

Bytes any_bytes(Rng& rng, std::size_t count) {
  Bytes bytes(count);
  for (std::uint8_t& byte : bytes) byte = byte_of(static_cast<unsigned>(rng.bits()));
  return bytes;
}

Bytes any_request(Rng& rng) {
  static const std::vector<Bytes> requests = valid_requests();
  if (rng.below(2) == 0) return requests[rng.below(requests.size())];
  const auto unit = byte_of(rng.below(8) == 0 ? 0 : kBusUnit);
  const auto value = static_cast<std::uint16_t>(rng.bits());
  // Below the line's own registers, LOCK and the control period, so that the run stays as it was set up.
  const auto reg = static_cast<unsigned>(1 + rng.below(spec::kRegAddress - 1));
  if (reg == spec::kRegLock || reg == spec::kRegTs) return four_words(unit, 3, holding(reg), 1);
  if (rng.below(3) != 0) return four_words(unit, 6, holding(reg), rng.below(4) == 0 ? value : value & 0xFFU);
  std::vector<std::uint16_t> values(1 + rng.below(std::min(16U, spec::kRegAddress - reg)));
  for (std::uint16_t& v : values) v = static_cast<std::uint16_t>(rng.below(200));
  const bool keeps_clear = reg > spec::kRegTs ||
                           (reg > spec::kRegLock && reg + values.size() <= spec::kRegTs) ||
                           reg + values.size() <= spec::kRegLock;
  return keeps_clear ? write_block(unit, holding(reg), values) : four_words(unit, 4, 0, 3);
}

}  // namespace

std::vector<Bytes> valid_requests() {
  std::vector<Bytes> list;
  constexpr auto kNoMode = static_cast<std::uint16_t>(spec::kHolding[spec::kRegMode].max + 1);
  for (const std::uint8_t unit : {kBusUnit, std::uint8_t{0}}) {
    list.push_back(four_words(unit, 3, holding(spec::kRegSetpoint), 2));
    list.push_back(four_words(unit, 3, holding(0), 33));  // too many: exception
    list.push_back(four_words(unit, 4, 0, 16));
    list.push_back(four_words(unit, 4, 0x50, 1));  // no such register
    list.push_back(four_words(unit, 6, holding(spec::kRegSetpoint), 1000));
    list.push_back(four_words(unit, 6, holding(spec::kRegMode), kNoMode));
    list.push_back(four_words(unit, 6, holding(spec::kRegCmd), spec::kCmdStop));
    list.push_back(four_words(unit, 6, holding(spec::kRegCmd), spec::kCmdRun));
    list.push_back(four_words(unit, 6, holding(spec::kRegCmd), spec::kCmdDiscard));
    list.push_back(four_words(unit, 8, 0, 0x5AA5));
    list.push_back(write_block(unit, holding(spec::kRegAtWindow), {12, 34}));
    list.push_back(write_block(unit, holding(spec::kRegSetpoint), {1000, 10, 10, 0}));
    list.push_back(sealed({unit, 17}));
    list.push_back(sealed({unit, 43, 14, 1, 0}));
    list.push_back(sealed({unit, 43, 14, 4, 1}));
    list.push_back(sealed({unit, 0x65, 1, 2, 3}));  // no such function
  }
  return list;
}

std::vector<Segment> data_bit_flips(const Bytes& request) {
  std::vector<Segment> list;
  for (std::size_t i = 0; i < 8 * request.size(); ++i) {
    Bytes bytes = request;
    bytes[i / 8] ^= byte_of(1U << (i % 8));
    list.push_back(segment_of(bytes));
  }
  return list;
}

std::vector<Segment> line_bit_flips(const Bytes& request, int char_bits) {
  std::vector<Segment> list;
  for (std::size_t i = 0; i < request.size(); ++i) {
    for (int bit = 0; bit < char_bits; ++bit) {
      list.push_back(segment_of(request));
      list.back().flips.push_back({i, bit});
    }
  }
  return list;
}

std::vector<Segment> truncations(const Bytes& request) {
  std::vector<Segment> list;
  for (std::size_t length = 1; length < request.size(); ++length)
    list.push_back(segment_of(std::span(request).first(length)));
  return list;
}

std::vector<Segment> merged_with(const Bytes& request, const Bytes& next) {
  std::vector<Segment> list;
  for (const double gap_bits : {0.0, 5.0, 15.0}) {
    Segment both = segment_of(request);
    const Segment second = segment_of(next);
    both.chars.insert(both.chars.end(), second.chars.begin(), second.chars.end());
    both.chars[request.size()].gap_bits = gap_bits;
    list.push_back(both);
  }
  return list;
}

std::vector<Segment> over_long(const Bytes& request) {
  std::vector<Segment> list;
  for (const std::size_t length : {kMostBytes - 1, kMostBytes, kMostBytes + 1, 3 * kMostBytes}) {
    Bytes body(request.begin(), request.end() - 2);
    body.resize(length - 2, 0x33);
    list.push_back(segment_of(sealed(body)));  // sound up to 256 bytes
  }
  return list;
}

std::vector<Segment> wrong_gaps(const Bytes& request, int char_bits) {
  std::vector<Segment> list;
  for (std::size_t i = 1; i < request.size(); ++i) {
    for (int quarter = 1; quarter < 14; ++quarter) {
      Segment segment = segment_of(request);
      segment.chars[i].gap_bits = 0.25 * quarter * char_bits;
      list.push_back(segment);
    }
  }
  return list;
}

Segment random_segment(Rng& rng, std::uint8_t format) {
  const int char_bits = char_bits_of(format);
  Bytes request = any_request(rng);
  Segment segment = segment_of(request);
  auto& chars = segment.chars;
  const auto any_char = [&]() -> UartChar& { return chars[rng.below(chars.size())]; };
  switch (rng.below(10)) {
    case 0:
      return segment;
    case 1:
      any_char().data ^= byte_of(1U << rng.below(8));
      return segment;
    case 2:
      segment.flips.push_back(
          {rng.below(chars.size()), static_cast<int>(rng.below(static_cast<unsigned>(char_bits)))});
      return segment;
    case 3:
      chars.resize(1 + rng.below(chars.size()));
      return segment;
    case 4: {
      const Segment next = segment_of(any_request(rng));
      const double gap_bits = 1.5 * char_bits * rng.uniform();
      chars.insert(chars.end(), next.chars.begin(), next.chars.end());
      chars[request.size()].gap_bits = gap_bits;
      return segment;
    }
    case 5: {  // longer than asked for, now and then longer than a frame may be
      Bytes body(request.begin(), request.end() - 2);
      const Bytes tail = any_bytes(rng, rng.below(rng.below(20) == 0 ? 400 : 12));
      body.insert(body.end(), tail.begin(), tail.end());
      return segment_of(rng.below(2) == 0 ? sealed(body) : body);
    }
    case 6:
      for (UartChar& c : chars) {
        if (rng.below(6) == 0) c.gap_bits = 3.49 * char_bits * rng.uniform();
      }
      chars[0].gap_bits = 0;
      return segment;
    case 7:
      (has_parity(format) && rng.below(2) == 0 ? any_char().wrong_parity : any_char().missing_stop) = true;
      return segment;
    case 8: {
      Bytes bytes = any_bytes(rng, 1 + rng.below(24));
      if (rng.below(2) == 0) bytes[0] = byte_of(rng.below(4) == 0 ? 0 : kBusUnit);
      return segment_of(bytes);
    }
    default: {
      Bytes body = any_bytes(rng, 2 + rng.below(12));  // sound, but for whom and what
      if (rng.below(2) == 0) body[0] = kBusUnit;
      return segment_of(sealed(body));
    }
  }
}

LineSetting random_line(Rng& rng) {
  constexpr std::array kBauds{std::uint16_t{5000}, std::uint16_t{1152}, std::uint16_t{96}};
  constexpr std::array kErrors{0.0, -0.035, -0.02, 0.02, 0.035};
  return {kBauds[rng.below(kBauds.size())], byte_of(static_cast<unsigned>(rng.below(4))),
          kErrors[rng.below(kErrors.size())]};
}

namespace {

// Operations of a program: the low three bits; the upper five are a number.
enum Op : std::uint8_t {
  kOpBytes = 0,       // 1 + number bytes follow
  kOpCrc = 1,         // the CRC of the segment so far
  kOpGap = 2,         // silence of two bits times the number before the next character
  kOpParity = 3,      // the next byte with wrong parity
  kOpNoStop = 4,      // the next byte without its stop bit
  kOpFlip = 5,        // of the last character, bit number modulo its bits
  kOpSend = 6,        // the segment ends here
  kOpRepeatByte = 7,  // the next byte, 8 times the number plus one
};
constexpr std::size_t kMostChars = 700;
constexpr std::size_t kMostSegments = 16;

class Program {
 public:
  explicit Program(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  bool done() const { return rest_.empty(); }
  std::uint8_t next() {
    if (rest_.empty()) return 0;
    const std::uint8_t byte = rest_.front();
    rest_ = rest_.subspan(1);
    return byte;
  }

 private:
  std::span<const std::uint8_t> rest_;
};

LineSetting line_of_program(std::uint8_t first) {
  constexpr std::array kErrors{0.0, -0.035, 0.035, 0.0};
  return {.format = byte_of(first & 3U), .host_clock_error_ratio = kErrors[first >> 2 & 3U]};
}

Bytes data_of(const Segment& segment) {
  Bytes bytes;
  for (const UartChar& c : segment.chars) bytes.push_back(c.data);
  return bytes;
}

void append(Segment& segment, const UartChar& character) {
  if (segment.chars.size() < kMostChars) segment.chars.push_back(character);
}

Bytes program_of(std::span<const std::uint8_t> body, bool with_crc) {
  Bytes program;
  for (std::size_t at = 0; at < body.size(); at += 32) {
    const std::size_t count = std::min<std::size_t>(32, body.size() - at);
    program.push_back(byte_of(static_cast<unsigned>(count - 1) << 3 | kOpBytes));
    program.insert(program.end(), body.begin() + static_cast<std::ptrdiff_t>(at),
                   body.begin() + static_cast<std::ptrdiff_t>(at + count));
  }
  if (with_crc) program.push_back(kOpCrc);
  program.push_back(kOpSend);
  return program;
}

}  // namespace

void drive(std::span<const std::uint8_t> bytes) {
  Program program(bytes);
  const LineSetting line = line_of_program(program.next());
  const int char_bits = char_bits_of(line.format);
  BusLine bus(model_station(chip_on_line(line)), line);
  Segment segment;
  double gap_bits = 0;
  std::size_t sent = 0;
  const auto character = [&](UartChar c) {
    c.gap_bits = segment.chars.empty() ? 0 : gap_bits;
    gap_bits = 0;
    append(segment, c);
  };
  while (!program.done() && sent < kMostSegments) {
    const std::uint8_t op = program.next();
    const unsigned number = op >> 3;
    switch (op & 7U) {
      case kOpBytes:
        for (unsigned i = 0; i <= number && !program.done(); ++i) character({.data = program.next()});
        break;
      case kOpCrc: {
        const std::uint16_t crc = crc_of(data_of(segment));
        character({.data = byte_of(crc)});
        character({.data = byte_of(crc >> 8)});
        break;
      }
      case kOpGap:
        gap_bits = std::min(2.0 * number, 3.49 * char_bits);
        break;
      case kOpParity:
        character({.data = program.next(), .wrong_parity = has_parity(line.format)});
        break;
      case kOpNoStop:
        character({.data = program.next(), .missing_stop = true});
        break;
      case kOpFlip:
        if (!segment.chars.empty() && segment.flips.empty())
          segment.flips.push_back({segment.chars.size() - 1, static_cast<int>(number) % char_bits});
        break;
      case kOpRepeatByte: {
        const std::uint8_t byte = program.next();
        for (unsigned i = 0; i < 8 * number + 1; ++i) character({.data = byte});
        break;
      }
      default:
        bus.put(segment);
        segment = {};
        ++sent;
        break;
    }
  }
  bus.put(segment);
}

std::vector<Bytes> seed_programs() {
  std::vector<Bytes> list;
  std::uint8_t line = 0;
  for (const Bytes& request : valid_requests()) {
    const std::span body = std::span(request).first(request.size() - 2);
    Bytes program = program_of(body, true);
    program.insert(program.begin(), line++);
    const Bytes cut = program_of(body, false);
    program.insert(program.end(), cut.begin(), cut.end());
    list.push_back(program);
  }
  list.push_back(
      {0, byte_of(31U << 3 | kOpRepeatByte), 0x11, byte_of(5U << 3 | kOpRepeatByte), 0x11, kOpCrc, kOpSend});
  list.push_back({1, byte_of(1U << 3 | kOpBytes), kBusUnit, 17, byte_of(15U << 3 | kOpGap), kOpCrc, kOpSend,
                  kOpNoStop, 0, kOpParity, 1, kOpSend});
  list.push_back({3, byte_of(1U << 3 | kOpBytes), kBusUnit, 17, kOpFlip, kOpCrc, kOpSend});
  return list;
}

}  // namespace meltstage::tb
