// SPDX-License-Identifier: Apache-2.0
#include "tb/printer/printer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/count.hpp"
#include "cmodel/advance.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/pins/fault_sentence.hpp"

namespace meltstage::tb {

namespace {

namespace spec = chip::spec;

constexpr double kClockHz = spec::kClkHz;
constexpr std::uint64_t kMs = spec::kClkHz / 1000;
constexpr std::uint64_t kResetClocks = 20;
constexpr std::uint64_t kLook = kMs / 10;  // how often the host program looks at its results; servo cycle
constexpr std::uint64_t kPollClocks = 250 * kMs;     // between status polls
constexpr std::uint64_t kTriggerClocks = kMs / 100;  // droplet trigger pulse, 10 us
constexpr std::uint64_t kWatchOff = 50 * kMs;        // heater watched after STOP
constexpr std::uint64_t kReplyTimeout = 2000 * kMs;  // no answer: the chip is lost
constexpr std::uint8_t kUnit = 1;
constexpr std::size_t kCheckedBumps = 3;  // bumps that the RTL prints along

// Heat-up samples of the RTL, after RUN.
struct Sample {
  const char* name;
  double after_run_s;
};
constexpr Sample kHeatSamples[] = {{"heat-up at 2 s", 2.0}, {"heat-up at 8 s", 8.0}};
constexpr std::uint64_t kSampleClocks = 120 * kMs;  // one control tick and a bit

// Pins of the recording behind the chip's, in the order of printer_header.
constexpr std::uint32_t kTrigger = kChipPinCount;
constexpr std::uint32_t kFirstAxis = kTrigger + 1;
constexpr std::uint32_t kPinsPerAxis = 6;

double seconds(std::uint64_t cycles) { return static_cast<double>(cycles) / kClockHz; }

// Contiguous runs of registers, at most 16 to a frame.
std::vector<ModbusRequest> write_frames(std::vector<RegisterValue> registers) {
  std::sort(registers.begin(), registers.end(), [](auto& a, auto& b) { return a.reg < b.reg; });
  std::vector<ModbusRequest> frames;
  // The limit first: a set-point is judged against the staged T_MAX.
  for (const RegisterValue& r : registers) {
    if (r.reg == spec::kRegTMax)
      frames.push_back(write_single_register(kUnit, spec::kHoldingBase + r.reg, r.value));
  }
  for (std::size_t i = 0; i < registers.size();) {
    std::vector<std::uint16_t> values{registers[i].value};
    std::size_t next = i + 1;
    while (next < registers.size() && registers[next].reg == registers[next - 1].reg + 1 &&
           values.size() < spec::kWriteWords)
      values.push_back(registers[next++].value);
    frames.push_back(write_multiple_registers(
        kUnit, static_cast<std::uint16_t>(spec::kHoldingBase + registers[i].reg), values));
    i = next;
  }
  return frames;
}

ModbusRequest command(spec::Cmd cmd) { return write_single_register(kUnit, spec::kHoldingBase, cmd); }

class Printer {
 public:
  Printer(const PrintJob& job, recording::Sink& sink,
          const std::function<void(const PrintProgress&)>& progress)
      : job_(job),
        progress_(progress),
        head_(job.head),
        stage_(job.stage, job.drive, job.power_on_mm, kLook),
        at_{job.power_on_mm, job.power_on_mm},
        recorder_(sink, printer_header(job)) {}

  PrintResult run() {
    enter("command");
    head_.set_reset(true);
    open_window("command phase");
    wake_ = kResetClocks;
    while (phase_ != Phase::done) {
      if (cycle() >= wake_) act();
      if (phase_ == Phase::done) break;
      if (stage_next_ <= cycle()) move_stage();
      if (cycle() >= shot_next()) shoot();
      run_until(std::min({wake_, stage_next_, shot_next()}));
    }
    close_window();
    leave();
    recorder_.finish(cycle() - 1);  // the cycle that would come next is not recorded
    result_.cycles = cycle();
    return std::move(result_);
  }

 private:
  enum class Phase {
    reset,
    configure,
    wait_sensor,
    wait_run,
    heat,
    move,
    settle,
    trigger,
    approach,  // to the first row of a print on the fly
    fly,
    stop,
    watch_off,
    done
  };

  std::uint64_t cycle() const { return run_.cycle; }
  const chip::Chip& model() const { return lockstep_ ? lockstep_->model() : run_.chip; }

  // The chip among its surroundings: every clock beside the RTL, from event to event alone.
  void run_until(std::uint64_t until) {
    const auto observe = [this](std::uint64_t, const chip::Inputs& in, const chip::Outputs&) { record(in); };
    if (!lockstep_) {
      chip::advance(run_, until, head_, observe);
      return;
    }
    for (; run_.cycle < until; ++run_.cycle) {
      const chip::Inputs in = head_.step(run_.cycle, run_.out);
      record(in);
      run_.out = lockstep_->step(in);
    }
  }

  // ---- Phases of the report ----
  void enter(const char* name) {
    leave();
    result_.phases.push_back({name, seconds(cycle()), seconds(cycle())});
  }
  void leave() {
    if (!result_.phases.empty()) result_.phases.back().end_s = seconds(cycle());
  }

  // ---- Lockstep windows: the RTL is loaded with the model's state and runs along ----
  void open_window(const std::string& name) {
    if (job_.rtl != RtlWindows::chosen || lockstep_) return;
    auto rtl = make_verilated_rtl();
    if (cycle() > 0) rtl->load(run_.chip, last_in_);
    const unsigned bits = rtl->flop_bits();
    lockstep_.emplace(std::move(rtl), run_.chip, cycle(), job_.identity, job_.failures);
    result_.windows.push_back({name, cycle(), cycle(), bits, {}});
  }
  void close_window() {
    if (!lockstep_) return;
    result_.windows.back().last_cycle = cycle() - 1;
    result_.windows.back().compared = lockstep_->finish();
    run_.chip = lockstep_->model();
    lockstep_.reset();
  }

  // ---- Host program ----
  void submit(ModbusRequest request) {
    head_.host().submit(std::move(request));
    ++waiting_;
  }
  void poll() {
    if (host_lost_) return;
    submit(read_input_registers(kUnit, 0, spec::kTelemetryWords));
    next_poll_ = cycle() + kPollClocks;
  }

  void take_results() {
    while (auto result = head_.host().take_result()) {
      --waiting_;
      if (result->outcome == ModbusOutcome::timeout || result->outcome == ModbusOutcome::malformed) {
        abort("the chip does not answer on its serial line");
      } else if (result->outcome == ModbusOutcome::exception) {
        refused_ = result->exception_code;
      } else if (result->registers.size() == spec::kTelemetryWords) {
        take_status(result->registers);
      }
    }
  }

  void take_status(const std::vector<std::uint16_t>& r) {
    status_ = r;
    const bool valid = r[spec::kInPv] != spec::kPvNone;
    const auto temp = [&](spec::In reg, double scale) { return static_cast<std::int16_t>(r[reg]) * scale; };
    const Reading reading{
        .t_s = seconds(cycle()),
        .reading_degc = valid ? temp(spec::kInPvFine, 1.0 / 64) : job_.head.plant.ambient_degc,
        .setpoint_degc = temp(spec::kInSpWork, 0.1),
        .duty = r[spec::kInDuty] * 1e-4,
        .heater_degc = head_.plant().heater_degc(cycle()),
        .run = (r[spec::kInStatus] >> spec::kStatusRun & 1) != 0};
    if (valid) result_.readings.push_back(reading);
    result_.peak_heater_degc = std::fmax(result_.peak_heater_degc, reading.heater_degc);
    progress_({result_.phases.back().name, reading.t_s, reading.reading_degc, reading.setpoint_degc,
               result_.droplets});
  }

  // ---- Bad ends ----
  void abort(const std::string& sentence) {
    if (aborted_) return;
    aborted_ = true;
    result_.verdict = fmt::format("stopped at {:.3f} s: {}", seconds(cycle()), sentence);
    result_.faults.push_back({seconds(cycle()), sentence});
    stop_stage();
    shut_down();
  }

  void stop_stage() {
    move_stage();
    stage_.stop(cycle());
    stage_next_ = stage_.next_event_cycle().value_or(kNoEvent);
  }

  void shut_down() {
    close_window();
    enter("shutdown");
    open_window("shutdown");
    off_at_ = cycle();
    if (!host_lost_) submit(command(spec::kCmdStop));
    if (!host_lost_) poll();
    phase_ = Phase::stop;
    deadline_ = cycle() + kReplyTimeout;
  }

  // ---- What happens to the printer ----
  void happen(EventKind kind) {
    SpiFaults faults;
    HeaterFaults heater;
    switch (kind) {
      case EventKind::emergency_stop:  // one loop: the chip's inhibit pin and the axis controls
        head_.set_inhibit(true);
        emergency_loop_ = true;
        break;
      case EventKind::stage_jam:
        stage_.jam(0);
        break;
      case EventKind::sensor_open:
        faults.probe = ProbeFault::open;
        head_.sensor().set_faults(faults);
        break;
      case EventKind::sensor_short:
        faults.probe = ProbeFault::short_to_ground;
        head_.sensor().set_faults(faults);
        break;
      case EventKind::sensor_out:
        head_.plant().set_sensor_coupling(cycle(), 0.0);
        break;
      case EventKind::heater_open:
        heater.element_open = true;
        head_.plant().set_faults(cycle(), heater);
        break;
      case EventKind::switch_short:
        heater.switch_shorted = true;
        head_.plant().set_faults(cycle(), heater);
        break;
      case EventKind::host_lost:
        host_lost_ = true;
        break;
    }
  }

  // ---- The job, looked at every kLook clocks ----
  void act() {
    wake_ = cycle() + kLook;
    while (next_event_ < job_.events.size() && seconds(cycle()) >= job_.events[next_event_].at_s)
      happen(job_.events[next_event_++].kind);
    tick_stage();
    count_frames();
    take_results();
    watch_for_faults();
    if (!aborted_ && cycle() >= next_poll_ && phase_ > Phase::configure && waiting_ == 0) poll();
    act_in_phase();
  }

  // The chip's own counter has 16 bits.
  void count_frames() {
    const std::uint16_t now = run_.chip.uartc.messages();
    result_.frames += static_cast<std::uint16_t>(now - messages_seen_);
    messages_seen_ = now;
  }

  void tick_stage() {
    move_stage();
    stage_.tick(cycle(), emergency_loop_);
    stage_next_ = stage_.next_event_cycle().value_or(kNoEvent);
  }

  std::string first_fault() const {
    const chip::Chip& chip = model();
    FaultRegisters registers = registers_of(chip, "Measured");
    if (!status_.empty()) registers.duty = status_[spec::kInDuty];  // by the last poll before the fault
    const std::string sentence = latched_fault(registers);
    return sentence.empty() ? fmt::format("fault bits {:#06x}", chip.guard.fault_q) : sentence;
  }

  void watch_for_faults() {
    if (!run_.out.fault_n && !aborted_ && phase_ != Phase::reset) {
      abort(first_fault());
    }
    // The emergency stop is told by the chip.
    if (stage_.fault() && !emergency_loop_) abort(*stage_.fault());
  }

  void act_in_phase() {
    switch (phase_) {
      case Phase::reset:
        return in_reset();
      case Phase::configure:
        return in_configure();
      case Phase::wait_sensor:
        return in_wait_sensor();
      case Phase::wait_run:
        return in_wait_run();
      case Phase::heat:
        return in_heat();
      case Phase::move:
        return in_move();
      case Phase::settle:
        return in_settle();
      case Phase::trigger:
        return in_trigger();
      case Phase::approach:
        return in_approach();
      case Phase::fly:
        return in_fly();
      case Phase::stop:
        return in_stop();
      case Phase::watch_off:
        return in_watch_off();
      case Phase::done:
        return;
    }
  }

  void in_reset() {
    head_.set_reset(false);
    submit(report_server_id(kUnit));
    submit(command(spec::kCmdHold));
    for (ModbusRequest& frame : write_frames(job_.registers)) submit(std::move(frame));
    submit(command(spec::kCmdCommit));
    phase_ = Phase::configure;
    deadline_ = cycle() + kReplyTimeout;
  }

  void in_configure() {
    if (refused_ != 0) {
      abort(fmt::format("the chip refused the job's parameters with Modbus exception {:02}", refused_));
    } else if (waiting_ == 0) {
      phase_ = Phase::wait_sensor;
    }
  }

  void in_wait_sensor() {
    const bool sound =
        !status_.empty() && status_[spec::kInPv] != spec::kPvNone && status_[spec::kInCause] == 0;
    if (sound && waiting_ == 0) {
      submit(command(spec::kCmdRun));
      phase_ = Phase::wait_run;
    } else if (host_lost_ && waiting_ == 0) {
      abort("the host was lost before it saw a reading of the sensor: nothing was heated");
    } else if (cycle() > deadline_) {
      abort(fmt::format("no sound sensor reading in {:.0f} s (cause bits {:#06x})", seconds(kReplyTimeout),
                        status_.empty() ? 0 : status_[spec::kInCause]));
    }
  }

  void in_wait_run() {
    if (refused_ != 0) {
      abort(fmt::format("the chip refused to heat with Modbus exception {:02}", refused_));
    } else if (waiting_ == 0) {
      enter("heat-up");
      run_at_ = cycle();
      if (!stage_.homed()) stage_.home();
      deadline_ = cycle() + heat_timeout_clocks();
      phase_ = Phase::heat;
    }
  }

  void in_heat() {
    sample_heat_up();
    prepare_stage();
    if (run_.out.at_temp && stage_ready_) {
      close_window();
      enter("print");
      open_window("first bumps");
      if (job_.fly_by)
        approach_first_row();
      else
        next_bump();
    } else if (cycle() > deadline_) {
      abort(fmt::format("not at temperature {:.0f} s after RUN", job_.heat_timeout_s));
    }
  }

  void in_move() {
    if (stage_.busy()) return;
    if (left_bumps_) {
      shut_down();
    } else {
      phase_ = Phase::settle;
      deadline_ = cycle() + static_cast<std::uint64_t>(job_.settle_s * kClockHz);
    }
  }

  // A droplet only at temperature.
  void in_settle() {
    if (cycle() >= deadline_ && run_.out.at_temp) {
      drop(bump_ - 1, stage_.landing_mm(cycle(), 0.0, 0.0));
      phase_ = Phase::trigger;
    } else if (cycle() >= deadline_ + heat_timeout_clocks()) {
      abort(fmt::format("temperature left its window for {:.0f} s", job_.heat_timeout_s));
    }
  }

  void in_trigger() {
    if (result_.droplets == kCheckedBumps) close_window();
    next_bump();
  }

  void in_approach() {
    if (stage_.busy()) return;
    stage_.print_on_the_fly(job_.fly_by->plan, job_.fly_by->config, cycle());
    phase_ = Phase::fly;
  }

  void in_fly() {
    if (result_.droplets == kCheckedBumps) close_window();
    if (!stage_.busy()) leave_bumps();
  }

  void in_stop() {
    if (waiting_ != 0 && cycle() <= deadline_) return;
    off_at_ = cycle();
    phase_ = Phase::watch_off;
  }

  void in_watch_off() {
    if (run_.out.heater) abort_off();
    if (cycle() - off_at_ >= kWatchOff) finish();
  }

  std::uint64_t heat_timeout_clocks() const {
    return static_cast<std::uint64_t>(job_.heat_timeout_s * kClockHz);
  }

  void sample_heat_up() {
    if (job_.rtl != RtlWindows::chosen) return;
    if (lockstep_) {
      const std::uint64_t length = heat_sample_ == 0 ? 0 : kSampleClocks;
      if (cycle() - result_.windows.back().first_cycle >= length && cycle() - run_at_ >= kSampleClocks)
        close_window();
    } else if (heat_sample_ < std::size(kHeatSamples) &&
               seconds(cycle() - run_at_) >= kHeatSamples[heat_sample_].after_run_s) {
      open_window(kHeatSamples[heat_sample_].name);
      ++heat_sample_;
    }
  }

  void abort_off() {
    if (heater_stayed_on_) return;
    heater_stayed_on_ = true;
    result_.faults.push_back({seconds(cycle()), "heater_o is high although the job is over"});
    if (result_.verdict.empty()) result_.verdict = "heater_o was high after STOP";
    aborted_ = true;
  }

  // Homes while the head heats up, then goes to where the print begins.
  void prepare_stage() {
    if (stage_ready_ || stage_.busy()) return;
    if (result_.homing_s == 0.0 && !job_.drive.homed) {
      result_.homing_s = seconds(cycle() - run_at_);
      at_.to_mm = at_.commanded_mm = stage_.read_back_mm();
    }
    stage_ready_ = at_.to_mm == job_.start_mm;
    if (!stage_ready_) move_to(job_.start_mm);
  }

  void next_bump() {
    if (bump_ == job_.bumps.size()) {
      leave_bumps();
      return;
    }
    const motion::Point& p = job_.bumps[bump_++];
    move_to({p.x_mm, p.y_mm, job_.start_mm.z()});
    phase_ = Phase::move;
  }

  void leave_bumps() {
    left_bumps_ = job_.end_mm.has_value();
    if (!left_bumps_) {
      shut_down();
      return;
    }
    move_to(*job_.end_mm);
    phase_ = Phase::move;
  }

  void approach_first_row() {
    // The plan is compensated already.
    const motion::FlyByRow& row = job_.fly_by->plan.rows.front();
    at_.to_mm = at_.commanded_mm = {row.from_x_mm, row.y_mm, job_.start_mm.z()};
    stage_.move_to(at_.commanded_mm, cycle());
    stage_next_ = stage_.next_event_cycle().value_or(kNoEvent);
    phase_ = Phase::approach;
  }

  void move_to(const Eigen::Vector3d& to_mm) {
    at_ = send(job_, at_, to_mm);
    stage_.move_to(at_.commanded_mm, cycle());
    stage_next_ = stage_.next_event_cycle().value_or(kNoEvent);
  }

  // ---- Droplets ----
  std::uint64_t shot_next() const {
    if (shot_over_ != 0) return shot_over_;
    return stage_.next_trigger() ? stage_.next_trigger()->cycle : kNoEvent;
  }

  // The comparator fires, or the pulse ends.
  void shoot() {
    if (shot_over_ != 0) {
      recorder_.set(kTrigger, 0);
      head_.set_drop(false);
      shot_over_ = 0;
      return;
    }
    const motion::FlyByConfig& config = job_.fly_by->config;
    const std::size_t bump = stage_.next_trigger()->bump;
    stage_.fired();
    if (run_.out.at_temp)
      drop(bump, stage_.landing_mm(cycle(), config.latency_s, config.flight_s));
    else
      abort("temperature left its window while a row was printed on the fly");
  }

  void drop(std::size_t bump, const Eigen::Vector2d& landing_mm) {
    recorder_.set(kTrigger, 1);
    head_.set_drop(true);
    head_.plant().droplet(cycle(), job_.droplet_j);
    shot_over_ = cycle() + kTriggerClocks;
    const Eigen::Vector2d on_board = job_.board.of({job_.bumps[bump].x_mm, job_.bumps[bump].y_mm});
    result_.landed.push_back({bump, seconds(cycle()), landing_mm - on_board});
    const double miss_mm = result_.landed.back().miss_mm.norm();
    result_.largest_miss_mm = std::max(result_.largest_miss_mm, miss_mm);
    // Of a board on its face the droplet meets the back, however near to the bump's place.
    if (job_.board.turned_over_x_mm || !(miss_mm <= job_.place_tolerance_mm)) ++result_.misplaced;
    result_.mean_miss_mm += (miss_mm - result_.mean_miss_mm) / static_cast<double>(++result_.droplets);
  }

  void finish() {
    result_.good = !aborted_ && result_.droplets == job_.bumps.size() && result_.misplaced == 0;
    if (!aborted_)
      result_.verdict =
          fmt::format("{} of {} printed, heater off", result_.droplets, counted(job_.bumps.size(), "bump"));
    if (!aborted_ && !stage_.missed().empty()) tell_missed();
    if (result_.misplaced > 0)
      result_.verdict += fmt::format(
          "; {} of the droplets beside their bumps, the farthest by {:.1f} um, "
          "expected at most {:.6g} um",
          result_.misplaced, 1e3 * result_.largest_miss_mm, 1e3 * job_.place_tolerance_mm);
    if (job_.board.turned_over_x_mm)
      result_.verdict += "; the board lies on its face, which its marks don't tell: add a mark that does";
    phase_ = Phase::done;
  }

  // Bumps without a droplet: the comparator had nothing to fire at.
  void tell_missed() {
    const std::vector<DrivenStage::Missed>& missed = stage_.missed();
    const auto short_mm = [](const DrivenStage::Missed& a, const DrivenStage::Missed& b) {
      return a.short_mm < b.short_mm;
    };
    const auto farthest = std::max_element(missed.begin(), missed.end(), short_mm);
    const std::string sentence = fmt::format(
        "{} got no droplet, the first that of row {}: axis x stayed up to {:.1f} um short of where the "
        "comparator fires; raise print.settle_ms, or lower stage.jerk_mm_s3 or stage.acceleration_mm_s2",
        counted(missed.size(), "bump"), job_.bumps[missed.front().bump].row, 1e3 * farthest->short_mm);
    result_.faults.push_back({seconds(cycle()), sentence});
    result_.verdict += "; " + sentence;
  }

  // ---- Pins ----
  void move_stage() {
    stage_.run_until(cycle(), [this](const motion::StageEvent& e) { record_stage(e); });
    stage_next_ = stage_.next_event_cycle().value_or(kNoEvent);
  }
  void record_stage(const motion::StageEvent& e) {
    const auto base = kFirstAxis + static_cast<std::uint32_t>(e.axis) * kPinsPerAxis;
    recorder_.set(base + 0, e.pins.step);
    recorder_.set(base + 1, e.pins.dir);
    recorder_.set(base + 2, e.pins.home);
    recorder_.set(base + 3, e.pins.limit_negative);
    recorder_.set(base + 4, e.pins.limit_positive);
    recorder_.set(base + 5, e.pins.index);
  }

  // Levels standing before the clock edge that ends this cycle.
  void record(const chip::Inputs& in) {
    if (cycle() == 0) {
      for (std::uint32_t axis = 0; axis < 3; ++axis) record_stage({0, axis, stage_.pins(axis)});
    }
    const bool heater = run_.out.heater && !in.inhibit;
    if (cycle() == 0 || !(run_.out == last_out_) || !(in == last_in_)) {
      chip::Outputs standing = run_.out;
      standing.heater = heater;
      record_inputs(recorder_, in);
      record_outputs(recorder_, standing);
      last_in_ = in;
      last_out_ = run_.out;
    }
    result_.heater_energy_j += heated_ ? seconds(cycle() - looked_at_) * job_.head.plant.power_w : 0.0;
    heated_ = heater;
    looked_at_ = cycle();
    recorder_.commit(cycle());
  }

  const PrintJob& job_;
  const std::function<void(const PrintProgress&)>& progress_;
  Head head_;
  DrivenStage stage_;
  Sent at_;  // the last move
  recording::Recorder recorder_;
  chip::Run run_;
  std::optional<Lockstep> lockstep_;
  PrintResult result_;

  std::uint64_t wake_ = 0;
  std::uint64_t stage_next_ = kNoEvent;
  Phase phase_ = Phase::reset;
  std::uint64_t run_at_ = 0;
  std::uint64_t off_at_ = 0;
  std::uint64_t deadline_ = 0;
  std::uint64_t next_poll_ = 0;
  std::size_t bump_ = 0;
  bool left_bumps_ = false;   // on the way from the last bump to the end
  bool stage_ready_ = false;  // homed, and at the job's start
  bool emergency_loop_ = false;
  std::uint64_t shot_over_ = 0;  // end of the trigger's pulse, 0 outside of one
  std::size_t heat_sample_ = 0;
  std::size_t next_event_ = 0;
  std::uint16_t messages_seen_ = 0;
  int waiting_ = 0;                    // requests without an answer yet
  std::uint8_t refused_ = 0;           // last exception code
  std::vector<std::uint16_t> status_;  // last status poll
  bool aborted_ = false;
  bool host_lost_ = false;
  bool heater_stayed_on_ = false;
  chip::Inputs last_in_;
  chip::Outputs last_out_{};
  bool heated_ = false;  // heater_o since looked_at_
  std::uint64_t looked_at_ = 0;
};

}  // namespace

Sent send(const PrintJob& job, const Sent& before, const Eigen::Vector3d& to_mm) {
  Sent sent{to_mm, to_mm};
  for (std::size_t i = 0; i < job.compensation.size(); ++i) {
    const motion::CompensationTable& table = job.compensation[i];
    const auto axis = static_cast<Eigen::Index>(i);
    const double target_mm = to_mm[axis];
    if (table.position_mm.empty()) continue;
    if (target_mm == before.to_mm[axis])
      sent.commanded_mm[axis] = before.commanded_mm[axis];
    else
      sent.commanded_mm[axis] = target_mm > before.to_mm[axis]
                                    ? motion::compensated_forward_mm(table, target_mm)
                                    : motion::compensated_reverse_mm(table, target_mm);
  }
  return sent;
}

recording::Header printer_header(const PrintJob& job) {
  using recording::Direction;
  recording::Header header =
      chip_pin_header(fmt::format("meltstage print job={} seed={:#x}", job.name, job.head.seed));
  const auto add = [&](std::string name, Direction direction) {
    header.pins.push_back({std::move(name), direction, 1, "stage"});
  };
  add("drop_trigger", Direction::in);
  for (std::string_view axis : motion::kAxisNames) {
    add(fmt::format("{}_step", axis), Direction::in);
    add(fmt::format("{}_dir", axis), Direction::in);
    add(fmt::format("{}_home", axis), Direction::out);
    add(fmt::format("{}_limit_neg", axis), Direction::out);
    add(fmt::format("{}_limit_pos", axis), Direction::out);
    add(fmt::format("{}_index", axis), Direction::out);
  }
  return header;
}

PrintResult run_print(const PrintJob& job, recording::Sink& sink,
                      const std::function<void(const PrintProgress&)>& progress) {
  return Printer(job, sink, progress).run();
}

}  // namespace meltstage::tb
