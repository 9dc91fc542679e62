// SPDX-License-Identifier: Apache-2.0
// Pieces of the functional set: Modbus frames, good and bad, and settings of the line.
#include "asic/signoff/piece_steps.hpp"

namespace meltstage::app {

namespace {

class LinePieces : private PieceSteps {
 public:
  explicit LinePieces(PieceState& state) : PieceSteps(state) {}

  void record() {
    protocol();
    line_settings();
  }

 private:
  std::vector<std::uint8_t> any_bytes(std::size_t count) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(random_.bits()));
    return bytes;
  }

  void protocol() {
    begin("Modbus: functions, exceptions, broadcast, lengths, damaged frames");
    const std::uint8_t me = s_.address();
    for (unsigned i = 0; i < 12; ++i)
      s_.ask(tb::diagnostic_echo(me, static_cast<std::uint16_t>(random_.bits())));
    for (const std::uint8_t function :
         std::initializer_list<std::uint8_t>{0, 1, 2, 5, 15, 22, 23, 43, 44, 64, 85, 127}) {
      const std::uint8_t bytes[] = {me, function, 0, 1, 2, 3};
      s_.refused(tb::with_crc(bytes), spec::kExcFunction);
    }
    // Sixteen words of any value: the frame is stored whole before it is refused.
    for (unsigned i = 0; i < often(8, 2); ++i) {
      std::vector<std::uint16_t> words;
      for (unsigned w = 0; w < 16; ++w) words.push_back(static_cast<std::uint16_t>(random_.bits()));
      words[0] = 0xFFFF;
      s_.refused(tb::write_multiple_registers(me, spec::kHoldingBase + spec::kRegPwmMinOn, words),
                 spec::kExcAddress);
      s_.refused(tb::write_multiple_registers(me, spec::kHoldingBase + spec::kRegSetpoint, words),
                 spec::kExcValue);
    }
    const std::vector<std::uint16_t> many(spec::kWriteWords + 1, 1);
    s_.refused(tb::write_multiple_registers(me, spec::kHoldingBase + 1, many), spec::kExcValue);
    s_.refused(tb::read_input_registers(me, 0, spec::kMaxRead + 1), spec::kExcValue);
    s_.refused(tb::read_input_registers(me, 0, 0), spec::kExcValue);
    for (unsigned i = 0; i < often(16, 4); ++i) {
      const auto address = static_cast<std::uint16_t>(0x0200 + below(0xFE00));
      s_.refused(tb::read_input_registers(me, address, 1), spec::kExcAddress);
      s_.refused(write_request(static_cast<std::uint16_t>(address - spec::kHoldingBase), 0),
                 spec::kExcAddress);
    }
    for (std::uint16_t reg = spec::kRegSetpoint; reg < spec::kHoldingCount; ++reg) {
      const spec::RegisterInfo& info = spec::kHolding[reg];
      if (info.max < (info.is_signed ? 32767 : 65535))
        s_.refused(write_request(reg, info.max + 1), spec::kExcValue);
      if (info.min > (info.is_signed ? -32768 : 0))
        s_.refused(write_request(reg, info.min - 1), spec::kExcValue);
    }
    for (unsigned i = 0; i < often(40, 8); ++i) {
      const auto word = static_cast<std::uint16_t>(0xA500 ^ (1U << below(16)) ^ below(256));
      const bool known = word == spec::kCmdRun || word == spec::kCmdClearFault || word == spec::kCmdHold ||
                         word == spec::kCmdCommit || word == spec::kCmdDiscard || word == spec::kCmdTune ||
                         word == spec::kCmdStop;
      if (!known) s_.refused(write_request(spec::kRegCmd, word), spec::kExcValue);
    }
    s_.refused(tb::read_device_identification(me, spec::kIdentificationObject, 3), spec::kExcAddress);
    s_.refused(tb::read_device_identification(me, 0, 0), spec::kExcValue);
    s_.refused(write_request(spec::kRegCmd, spec::kCmdTune), spec::kExcDevice);
    s_.refused(write_request(spec::kRegSetpoint, 5000), spec::kExcValue);
    s_.unanswered(tb::write_single_register(0, spec::kHoldingBase + spec::kRegKp, 0x1234));
    s_.unanswered(tb::write_single_register(0, spec::kHoldingBase + spec::kRegCmd, spec::kCmdStop));
    s_.unanswered(tb::read_input_registers(0, 0, 1));
    for (const std::uint8_t other : std::initializer_list<std::uint8_t>{0x55, 0xAA, 0xF7, 0x02, 0x03, 0x05,
                                                                        0x09, 0x11, 0x21, 0x41, 0x81})
      s_.unanswered(tb::read_input_registers(other, 0, 1));
    for (unsigned i = 0; i < often(40, 6); ++i) s_.unanswered(tb::raw_frame(any_bytes(1 + below(24))));
    for (unsigned i = 0; i < often(40, 6); ++i) {
      tb::ModbusRequest request = tb::diagnostic_echo(me, static_cast<std::uint16_t>(random_.bits()));
      tb::UartChar& character = request.frame[below(static_cast<std::uint32_t>(request.frame.size()))];
      (i % 2 != 0 ? character.wrong_parity : character.missing_stop) = true;
      s_.unanswered(request);
    }
    for (const unsigned length : {255U, 256U, 257U, 300U}) s_.unanswered(tb::raw_frame(any_bytes(length)));
    for (const unsigned clocks : {1U, 4U, 8U, 14U}) s_.glitch(clocks);
    s_.read_inputs();
    counted_frames();
  }

  // Each fault of the line counts up: a character at a time, a frame of one byte, a broadcast without an
  // answer.
  void counted_frames() {
    begin("Modbus: counts of damaged characters, CRC errors and messages");
    constexpr double kEnds_bits = 30, kSilence_bits = 40;  // gives an incomplete frame up; ends a whole one
    tb::ModbusRequest damaged = tb::raw_frame(any_bytes(often(16600, 270)));
    for (tb::UartChar& character : damaged.frame) character.wrong_parity = true;
    s_.unanswered(damaged);
    tb::ModbusRequest single = tb::raw_frame(any_bytes(often(4200, 70)));
    for (tb::UartChar& character : single.frame) character.gap_bits = kEnds_bits;
    s_.unanswered(single);
    const std::uint8_t who[] = {0, 17};
    tb::ModbusRequest broadcasts;
    for (unsigned i = 0; i < often(2100, 70); ++i) {
      tb::ModbusRequest one = tb::with_crc(who);
      one.frame.front().gap_bits = kSilence_bits;
      broadcasts.frame.insert(broadcasts.frame.end(), one.frame.begin(), one.frame.end());
    }
    s_.unanswered(broadcasts);
    s_.read_inputs();
  }

  void line_settings() {
    begin("line: baud rates, formats, addresses, telemetry at each");
    struct Setting {
      std::uint16_t baud, format;
      std::uint8_t address;
    };
    for (const Setting& to :
         {Setting{4095, 1, 0xF7}, Setting{2730, 2, 0x55}, Setting{1365, 3, 0xAA & 0xF7}, Setting{960, 4, 1},
          Setting{3071, 6, 0x0F}, Setting{kFastBaud, 7, 0xF0}, Setting{kFastBaud, 0, 1}}) {
      const std::int32_t values[] = {to.address, to.baud, to.format};
      s_.write(spec::kRegAddress, values);
      s_.ticks();
      s_.set_line(to.baud, to.format, to.address);
      s_.run(20000);
      s_.ask(tb::report_server_id(s_.address()));
      s_.read_inputs();
      s_.unanswered(tb::raw_frame(any_bytes(5)));
      constexpr std::uint64_t kFrames = 50000;  // clocks
      set(spec::kRegTlmPeriod, 1);
      s_.run(kFrames);
      set(spec::kRegTlmPeriod, 0);
      s_.run(kFrames);  // to the end of the last; a new rate waits for that
    }
  }
};

}  // namespace

void record_line(PieceState& state) { LinePieces(state).record(); }

}  // namespace meltstage::app
