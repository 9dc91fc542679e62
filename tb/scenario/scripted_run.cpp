// SPDX-License-Identifier: Apache-2.0
#include "tb/scenario/scripted_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "host/exception_text.hpp"
#include "tb/pins/fault_sentence.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

constexpr std::uint64_t kResetClocks = 20;
constexpr std::uint64_t kFirstWrite = spec::kClkHz / 100;
constexpr std::uint64_t kPollPeriod = spec::kClkHz;
constexpr std::uint64_t kRowPeriod = spec::kClkHz / 10;
constexpr std::uint16_t kPolledRegisters = 16;
// What is kept: some eleven hours of rows, and some two minutes of pins while the heater is pulsed.
constexpr std::size_t kMostRows = 400'000;
constexpr std::size_t kMostLogged = 4'000;
constexpr std::size_t kMostChanges = std::size_t{1} << 21;

double seconds(std::uint64_t cycle) { return static_cast<double>(cycle) / spec::kClkHz; }

std::uint64_t packed(const chip::Inputs& in, const chip::Outputs& out) {
  std::uint64_t levels = 0;
  unsigned bit = 0;
#define TC_PACK(port, member, bits) levels |= std::uint64_t{in.member} << bit, bit += (bits);
  TC_INPUT_PINS(TC_PACK)
  TC_TEST_PINS(TC_PACK)
#undef TC_PACK
#define TC_PACK(port, member, bits) levels |= std::uint64_t{out.member} << bit, bit += (bits);
  TC_OUTPUT_PINS(TC_PACK)
#undef TC_PACK
  return levels;
}

// The bytes of a number, lowest first, into a hash (FNV-1a).
std::uint32_t hashed(std::uint32_t hash, std::uint64_t number) {
  for (int byte = 0; byte < 8; ++byte)
    hash = (hash ^ static_cast<std::uint8_t>(number >> 8 * byte)) * 16777619U;
  return hash;
}

// Illegal states have none.
std::uint32_t state_bit(std::uint8_t code) {
  for (std::size_t i = 0; i < spec::kStates.size(); ++i) {
    if (spec::kStates[i].code == code) return 1U << i;
  }
  return 0;
}

std::string registers_text(const std::vector<std::uint16_t>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size() && i < spec::kInputCount; ++i) {
    text += (i == 0 ? "" : ", ") + reading_text(static_cast<spec::In>(i), words[i]);
  }
  return text;
}

std::string answer_text(const ModbusResult& result) {
  switch (result.outcome) {
    case ModbusOutcome::data:
      return result.registers.empty() ? "done" : registers_text(result.registers);
    case ModbusOutcome::exception:
      return fmt::format("refused, exception {}: {}", result.exception_code,
                         host::exception_text(result.exception_code));
    case ModbusOutcome::timeout:
      return "no answer";
    case ModbusOutcome::malformed:
      return result.problem;
    case ModbusOutcome::broadcast:
      return "broadcast, no answer";
  }
  return "";
}

std::vector<std::uint8_t> bytes_of(const ModbusRequest& request) {
  std::vector<std::uint8_t> bytes;
  for (const UartChar& character : request.frame) bytes.push_back(character.data);
  return bytes;
}

}  // namespace

std::vector<PinBits> chip_pin_bits() {
  std::vector<PinBits> pins;
  unsigned first = 0;
  for (const spec::PinInfo& pin : spec::kPins) {
    pins.push_back({pin.name, first, pin.width});
    first += pin.width;
  }
  return pins;
}

ScriptedRun::ScriptedRun(Scenario scenario)
    : head_(scenario.head),
      events_(std::make_move_iterator(scenario.events.begin()),
              std::make_move_iterator(scenario.events.end())),
      next_poll_(kPollPeriod) {
  head_.set_reset(true);
  advance(kResetClocks);
  head_.set_reset(false);
  set_sensor(scenario.head.sensor);
}

// What a driver would set for that part before anything else, where it is not so from reset.
void ScriptedRun::set_sensor(std::string_view part) {
  const auto preset = std::find_if(spec::kSensorPresets.begin(), spec::kSensorPresets.end(),
                                   [&](const spec::SensorPreset& p) { return p.name == part; });
  const auto set = [&](spec::Reg reg, std::int32_t value) {
    const spec::RegisterInfo& info = spec::kHolding[reg];
    if (value != info.reset)
      events_.push_front(parse_event(fmt::format("set {} {}", info.name, value), kFirstWrite).event);
  };
  set(spec::kRegTs, std::max<std::int32_t>(preset->min_ts_ms, spec::kHolding[spec::kRegTs].reset));
  set(spec::kRegSensType, static_cast<std::int32_t>(preset - spec::kSensorPresets.begin()));
}

double ScriptedRun::now_s() const { return seconds(run_.cycle); }

void ScriptedRun::add(Event event) {
  event.cycle = std::max(event.cycle, run_.cycle);
  const auto behind = std::upper_bound(events_.begin(), events_.end(), event.cycle,
                                       [](std::uint64_t cycle, const Event& e) { return cycle < e.cycle; });
  events_.insert(behind, std::move(event));
}

void ScriptedRun::until(std::uint64_t cycle) {
  for (;;) {
    do_what_is_due();
    if (run_.cycle >= cycle) return;
    advance(next_stop(cycle));
  }
}

void ScriptedRun::do_what_is_due() {
  if (run_.cycle >= next_row_) {
    add_row();
    next_row_ += kRowPeriod;
  }
  take_answers();
  note_fault();
  if (run_.cycle >= next_poll_) {
    next_poll_ = run_.cycle + kPollPeriod;
    if (polls_ && !head_.host().busy()) send("poll", read_input_registers(kChipAddress, 0, kPolledRegisters));
  }
  if (drop_period_ != 0 && run_.cycle >= next_drop_) {
    // a droplet leaves no colder than what flows in, which is as cold as the surroundings
    if (head_.plant().block_degc(run_.cycle) > head_.plant().ambient_degc())
      head_.plant().droplet(run_.cycle, drop_energy_j_);
    next_drop_ += drop_period_;
  }
  // last, as what a person does at this clock comes behind all that stands
  while (!events_.empty() && events_.front().cycle <= run_.cycle) {
    const Event event = std::move(events_.front());
    events_.pop_front();
    const std::size_t sent = sent_.size();
    event.act(*this);
    for (std::size_t i = sent; i < sent_.size(); ++i) {
      sent_[i].must_be_done = !event.may_fail;
      sent_[i].line = event.line;
    }
    if (sent_.size() == sent) log({now_s(), event.text, "", {}});  // what is sent is told with its answer
  }
}

std::uint64_t ScriptedRun::next_stop(std::uint64_t end) const {
  std::uint64_t stop = std::min({end, next_row_, next_poll_});
  if (!events_.empty()) stop = std::min(stop, events_.front().cycle);
  if (drop_period_ != 0) stop = std::min(stop, next_drop_);
  return stop;
}

void ScriptedRun::advance(std::uint64_t until) {
  if (clock_runs_) {
    chip::advance(run_, until, head_,
                  [this](std::uint64_t cycle, const chip::Inputs& in, const chip::Outputs& out) {
                    see(cycle, in, out);
                  });
    return;
  }
  // No clock: flops stand, and heater_o follows inhibit_i and reset as gates do.
  while (run_.cycle < until) {
    const chip::Inputs in = head_.step(run_.cycle, run_.out);
    if (!in.rst_n) run_.chip = chip::Chip{};
    run_.out = run_.chip.outputs(in);
    see(run_.cycle, in, run_.out);
    run_.cycle = std::min(until, std::max(run_.cycle + 1, head_.next_event()));
  }
}

void ScriptedRun::see(std::uint64_t cycle, const chip::Inputs& in, const chip::Outputs& out) {
  states_seen_ |= state_bit(run_.chip.sysctrl.state_q);
  const std::uint64_t levels = packed(in, out);
  const std::size_t newest = (oldest_change_ + changes_.size() - 1) % kMostChanges;
  if (!changes_.empty() && changes_[newest].pins == levels) return;
  ++change_count_;
  pins_hash_ = hashed(hashed(pins_hash_, cycle), levels);
  if (changes_.size() < kMostChanges) {
    changes_.push_back({cycle, levels});
  } else {
    changes_[oldest_change_] = {cycle, levels};
    oldest_change_ = (oldest_change_ + 1) % kMostChanges;
  }
}

std::vector<PinChange> ScriptedRun::pins(std::uint64_t begin, std::uint64_t end) const {
  const auto change = [this](std::size_t number) -> const PinChange& {
    return changes_[(oldest_change_ + number) % changes_.size()];
  };
  const auto behind = [&](std::uint64_t cycle) {  // the first change behind that clock
    std::size_t low = 0, high = changes_.size();
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (change(middle).cycle <= cycle)
        low = middle + 1;
      else
        high = middle;
    }
    return low;
  };
  const std::size_t first = behind(begin), last = end == 0 ? 0 : behind(end - 1);
  std::vector<PinChange> found;
  for (std::size_t i = first == 0 ? 0 : first - 1; i < last; ++i) found.push_back(change(i));
  return found;
}

void ScriptedRun::send(std::string what, ModbusRequest request) {
  sent_.push_back({std::move(what), bytes_of(request), run_.cycle});
  head_.host().submit(std::move(request));
}

void ScriptedRun::take_answers() {
  while (const auto result = head_.host().take_result()) {
    Sent sent = std::move(sent_.front());
    sent_.pop_front();
    const bool done = result->outcome == ModbusOutcome::data || result->outcome == ModbusOutcome::broadcast;
    LogEntry entry{seconds(result->request_start_cycle),
                   std::move(sent.what),
                   answer_text(*result),
                   std::move(sent.request),
                   result->frame,
                   sent.must_be_done && !done,
                   sent.line};
    if (entry.failed && ++failed_ <= kMostFailures) {
      failures_.push_back(entry);
      failures_.back().time_s = seconds(sent.cycle);  // the line may have been busy with a poll then
    }
    log(std::move(entry));
  }
  while (head_.telemetry().take()) {  // nobody listens to that pin here
  }
}

std::vector<LogEntry> ScriptedRun::unanswered() const {
  std::vector<LogEntry> entries;
  for (const Sent& sent : sent_) {
    if (sent.must_be_done)
      entries.push_back(
          {seconds(sent.cycle), sent.what, "no answer so far", sent.request, {}, true, sent.line});
  }
  return entries;
}

std::uint32_t ScriptedRun::take_states_seen() { return std::exchange(states_seen_, 0); }

std::string ScriptedRun::fault() const { return latched_fault(run_.chip, "Now"); }

void ScriptedRun::note_fault() {
  const std::uint8_t first = run_.chip.guard.first_q;
  if (first == first_fault_) return;
  first_fault_ = first;
  if (first != 0) log({now_s(), "fault", fault(), {}});
}

void ScriptedRun::drop(double rate_hz, double energy_j) {
  drop_period_ = rate_hz > 0.0 ? static_cast<std::uint64_t>(std::llround(spec::kClkHz / rate_hz)) : 0;
  drop_energy_j_ = energy_j;
  next_drop_ = run_.cycle + drop_period_;
}

void ScriptedRun::add_row() {
  if (rows_.size() >= kMostRows) rows_.erase(rows_.begin(), rows_.begin() + kMostRows / 2);
  const chip::Chip& chip = run_.chip;
  const auto pv = chip.read_register(spec::kInPv);
  const auto word = [&](spec::In reg) { return static_cast<std::int16_t>(chip.read_register(reg)); };
  rows_.push_back({
      .time_s = now_s(),
      .set_point_degc = word(spec::kInSpWork) * spec::kInput[spec::kInSpWork].scale,
      .reading_degc = pv == spec::kPvNone ? std::numeric_limits<double>::quiet_NaN()
                                          : word(spec::kInPvFine) * spec::kInput[spec::kInPvFine].scale,
      .block_degc = head_.plant().block_degc(run_.cycle),
      .heater_degc = head_.plant().heater_degc(run_.cycle),
      .duty_percent = chip.read_register(spec::kInDuty) * spec::kInput[spec::kInDuty].scale,
      .state = static_cast<double>(chip.sysctrl.state_q),
      .faults = static_cast<double>(chip.read_register(spec::kInFault)),
      .pin_changes = static_cast<double>(change_count_),
      .pins_hash = static_cast<double>(pins_hash_),
  });
}

void ScriptedRun::log(LogEntry entry) {
  if (log_.size() >= kMostLogged) {
    log_.pop_front();
    ++log_dropped_;
  }
  log_.push_back(std::move(entry));
}

std::string trace_text(const ScriptedRun& run) {
  std::string text =
      "time_s,set_point_degc,reading_degc,block_degc,heater_degc,duty_percent,state,faults,pin_changes,pins_"
      "hash\n";
  for (const TraceRow& row : run.rows()) {
    const auto* state = std::find_if(spec::kStates.begin(), spec::kStates.end(),
                                     [&](const auto& s) { return s.code == static_cast<int>(row.state); });
    text +=
        fmt::format("{:.1f},{:.1f},{},{:.3f},{:.3f},{:.2f},{},{},{},{:08x}\n", row.time_s, row.set_point_degc,
                    std::isnan(row.reading_degc) ? std::string() : fmt::format("{:.3f}", row.reading_degc),
                    row.block_degc, row.heater_degc, row.duty_percent,
                    state == spec::kStates.end() ? "illegal" : state->name, static_cast<unsigned>(row.faults),
                    row.pin_changes, static_cast<std::uint32_t>(row.pins_hash));
  }
  return text;
}

}  // namespace meltstage::tb
