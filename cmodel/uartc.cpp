// SPDX-License-Identifier: Apache-2.0
#include "uartc.hpp"

#include <algorithm>

namespace meltstage::chip {
namespace {

constexpr std::uint8_t kConformity = 0x81;  // basic identification, stream and single objects
constexpr unsigned kObjects = spec::kIdentObjects.size();

// Places of bytes in the answers.
constexpr unsigned kFirstData = 3;  // first register byte
constexpr unsigned kServerText = 5;
constexpr unsigned kObjectId = 8;
constexpr unsigned kObjectText = 10;

constexpr std::uint8_t kTelemetryBytes = 2 * spec::kTelemetryWords;
constexpr unsigned kTelemetryLast = kFirstData + kTelemetryBytes - 1;

std::uint8_t high(std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8); }
std::uint8_t low(std::uint16_t word) { return static_cast<std::uint8_t>(word & 0xFFu); }

// A place past the text reads 0, as does an object that does not exist.
std::uint8_t ident_byte(unsigned place) {
  return place < spec::kIdentBytes.size() ? static_cast<std::uint8_t>(spec::kIdentBytes[place])
                                          : std::uint8_t{0};
}
std::uint8_t address_of(const UartcIn& in) {
  return in.cfg_address != 0 ? in.cfg_address : static_cast<std::uint8_t>(1u + in.strap);
}
spec::IdentPart ident_object(unsigned object) {
  return object < kObjects ? spec::kIdentObjects[object] : spec::IdentPart{0, 0};
}

}  // namespace

void Uartc::take_over(const UartcIn& in) {
  baud_q = in.cfg_baud;
  format_q = in.cfg_format;
  pause_q = in.cfg_pause;
  address_q = address_of(in);
}

bool Uartc::taken_over(const UartcIn& in) const {
  return baud_q == in.cfg_baud && format_q == in.cfg_format && (pause_q != 0) == in.cfg_pause &&
         address_q == address_of(in);
}

UartFrameIn Uartc::heard(const UartcIn& in) const {
  return {rx.valid_q != 0, rx.shift_q, rx.error_q != 0, rx.gap(),
          rx.give_up(),    address_q,  rsp_busy(),      in.cmd_done};
}

std::uint64_t Uartc::quiet(const UartcIn& in) const {
  if (pulses() || in.tlm_start || in.cmd_done) return 0;
  if (idle()) return in.rx != 0 && taken_over(in) ? kForever : 0;
  const bool starts = (rsp_active_q != 0 && tx.busy_q == 0) || (tlm_active_q != 0 && tlm.busy_q == 0);
  const bool wants = (rsp_active_q != 0 && rsp_reading() && rsp_have_q == 0) ||
                     (tlm_active_q != 0 && tlm_reading() && tlm_have_q == 0);
  if (starts || wants || frame.judges(heard(in))) return 0;
  return std::min({rx.quiet(in.rx, baud_q), tx.quiet(baud_q), tlm.quiet(baud_q)});
}

void Uartc::skip(const UartcIn& in, std::uint64_t clocks) {
  rx.skip(in.rx, baud_q, clocks);
  tx.skip(baud_q, clocks);
  tlm.skip(baud_q, clocks);
}

void Uartc::step(const UartcIn& in) {
  const bool at_rest = idle();
  if (at_rest && in.rx != 0 && !in.tlm_start && !pulses()) {
    take_over(in);
    return;
  }

  // What the parts see of each other is what stood before the edge: each is stepped before the part it looks
  // at.
  const bool rsp_wants = rsp_active_q != 0 && rsp_reading() && (rsp_have_q | rd_rsp_q) == 0;
  const bool tlm_wants = tlm_active_q != 0 && tlm_reading() && (tlm_have_q | rd_tlm_q) == 0;
  if (rsp_wants)
    rd_addr_q = static_cast<std::uint16_t>(cmd_a() + ((rsp_place_q - kFirstData) >> 1));
  else if (tlm_wants)
    rd_addr_q = static_cast<std::uint16_t>((tlm_place_q - kFirstData) >> 1);
  UartTxIn answer{rsp_active_q != 0 && (!rsp_reading() || rsp_have_q != 0), 0, false};
  if (tx.char_ends(baud_q)) {
    answer.data = rsp_byte();
    answer.last = rsp_last();
  }
  UartTxIn telemetry{tlm_active_q != 0 && (!tlm_reading() || tlm_have_q != 0), 0, false};
  if (tlm.char_ends(baud_q)) {
    telemetry.data = tlm_byte();
    telemetry.last = tlm_last();
  }
  const UartFrameIn frame_in = heard(in);

  step_answer(in);
  step_telemetry(in);
  rd_rsp_q = rsp_wants;
  rd_tlm_q = tlm_wants && !rsp_wants;  // the answer's words first
  tx.step(answer, baud_q, format_q);
  tlm.step(telemetry, baud_q, format_q);
  frame.step(frame_in);
  rx.step(in.rx, baud_q, format_q, pause_q != 0);
  if (at_rest) take_over(in);
}

bool Uartc::rsp_reading() const { return rsp_kind_q == spec::kRspRead && rsp_place_q >= kFirstData; }

bool Uartc::rsp_object_end() const {
  const bool ident = rsp_kind_q == spec::kRspIdStream || rsp_kind_q == spec::kRspIdObject;
  return ident && rsp_place_q == kObjectText - 1 + ident_object(rsp_object_q).length;
}

bool Uartc::rsp_last() const {
  switch (rsp_kind_q) {
    case spec::kRspException:
      return rsp_place_q == 2;
    case spec::kRspRead:
      return rsp_place_q == kFirstData - 1 + 2 * (cmd_b() & 63u);
    case spec::kRspEcho:
      return rsp_place_q == 5;
    case spec::kRspServerId:
      return rsp_place_q == kServerText - 1 + spec::kIdentServer.length;
    case spec::kRspIdStream:
      return rsp_object_end() && rsp_object_q == kObjects - 1;
    default:
      return rsp_object_end();
  }
}

std::uint8_t Uartc::rsp_byte() const {
  const unsigned place = rsp_place_q;
  if (place == 0) return address_q;
  if (place == 1) return rsp_kind_q == spec::kRspException ? cmd_fc() | spec::kExceptionFlag : cmd_fc();
  switch (rsp_kind_q) {
    case spec::kRspException:
      return rsp_exc_q;
    case spec::kRspRead:
      if (!rsp_reading()) return static_cast<std::uint8_t>(2 * (cmd_b() & 63u));
      return (place & 1u) != 0 ? high(rsp_word_q) : low(rsp_word_q);
    case spec::kRspEcho:
      switch (place & 3u) {
        case 2:
          return high(cmd_a());
        case 3:
          return low(cmd_a());
        case 0:
          return high(cmd_b());
        default:
          return low(cmd_b());
      }
    case spec::kRspServerId:
      if (place == 2) return spec::kIdentServer.length + 2;
      if (place == 3) return high(spec::kDeviceId);
      if (place == 4) return rsp_exc_q;
      return ident_byte((spec::kIdentServer.start + place - kServerText) & 0xFFu);
    default:
      switch (place) {
        case 2:
          return high(cmd_a());  // MEI type
        case 3:
          return low(cmd_a());  // code of the request
        case 4:
          return kConformity;
        case 5:  // nothing follows
        case 6:  // so no next object
          return 0;
        case 7:
          return rsp_kind_q == spec::kRspIdStream ? kObjects : 1;
        case 8:
          return rsp_object_q;
        case 9:
          return ident_object(rsp_object_q).length;
        default:
          return ident_byte((ident_object(rsp_object_q).start + place - kObjectText) & 0xFFu);
      }
  }
}

void Uartc::step_answer(const UartcIn& in) {
  const bool answered = in.cmd_done && cmd_valid() && !cmd_broadcast() &&
                        in.rsp_kind >= spec::kRspException && in.rsp_kind <= spec::kRspIdObject;
  if (answered) {
    rsp_active_q = 1;
    rsp_kind_q = in.rsp_kind;
    rsp_exc_q = in.rsp_exc;
    rsp_place_q = 0;
    rsp_object_q = in.rsp_kind == spec::kRspIdObject ? high(cmd_b()) & 3u : 0;
    rsp_have_q = 0;
  } else if (rd_rsp_q != 0) {
    if (!in.rd_wait) {
      rsp_word_q = in.rd_data;
      rsp_have_q = 1;
    }
  } else if (tx.take()) {
    const bool last = rsp_last();
    const bool next_object = rsp_object_end();
    if ((rsp_place_q & 1u) == 0) rsp_have_q = 0;
    ++rsp_place_q;
    if (last) {
      rsp_active_q = 0;
    } else if (next_object) {
      rsp_object_q = (rsp_object_q + 1u) & 3u;
      rsp_place_q = kObjectId;
    }
  }
}

bool Uartc::tlm_reading() const { return tlm_place_q >= kFirstData; }

bool Uartc::tlm_last() const { return tlm_place_q == kTelemetryLast; }

std::uint8_t Uartc::tlm_byte() const {
  switch (tlm_place_q) {
    case 0:
      return address_q;
    case 1:
      return spec::kFcReadInput;
    case 2:
      return kTelemetryBytes;
    default:
      return (tlm_place_q & 1u) != 0 ? high(tlm_word_q) : low(tlm_word_q);
  }
}

void Uartc::step_telemetry(const UartcIn& in) {
  if (in.tlm_start && !tlm_busy()) {
    tlm_active_q = 1;
    tlm_place_q = 0;
    tlm_have_q = 0;
  } else if (rd_tlm_q != 0) {
    tlm_word_q = in.rd_data;
    tlm_have_q = 1;
  } else if (tlm.take()) {
    if (tlm_last()) tlm_active_q = 0;
    if ((tlm_place_q & 1u) == 0) tlm_have_q = 0;
    tlm_place_q = (tlm_place_q + 1u) & 63u;
  }
}

}  // namespace meltstage::chip
