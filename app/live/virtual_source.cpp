// SPDX-License-Identifier: Apache-2.0
#include "app/live/virtual_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "app/live/reading.hpp"
#include "base/error.hpp"
#include "cmodel/spec.hpp"
#include "host/errors.hpp"

namespace meltstage::app::live {
namespace {

namespace spec = chip::spec;

// Of a poll's time, so that commands are heard.
constexpr std::chrono::milliseconds kLongestWork{100};
constexpr std::uint64_t kStep = spec::kClkHz / 20;
// The host asks one thing after the other, and waits a second for an answer.
constexpr std::uint64_t kLongestAnswer = std::uint64_t{3} * spec::kClkHz;
// As the line of a scenario, of which none has so many.
constexpr std::size_t kAskedHere = std::numeric_limits<std::size_t>::max();

}  // namespace

// Each command in the words of a scenario.
struct VirtualSource::Done {
  VirtualSource& source;

  std::string operator()(const Set& set) const {
    return source.carry_out(fmt::format("set {} {}", set.reg->name, set.value),
                            is_now(*set.reg, host::to_raw(*set.reg, set.value)));
  }
  std::string operator()(const Run&) const { return source.carry_out("run", "heating is on"); }
  std::string operator()(const Stop&) const { return source.carry_out("stop", "the heater is off"); }
  std::string operator()(const ClearFaults&) const { return source.carry_out("clear"); }
  std::string operator()(const Tune&) const { return source.carry_out("tune"); }
  std::string operator()(const BenchEvent& event) const { return source.carry_out(event.text); }
  std::string operator()(const Speed& speed) const {
    source.advance();
    source.set_speed(speed.ratio);
    return speed.ratio == 0.0 ? "time stands" : fmt::format("time runs at {:g} x", speed.ratio);
  }
};

VirtualSource::VirtualSource(tb::Scenario scenario, double speed) : run_(std::move(scenario)) {
  run_.until(run_.cycle());
  set_speed(speed);
}

void VirtualSource::set_speed(double speed) {
  speed_ = speed;
  around_["speed"] = fmt::format("{:g}", speed);
}

// As far as real time has gone, or as this machine gets. What it didn't get to is let go.
void VirtualSource::advance() {
  const Clock::time_point now = Clock::now();
  const double passed_s = std::chrono::duration<double>(now - std::exchange(then_, now)).count();
  const std::uint64_t end =
      run_.cycle() + static_cast<std::uint64_t>(std::llround(passed_s * speed_ * spec::kClkHz));
  while (run_.cycle() < end && Clock::now() - now < kLongestWork)
    run_.until(std::min(end, run_.cycle() + kStep));
  take_log();
}

void VirtualSource::take_log() {
  const std::uint64_t dropped = run_.log_dropped();
  for (std::size_t i = logged_ > dropped ? logged_ - dropped : 0; i < run_.log().size(); ++i) {
    const tb::LogEntry& entry = run_.log()[i];
    if (entry.line == kAskedHere) answer_ = entry;
    if (!entry.request.empty()) continue;
    const std::size_t space = std::min(entry.what.find(' '), entry.what.size());
    around_[entry.what.substr(0, space)] = entry.what.substr(std::min(space + 1, entry.what.size()));
  }
  logged_ = dropped + run_.log().size();
}

std::vector<std::uint16_t> VirtualSource::read(std::span<const host::Register* const> wanted) {
  advance();
  std::vector<std::uint16_t> words;
  for (const host::Register* reg : wanted)
    words.push_back(std::as_const(run_).chip().read_register(reg->address));
  return words;
}

std::string VirtualSource::carry_out(const Command& command) { return std::visit(Done{*this}, command.what); }

// At its next clock; the time until the answer is let pass at once.
std::string VirtualSource::carry_out(const std::string& text, const std::string& done) {
  advance();
  tb::ParsedEvent parsed = tb::parse_event(text, run_.cycle());
  if (parsed.defect)
    throw UserError(fmt::format("found {}, expected {}", parsed.defect->found, parsed.defect->expected));
  if (speed_ == 0.0) throw UserError("time stands, expected it to run: choose a speed first");
  parsed.event.line = kAskedHere;
  parsed.event.may_fail = false;  // what came of it is told
  const std::size_t unanswered = run_.unanswered().size();
  run_.add(std::move(parsed.event));
  answer_.reset();
  run_.until(run_.cycle());
  take_log();
  if (!answer_ && run_.unanswered().size() == unanswered) return "";  // to the bench, not to the chip
  for (const std::uint64_t end = run_.cycle() + kLongestAnswer; !answer_ && run_.cycle() < end;) {
    run_.until(run_.cycle() + kStep);
    take_log();
  }
  if (!answer_) throw host::BusError("no answer");
  if (answer_->failed) throw host::BusError(answer_->answer);
  return answer_->answer == "done" ? done : answer_->answer;
}

}  // namespace meltstage::app::live
