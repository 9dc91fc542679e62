// SPDX-License-Identifier: Apache-2.0
#include "app/live/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "cmodel/spec.hpp"
#include "host/errors.hpp"

namespace meltstage::app::live {
namespace {

namespace spec = chip::spec;
using Json = nlohmann::json;

constexpr std::chrono::seconds kRetryPeriod{1};
// Reading all registers may take this share of the line's time.
constexpr int kRegistersShare = 4;
constexpr std::chrono::seconds kRegistersPeriod{1};

// Its counters have begun anew.
constexpr std::string_view kWasReset = "The chip was reset: its settings are those of power-up.";

// Text of a chip or a system may be no UTF-8.
std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

std::string answer_json(const Answer& answer) {
  return dumped({{"id", answer.id},
                 {"asked", answer.asked},
                 {"outcome", outcome_name(answer.outcome)},
                 {"text", answer.text}});
}

Bench::Bench(Source& source, Feed& feed, std::function<void(const Sample&)> keep)
    : source_(source), feed_(feed), keep_(std::move(keep)), thread_([this] { work(); }) {}

Bench::~Bench() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    lost_ = "the server ends";
    asked_.notify_all();
  }
  thread_.join();
}

// ---- what others ask

std::optional<Answer> Bench::ask(const Command& command, std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  if (const auto known = answers_.find(command.id)) {
    if (known->asked != command.text)
      return Answer{command.id, command.text, Outcome::refused,
                    fmt::format("this id was given to \"{}\" before", known->asked)};
  } else {
    if (is_stop(command)) let_stop_ahead();
    if (waiting_.size() >= kMostWaiting) return std::nullopt;
    if (!lost_.empty()) {
      put_and_tell({command.id, command.text, Outcome::refused, "nothing was sent: " + lost_});
    } else {
      answers_.put({command.id, command.text, Outcome::waiting, ""});
      waiting_.push_back(command);
      asked_.notify_all();
    }
  }
  std::optional<Answer> answer;
  answered_.wait_for(lock, patience, [&] {
    answer = answers_.find(command.id);
    return !answer || answer->outcome != Outcome::waiting;
  });
  return answer.value_or(Answer{command.id, command.text, Outcome::unknown, "its answer is no longer kept"});
}

// The mutex is held.
void Bench::put_and_tell(const Answer& answer) {
  answers_.put(answer);
  answered_.notify_all();
  feed_.tell("answer", answer_json(answer));
}

// The mutex is held.
void Bench::refuse_waiting(const std::string& why) {
  for (const Command& command : waiting_)
    put_and_tell({command.id, command.text, Outcome::refused, "nothing was sent: " + why});
  waiting_.clear();
}

// The mutex is held.
void Bench::let_stop_ahead() {
  const auto behind = std::stable_partition(waiting_.begin(), waiting_.end(), is_stop);
  for (auto command = behind; command != waiting_.end(); ++command)
    put_and_tell({command->id, command->text, Outcome::refused, "nothing was sent: Stop came first"});
  waiting_.erase(behind, waiting_.end());
}

void Bench::answer(const Command& command, Outcome outcome, const std::string& text) {
  const std::lock_guard lock(mutex_);
  put_and_tell({command.id, command.text, outcome, text});
}

std::optional<Command> Bench::next_command() {
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  Command command = std::move(waiting_.front());
  waiting_.pop_front();
  return command;
}

bool Bench::ends() {
  const std::lock_guard lock(mutex_);
  return ends_;
}

void Bench::wait_until(Clock::time_point time) {
  std::unique_lock lock(mutex_);
  asked_.wait_until(lock, time, [&] { return ends_ || !waiting_.empty(); });
}

// ---- the thread

void Bench::work() {
  bool connected = false;
  while (!ends()) {
    try {
      if (!connected) {
        try_to_connect();
        connected = true;
      }
      if (const auto command = next_command()) carry_out(*command);
      if (Clock::now() >= next_poll_) poll();
      if (Clock::now() >= next_registers_) read_registers();
      wait_until(std::min(next_poll_, next_registers_));
    } catch (const std::exception& error) {  // host::BusError, UserError, no memory: said, and tried again
      connected = false;
      lose(error.what());
      wait_until(Clock::now() + kRetryPeriod);
    }
  }
  const std::lock_guard lock(mutex_);
  refuse_waiting(lost_);
}

// Settings are compared only when the chip is the same one as before and all of it was read.
void Bench::try_to_connect() {
  const std::string identity = source_.connect();
  const auto all = readable_registers();
  Registers now(source_.read(all));
  const std::optional<Registers> before = std::exchange(registers_, now);
  samples_.reset();
  next_poll_ = next_registers_ = {};
  {
    const std::lock_guard lock(mutex_);
    lost_.clear();
  }
  feed_.tell_state("connection", dumped({{"connected", true},
                                         {"identity", identity},
                                         {"text", before ? "the chip answers again" : "the chip answers"}}));
  if (!before) return;
  const std::string_view messages = spec::kInput[spec::kInMessages].name;
  if (went_back((*before)[messages], now[messages]))
    tell_changes(*before, kWasReset);
  else if (!now.changed_since(*before).empty())
    tell_changes(*before, "Settings were changed meanwhile.");
}

// Another program may have changed settings, too.
void Bench::tell_changes(const Registers& before, std::string_view what) {
  feed_.tell("notice", dumped({{"text", what}, {"changed", registers_->changed_since(before)}}));
}

void Bench::lose(const std::string& reason) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (samples_) keep_({source_.now_s(), kNone, kNone, kNone});
  samples_.reset();
  const std::lock_guard lock(mutex_);
  if (lost_ == reason) return;
  lost_ = reason;
  refuse_waiting(reason);
  feed_.tell_state("connection", dumped({{"connected", false}, {"text", reason}}));
}

void Bench::poll() {
  const auto polled = source_.read(polled_registers());
  const double time_s = source_.now_s();
  next_poll_ = Clock::now() + kPollPeriod;
  feed_.tell_state("reading", reading_json(time_s, polled));
  keep_(sample_of(time_s, polled));
  const std::string around = dumped(source_.around());
  if (around != std::exchange(told_around_, around)) feed_.tell_state("around", around);
  const std::uint16_t samples = polled[spec::kInSamples];
  const bool reset = samples_ && went_back(*samples_, samples);
  samples_ = samples;
  const std::string_view fault = spec::kInput[spec::kInFault].name;
  if (reset || (registers_ && polled[spec::kInFault] != (*registers_)[fault])) next_registers_ = {};
  if (!reset) return;
  const std::optional<Registers> before = registers_;
  read_registers();
  tell_changes(*before, kWasReset);
}

void Bench::read_registers() {
  const Clock::time_point begin = Clock::now();
  registers_.emplace(source_.read(readable_registers()));
  const Clock::time_point end = Clock::now();
  next_registers_ = end + std::max<Clock::duration>(kRegistersPeriod, kRegistersShare * (end - begin));
  feed_.tell_state("registers", registers_->json());
  const std::string faults = dumped(registers_->faults());
  if (faults != std::exchange(told_faults_, faults)) feed_.tell_state("faults", faults);
}

// What may have been done is never sent again: the chip, when it is back, is read.
void Bench::carry_out(const Command& command) {
  try {
    answer(command, Outcome::done, source_.carry_out(command));
  } catch (const host::NoAnswer& silent) {
    answer(command, Outcome::unknown,
           std::string("it may have been done or not, read it back: ") + silent.what());
    throw;
  } catch (const host::BusError& refused) {
    answer(command, Outcome::refused, refused.what());
  } catch (const UserError& wrong) {
    answer(command, Outcome::refused, wrong.what());
  }
  next_poll_ = next_registers_ = {};  // what it changed is shown at once
}

}  // namespace meltstage::app::live
