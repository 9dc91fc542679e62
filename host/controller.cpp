// SPDX-License-Identifier: Apache-2.0
#include "host/controller.hpp"

#include <errno.h>
#include <fmt/format.h>
#include <modbus.h>
#include <sys/file.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include "base/error.hpp"
#include "base/place.hpp"
#include "host/exception_text.hpp"

namespace meltstage::host {

namespace {

namespace spec = chip::spec;

// Between a Commit and the control tick that carries it out, TS <= 2 s, the chip is busy.
constexpr auto kBusyPause = std::chrono::milliseconds(50);
constexpr std::chrono::seconds kLongestTick{60};  // TS is 2 s at most, but a chip in a simulator takes longer
constexpr int kBusyAttempts = 60;

constexpr std::uint16_t kLockAddress = spec::kHoldingBase + spec::kRegLock;

// What libmodbus can set a serial port to, inside the chip's range.
constexpr std::array kBauds{1200,  1800,  2400,   4800,   9600,   19200,
                            38400, 57600, 115200, 230400, 460800, 500000};

// Exception code that the chip answered with; 0 when the error is another one.
int exception_code(int error) {
  return error > MODBUS_ENOBASE && error < MODBUS_ENOBASE + MODBUS_EXCEPTION_MAX ? error - MODBUS_ENOBASE : 0;
}

// Writes the words, and takes no other write's echo for the answer: an answer repeats address and value, or
// address and count (Modbus Application Protocol V1.1b3, 6.6 and 6.12). As a call of libmodbus: a negative
// number and errno.
int write_words(modbus_t* context, int unit, std::uint16_t address, std::span<const std::uint16_t> words) {
  constexpr std::size_t kEchoed = 6;  // unit, function, address, value or count
  constexpr int kMostStrayFrames = 4;
  const auto add = [](std::vector<std::uint8_t>& bytes, std::size_t word) {
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
  };
  const bool single = words.size() == 1;
  std::vector<std::uint8_t> request = {
      static_cast<std::uint8_t>(unit),
      static_cast<std::uint8_t>(single ? spec::kFcWriteSingle : spec::kFcWriteMultiple)};
  add(request, address);
  add(request, single ? words.front() : words.size());
  if (!single) {
    request.push_back(static_cast<std::uint8_t>(2 * words.size()));
    for (const std::uint16_t word : words) add(request, word);
  }
  if (modbus_send_raw_request(context, request.data(), static_cast<int>(request.size())) < 0) return -1;
  for (int frame = 0; frame < kMostStrayFrames; ++frame) {
    std::array<std::uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> answer{};
    if (modbus_receive_confirmation(context, answer.data()) < 0) return -1;
    constexpr std::uint8_t kException = 0x80;
    if (answer[0] == request[0] && answer[1] == (request[1] | kException)) {
      errno = MODBUS_ENOBASE + answer[2];
      return -1;
    }
    if (std::equal(request.begin(), request.begin() + kEchoed, answer.begin())) return 1;
  }
  errno = EMBBADDATA;
  return -1;
}

// Refused by the chip itself; code is the exception's.
struct Refusal : BusError {
  Refusal(const std::string& text, int answered, bool again)
      : BusError(text), code(answered), repeated(again) {}
  int code;
  bool repeated;  // what was asked before may have been done, and its answer lost
};

constexpr std::string_view kLockIsOn = "; LOCK is on, LOCK=0 opens it";

bool has_bit(std::uint16_t status, spec::StatusBit bit) { return (status >> bit & 1) != 0; }

void require(bool good, const std::string& text) {
  if (!good) throw UserError(text);
}

// "8E1, 8O1, 8N2 or 8N1"
std::string formats_text() {
  constexpr auto& kFormats = spec::kCharacters;
  std::string text;
  for (std::size_t i = 0; i < kFormats.size(); ++i) {
    if (i != 0) text += i + 1 == kFormats.size() ? " or " : ", ";
    text += kFormats[i].name;
  }
  return text;
}

std::string format_text(const LineFormat& f) { return fmt::format("8{}{}", f.parity, f.stop_bits); }

void check(const Connection& c) {
  require(c.address >= 1 && c.address <= 247, fmt::format("address: found {}, expected 1 to 247", c.address));
  require(std::find(kBauds.begin(), kBauds.end(), c.baud) != kBauds.end(),
          fmt::format("baud rate: found {}, expected one of {}", c.baud, fmt::join(kBauds, ", ")));
  require(c.timeout_s >= 0.01 && c.timeout_s <= 60.0,
          fmt::format("time-out: found {:g} s, expected 0.01 to 60 s", c.timeout_s));
  require(c.attempts >= 1, fmt::format("attempts: found {}, expected 1 or more", c.attempts));
  parse_format(format_text(c.format));
}

// A pseudo-terminal has no line: its second program can't ask for parity (tcsetattr(3) refuses).
char parity_for(const Connection& c) {
  std::error_code ignored;
  const auto device = std::filesystem::canonical(c.device, ignored);
  return device.parent_path() == "/dev/pts" ? 'N' : c.format.parity;
}

bool is_holding(const Setting& setting, spec::Reg reg) {
  return setting.reg->address == spec::kHoldingBase + reg;
}

bool is_set(std::uint16_t status, spec::StatusBit bit) { return (status >> bit & 1u) != 0; }

// The chip then speaks otherwise on its line, and a poll in this connection's way finds nobody.
bool changes_line(std::span<const Setting> settings) {
  return std::any_of(settings.begin(), settings.end(), [](const Setting& s) {
    return is_holding(s, spec::kRegBaud) || is_holding(s, spec::kRegFormat) ||
           is_holding(s, spec::kRegAddress);
  });
}

// Runs of neighbouring addresses, none longer than `most`; [first, last) of a sorted sequence.
template <class Item, class AddressOf, class Use>
void for_each_run(const std::vector<Item>& sorted, std::size_t most, AddressOf&& address_of, Use&& use) {
  for (std::size_t first = 0; first < sorted.size();) {
    std::size_t last = first + 1;
    while (last < sorted.size() && last - first < most &&
           address_of(sorted[last]) == address_of(sorted[last - 1]) + 1)
      ++last;
    use(first, last);
    first = last;
  }
}

}  // namespace

LineFormat parse_format(const std::string& text) {
  for (const spec::CharacterInfo& character : spec::kCharacters) {
    if (text == character.name) return {character.parity, character.stop_bits};
  }
  throw UserError(fmt::format("format: found \"{}\", expected {}", shown(text), formats_text()));
}

struct Controller::Modbus {
  struct Free {
    void operator()(modbus_t* opened) const {
      modbus_close(opened);
      modbus_free(opened);
    }
  };
  std::unique_ptr<modbus_t, Free> context;
  modbus_t* get() const { return context.get(); }
};

// The port is ours while this lives.
class Controller::Locked {
 public:
  Locked(const Modbus& modbus, const std::string& device) : port_(modbus_get_socket(modbus.get())) {
    while (flock(port_, LOCK_EX) != 0) {
      if (errno == EINTR) continue;
      throw BusError(fmt::format("{}: cannot be locked against other programs: found \"{}\"", device,
                                 std::generic_category().message(errno)));
    }
  }
  ~Locked() { flock(port_, LOCK_UN); }
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;

 private:
  int port_;
};

Controller::Controller(const Connection& connection) : connection_(connection), modbus_(new Modbus) {
  check(connection);
  // libmodbus would print a line of its own.
  require(!connection.device.empty(),
          "port: found an empty name, expected a serial device such as /dev/ttyUSB0");
  modbus_->context.reset(modbus_new_rtu(connection.device.c_str(), connection.baud, parity_for(connection), 8,
                                        connection.format.stop_bits));
  modbus_t* context = modbus_->get();
  require(context != nullptr, connection.device + ": cannot be used as a port, expected a serial device");
  modbus_set_slave(context, connection.address);
  const auto whole = static_cast<std::uint32_t>(connection.timeout_s);
  const auto micros = static_cast<std::uint32_t>((connection.timeout_s - whole) * 1e6);
  modbus_set_response_timeout(context, whole, micros);
  modbus_set_byte_timeout(context, whole, micros);
  if (modbus_connect(context) != 0) {
    throw UserError(fmt::format("{}: cannot be opened: found \"{}\", expected a serial port",
                                connection.device, std::generic_category().message(errno)));
  }
}

Controller::~Controller() = default;

// Calls libmodbus until a sound answer comes or the attempts are used up. An answer tells nothing of its
// request but what a write repeats, so one that comes late must be none to the next. A copy of a sound answer
// to a read, as a gateway that repeats frames may send it, can't be told from the next one's.
template <class Call>
void Controller::transact(const std::string& what, Call&& call) {
  bool late = false;  // an earlier attempt's answer, or the repeat's, may still come
  int attempt = 1;
  // Where all answers are late, those to repeats come behind the first one as far apart as they were sent.
  // libmodbus counts no bytes that it throws away, so silence can't be waited for.
  const auto let_it_come = [&] {
    if (late)
      std::this_thread::sleep_for((attempt + 1) * std::chrono::duration<double>(connection_.timeout_s));
  };
  int busy = 0;
  for (;;) {
    modbus_flush(modbus_->get());
    if (call(modbus_->get()) >= 0) return let_it_come();
    const int error = errno;
    if (const int code = exception_code(error); code != 0) {
      let_it_come();
      late = false;
      if (code == MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY && ++busy < kBusyAttempts) {
        std::this_thread::sleep_for(kBusyPause);
        continue;
      }
      const bool repeated = attempt > 1;
      throw Refusal(
          fmt::format(
              "{}: refused by the chip with exception {:02} ({}){}", what, code, exception_text(code),
              repeated ? "; an answer before was lost, so the chip may have done it then: read it back" : ""),
          code, repeated);
    }
    if (error == EIO || error == EBADF)
      throw NoAnswer(fmt::format("{}: the port is gone ({})", connection_.device,
                                 std::generic_category().message(error)));
    late = true;
    if (attempt++ < connection_.attempts) continue;
    let_it_come();
    if (error == ETIMEDOUT) {
      throw NoAnswer(
          fmt::format("{}: no answer from address {} ({} x {:g} s), expected the chip; see wiring, "
                      "address, baud rate and format",
                      connection_.device, connection_.address, connection_.attempts, connection_.timeout_s));
    }
    throw NoAnswer(fmt::format("{}: {}: garbled answer ({}); see wiring, baud rate and format",
                               connection_.device, what, modbus_strerror(error)));
  }
}

std::vector<std::uint16_t> Controller::poll(std::uint16_t address, std::uint16_t count,
                                            const std::string& what) {
  std::vector<std::uint16_t> words(count);
  transact(what, [&](modbus_t* context) {
    return address < spec::kHoldingBase ? modbus_read_input_registers(context, address, count, words.data())
                                        : modbus_read_registers(context, address, count, words.data());
  });
  return words;
}

std::vector<std::uint16_t> Controller::read(std::span<const Register* const> wanted) {
  std::vector<const Register*> sorted(wanted.begin(), wanted.end());
  for (const Register* r : sorted)
    require(r->readable,
            fmt::format("{}: can be written only, expected a register that can be read", r->name));
  const auto by_address = [](const Register* a, const Register* b) { return a->address < b->address; };
  std::sort(sorted.begin(), sorted.end(), by_address);
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());

  const Locked locked(*modbus_, connection_.device);
  std::vector<std::uint16_t> words;
  for_each_run(
      sorted, spec::kMaxRead, [](const Register* r) { return r->address; },
      [&](std::size_t first, std::size_t last) {
        const auto part = poll(sorted[first]->address, static_cast<std::uint16_t>(last - first),
                               std::string(sorted[first]->name));
        words.insert(words.end(), part.begin(), part.end());
      });
  std::vector<std::uint16_t> answer;
  for (const Register* r : wanted) {
    const auto at = std::lower_bound(sorted.begin(), sorted.end(), r, by_address);
    answer.push_back(words[static_cast<std::size_t>(at - sorted.begin())]);
  }
  return answer;
}

double Controller::read(const Register& reg) {
  const Register* const one = &reg;
  const std::uint16_t word = read(std::span(&one, 1)).front();
  if (is_no_value(reg, word))
    throw BusError(
        fmt::format("{}: found no value, expected one: nothing before the first sample", reg.name));
  return to_unit(reg, word);
}

Identity Controller::identity() {
  const Locked locked(*modbus_, connection_.device);
  std::array<std::uint8_t, 256> raw{};
  int length = 0;
  transact("identity (function 17)", [&](modbus_t* context) {
    return length = modbus_report_slave_id(context, static_cast<int>(raw.size()), raw.data());
  });
  constexpr int kBeforeText = 2;  // id, run indicator
  length = std::clamp(length, kBeforeText, static_cast<int>(raw.size()));
  const auto words = poll(spec::kInDeviceId, 3, "DEVICE_ID");
  return {std::string(raw.begin() + kBeforeText, raw.begin() + length), words[0], words[1], words[2]};
}

void Controller::check_identity() {
  const Locked locked(*modbus_, connection_.device);
  const auto words = poll(spec::kInDeviceId, 3, "DEVICE_ID");
  require(words[0] == spec::kDeviceId,
          fmt::format("{}: found device id 0x{:04X}, expected 0x{:04X}; that is another device",
                      connection_.device, words[0], spec::kDeviceId));
  require(words[2] == spec::kMapCrc,
          fmt::format(
              "{}: found a chip with register map 0x{:04X}, expected 0x{:04X}; use the driver of that chip",
              connection_.device, words[2], spec::kMapCrc));
}

Status Controller::status() {
  std::vector<std::uint16_t> words;
  {
    const Locked locked(*modbus_, connection_.device);
    words = poll(spec::kInStatus, spec::kTelemetryWords, "STATUS");
  }
  const auto value = [&](spec::In in) { return to_unit(registers()[in], words[in]); };
  Status status{.bits = words[spec::kInStatus],
                .temperature_degc = std::nullopt,
                .setpoint_degc = value(spec::kInSpWork),
                .duty_percent = value(spec::kInDuty),
                .slope_degc = value(spec::kInPvSlope),
                .p_percent = value(spec::kInTermP),
                .i_percent = value(spec::kInTermI),
                .d_percent = value(spec::kInTermD),
                .faults = words[spec::kInFault],
                .causes = words[spec::kInCause],
                .first_fault = spec::first_fault(words[spec::kInFirstFault]),
                .state = static_cast<spec::State>(
                    spec::field_of(words[spec::kInFirstFault], spec::kFirstFaultStateMask)),
                .samples = words[spec::kInSamples],
                .watchdog_left_s = value(spec::kInWdLeft)};
  if (!is_no_value(registers()[spec::kInPv], words[spec::kInPv]))
    status.temperature_degc = value(spec::kInPvFine);
  return status;
}

void Controller::send(const Frame& frame) {
  transact(frame.names, [&](modbus_t* context) {
    return write_words(context, connection_.address, frame.address, frame.words);
  });
}

void Controller::command(spec::Cmd cmd, const std::string& what) {
  send({spec::kHoldingBase + spec::kRegCmd, {cmd}, what});
}

// An error that made it necessary is the one to tell, so its own is none.
bool Controller::discarded() {
  try {
    command(spec::kCmdDiscard, "CMD Discard");
    return true;
  } catch (const BusError&) {
    return false;
  }
}

// Polls STATUS until it is `reached`, which a control tick brings about. What is held belongs to a program
// that is gone, and no tick comes for it.
template <class Reached>
void Controller::await_tick(const std::string& what, Reached&& reached) {
  const auto until = std::chrono::steady_clock::now() + kLongestTick;
  while (true) {
    const std::uint16_t status = poll(spec::kInStatus, 1, "STATUS").front();
    if (is_set(status, spec::kStatusHold) || reached(status)) return;
    if (std::chrono::steady_clock::now() > until)
      throw BusError(fmt::format("{}: {} not active after {} s, expected a control tick; see TS",
                                 connection_.device, what,
                                 std::chrono::duration<double>(kLongestTick).count()));
    std::this_thread::sleep_for(kBusyPause);
  }
}

// A Discard drops all that is staged, what an earlier write left for the next tick too.
void Controller::await_earlier_writes() {
  await_tick("earlier writes are",
             [](std::uint16_t status) { return !is_set(status, spec::kStatusWritesPending); });
}

void Controller::await_lock(bool locked) {
  await_tick("LOCK is", [=](std::uint16_t status) { return is_set(status, spec::kStatusLocked) == locked; });
}

// A locked chip takes nothing but LOCK = 0, so that goes ahead. The lock there was; 0 when the chip was open.
std::uint16_t Controller::open_lock() {
  if (!is_set(poll(spec::kInStatus, 1, "STATUS").front(), spec::kStatusLocked)) return 0;
  const std::uint16_t lock = poll(kLockAddress, 1, "LOCK").front();
  send({kLockAddress, {0}, "LOCK"});
  await_lock(false);
  return lock;
}

// An error that made it necessary is the one to tell, so its own is none.
bool Controller::locked_again(std::uint16_t lock) {
  try {
    send({kLockAddress, {lock}, "LOCK"});
    await_lock(true);
    return true;
  } catch (const BusError&) {
    return false;
  }
}

void Controller::write(std::span<const Setting> settings) {
  constexpr std::uint16_t kCmdAddress = spec::kHoldingBase + spec::kRegCmd;
  constexpr std::uint16_t kTMaxAddress = spec::kHoldingBase + spec::kRegTMax;
  std::vector<std::pair<const Register*, std::uint16_t>> sorted;
  for (const Setting& s : settings) {
    require(s.reg->address != kCmdAddress, "CMD: is the command word, expected a parameter");
    sorted.emplace_back(s.reg, to_raw(*s.reg, s.value));
  }
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.first->address < b.first->address; });
  for (std::size_t i = 1; i < sorted.size(); ++i)
    require(sorted[i].first != sorted[i - 1].first,
            fmt::format("{}: is set twice, expected once", sorted[i].first->name));

  std::vector<Frame> frames;
  for_each_run(
      sorted, spec::kWriteWords, [](const auto& s) { return s.first->address; },
      [&](std::size_t first, std::size_t last) {
        Frame frame{sorted[first].first->address, {}, {}};
        for (std::size_t i = first; i < last; ++i) {
          frame.words.push_back(sorted[i].second);
          frame.names += (i == first ? "" : ", ") + std::string(sorted[i].first->name);
        }
        frames.push_back(std::move(frame));
      });
  if (frames.empty()) return;
  // The chip judges a set-point by the staged limit, so the limit goes first.
  std::stable_partition(frames.begin(), frames.end(), [](const Frame& f) {
    return f.address <= kTMaxAddress && kTMaxAddress < f.address + f.words.size();
  });

  const Locked locked(*modbus_, connection_.device);
  const auto lock = std::find_if(settings.begin(), settings.end(),
                                 [](const Setting& s) { return is_holding(s, spec::kRegLock); });
  const bool opens = lock != settings.end() && lock->value == 0 && settings.size() > 1;
  const std::uint16_t lock_before = opens ? open_lock() : 0;
  try {
    send_together(frames);
  } catch (const BusError& error) {
    if (lock_before == 0 || locked_again(lock_before)) throw;
    throw BusError(fmt::format("{}; LOCK was {} and is open now", error.what(), lock_before));
  }
  if (lock != settings.end() && !changes_line(settings)) await_lock(lock->value != 0);
}

// All or none.
void Controller::send_together(const std::vector<Frame>& frames) {
  try {
    if (frames.size() == 1) {
      send(frames.front());
      return;
    }
    await_earlier_writes();
    command(spec::kCmdHold, "CMD Hold");
    try {
      for (const Frame& frame : frames) send(frame);
    } catch (const BusError& error) {
      if (discarded()) throw;
      throw BusError(
          std::string(error.what()) +
          "; what was sent before stays staged in the chip: write all of it again, or reset the chip");
    }
    command(spec::kCmdCommit, "CMD Commit");
  } catch (const Refusal& refusal) {
    if (refusal.repeated) throw;
    std::string text = refusal.what();
    const bool setpoint = text.find(spec::kHolding[spec::kRegSetpoint].name) != std::string::npos;
    if (refusal.code == MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE && setpoint)
      text += fmt::format("; SETPOINT may be T_MAX - {:.1f} degC at most", spec::kSetpointMargin * 0.1);
    if (refusal.code == MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE) text += kLockIsOn;
    throw BusError(text + "; nothing was changed");
  }
}

std::string Controller::what_is_busy() {
  const auto words = poll(spec::kInStatus, spec::kInAtState + 1, "STATUS");
  if (spec::field_of(words[spec::kInAtState], spec::kAtStateEndMask) == spec::kTuningRuns)
    return "; the autotune runs, STOP ends it";
  if (has_bit(words[spec::kInStatus], spec::kStatusWritesPending))
    return "; writes wait for the next control period or for Commit, try again then";
  return "; it may be over by now, try again";
}

std::string Controller::what_bars_clearing() {
  const auto words = poll(spec::kInStatus, spec::kTelemetryWords, "STATUS");
  if (has_bit(words[spec::kInStatus], spec::kStatusLocked)) return std::string(kLockIsOn);
  const std::string present = fault_names(words[spec::kInCause]);
  return present.empty() ? "; its cause may be gone by now, try again"
                         : fmt::format("; present now: {}", present);
}

std::string Controller::what_bars_heating() {
  const auto words = poll(spec::kInStatus, spec::kTelemetryWords, "STATUS");
  if (has_bit(words[spec::kInStatus], spec::kStatusLocked)) return std::string(kLockIsOn);
  const std::string latched = fault_names(words[spec::kInFault]);
  const std::string present = fault_names(words[spec::kInCause]);
  if (!present.empty()) return fmt::format("; present now: {}", present);
  if (!latched.empty()) return fmt::format("; latched: {}, clear it first", latched);
  if (words[spec::kInPv] == spec::kPvNone)
    return "; no sound sample has come yet: the first takes up to a second after the chip starts, try again; "
           "if it stays so, check the sensor and SENS_TYPE";
  return "; what barred it may be gone by now, try again";
}

std::string Controller::what_bars_tuning() {
  const auto words = poll(spec::kInStatus, spec::kTelemetryWords, "STATUS");
  if (has_bit(words[spec::kInStatus], spec::kStatusLocked)) return std::string(kLockIsOn);
  return "; heating must be on (CMD Run), in automatic mode (MODE=0)";
}

void Controller::command_or_why(spec::Cmd cmd, const std::string& what, std::string (Controller::*why)()) {
  const Locked locked(*modbus_, connection_.device);
  try {
    command(cmd, what);
  } catch (const Refusal& refusal) {
    if (refusal.repeated) throw;
    const bool busy = refusal.code == MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY;
    throw BusError(refusal.what() + (busy ? what_is_busy() : (this->*why)()));
  }
}

void Controller::run() { command_or_why(spec::kCmdRun, "CMD Run", &Controller::what_bars_heating); }

void Controller::stop() {
  const Locked locked(*modbus_, connection_.device);
  command(spec::kCmdStop, "CMD Stop");
}

void Controller::clear_faults() {
  command_or_why(spec::kCmdClearFault, "CMD ClearFault", &Controller::what_bars_clearing);
}

void Controller::start_tuning() { command_or_why(spec::kCmdTune, "CMD Tune", &Controller::what_bars_tuning); }

Tuning Controller::tuning() {
  static const std::array<const Register*, 5> wanted{&find_register("AT_STATE"), &find_register("AT_KU"),
                                                     &find_register("AT_TU"), &find_register("AT_DUTY"),
                                                     &find_register("TS")};
  const auto words = read(wanted);
  const auto value = [&](std::size_t i) { return to_unit(*wanted[i], words[i]); };
  const unsigned end = spec::field_of(words[0], spec::kAtStateEndMask);
  const auto& known = spec::kTuningEnds;
  if (std::find(known.begin(), known.end(), end) == known.end())
    throw BusError(fmt::format("AT_STATE: found {}, expected {} to {}", end, +known.front(), +known.back()));
  // AT_TU counts control periods, TS milliseconds.
  const auto cycles = static_cast<int>(spec::field_of(words[0], spec::kAtStateCyclesMask));
  return {static_cast<TuningPhase>(end), cycles, value(1), value(2) * value(4) / 1000.0, value(3)};
}

}  // namespace meltstage::host
