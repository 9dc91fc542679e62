// SPDX-License-Identifier: Apache-2.0
#include "uart_frame.hpp"

#include "math.hpp"
#include "spec.hpp"
#include "uart_line.hpp"

namespace meltstage::chip {
namespace {

constexpr unsigned kLeastBytes = 4;  // address, function code, CRC
constexpr unsigned kMostBytes = 256;
constexpr unsigned kOverLong = 257;  // count_q stays here
constexpr unsigned kStopBytes = 8;
constexpr unsigned kFirstWord = 7;  // byte place of the data words of FC 16
constexpr unsigned kWordsEnd = kFirstWord + 2 * spec::kWriteWords;

void set_high(std::uint16_t& word, std::uint8_t byte) {
  word = static_cast<std::uint16_t>(byte << 8 | (word & 0xFFu));
}
void set_low(std::uint16_t& word, std::uint8_t byte) {
  word = static_cast<std::uint16_t>((word & 0xFF00u) | byte);
}

bool is_for(std::uint8_t address, std::uint8_t data) {
  return data == address || data == spec::kBroadcastAddress;
}

// STOP on the wire: address, 06, CMD register, Stop, CRC (judged at the end).
bool stop_byte(unsigned place, std::uint8_t data, std::uint8_t address) {
  switch (place) {
    case 0:
      return is_for(address, data);
    case 1:
      return data == spec::kFcWriteSingle;
    case 2:
      return data == spec::kHoldingBase >> 8;
    case 3:
      return data == (spec::kHoldingBase & 0xFFu);
    case 4:
      return data == spec::kCmdStop >> 8;
    case 5:
      return data == (spec::kCmdStop & 0xFFu);
    default:
      return true;
  }
}

}  // namespace

void UartFrame::step(const UartFrameIn& in) {
  stop_q = 0;
  good_q = 0;
  if (in.valid) add_byte(in);
  if (in.cmd_done) cmd_valid_q = 0;
  if (!in.valid && judges(in)) judge();
}

void UartFrame::add_byte(const UartFrameIn& in) {
  const bool skip = skip_q != 0 || in.busy || cmd_valid_q != 0;
  if (!skip) {
    if (in.error || count_q == kMostBytes) ++char_errors_q;
    store(in.data);
  }
  crc_q = crc16_byte(crc_q, in.data);
  bad_q |= in.error ? 1 : 0;
  skip_q = skip ? 1 : 0;
  const bool stop_so_far = count_q == 0 || stop_like_q != 0;
  stop_like_q = stop_so_far && stop_byte(count_q, in.data, in.address);
  if (count_q == 0) match_q = is_for(in.address, in.data);
  if (count_q != kOverLong) ++count_q;
}

void UartFrame::store(std::uint8_t data) {
  switch (count_q) {
    case 0:
      broadcast_q = data == spec::kBroadcastAddress;
      break;
    case 1:
      fc_q = data;
      break;
    case 2:
      set_high(a_q, data);
      break;
    case 3:
      set_low(a_q, data);
      break;
    case 4:
      set_high(b_q, data);
      break;
    case 5:
      set_low(b_q, data);
      break;
    case 6:
      bytes_q = data;
      break;
    default:
      if (count_q < kWordsEnd) {
        const unsigned place = count_q - kFirstWord;
        std::uint16_t& word = words_q[place >> 1];
        if ((place & 1u) == 0)
          set_high(word, data);
        else
          set_low(word, data);
      }
      break;
  }
}

bool UartFrame::bad() const { return bad_q != 0 || count_q == kOverLong; }
bool UartFrame::good() const { return crc_q == 0 && count_q >= kLeastBytes && !bad(); }

// The end of a frame.
void UartFrame::judge() {
  if (good() && match_q != 0) {
    stop_q = stop_like_q != 0 && count_q == kStopBytes;
    if (skip_q == 0) {
      cmd_valid_q = 1;
      good_q = 1;
      len_q = count_q;
      ++messages_q;
    }
  }
  if (!good() && !bad() && skip_q == 0) ++crc_errors_q;
  count_q = 0;
  crc_q = 0xFFFF;
  bad_q = 0;
  skip_q = 0;
}

}  // namespace meltstage::chip
