// SPDX-License-Identifier: Apache-2.0
#include "tb/windows/window_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/error.hpp"
#include "base/file.hpp"

namespace meltstage::tb {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kTellAfter = chip::spec::kClkHz;  // clocks

// A new plan takes the place of an earlier one, and of nothing that somebody else put there.
void require_replaceable(const fs::path& folder) {
  if (!fs::exists(folder)) return;
  const bool is_folder = fs::is_directory(folder);
  if (is_folder && fs::is_empty(folder)) return;
  if (!is_folder || !holds_plan(folder))
    throw UserError(fmt::format(
        "{}: exists and is no window plan (no plan.json of one); choose another folder", folder.string()));
  constexpr std::array<std::string_view, 6> kParts = {"plan.json", "states",   "stimulus",
                                                      "results",   "failures", "slurm"};
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (std::find(kParts.begin(), kParts.end(), entry.path().filename().string()) == kParts.end())
      throw UserError(fmt::format(
          "{}: is no part of a window plan, and its folder would be replaced; choose another folder, or move "
          "it away",
          entry.path().string()));
}

}  // namespace

WindowPlanner::WindowPlanner(fs::path folder, WindowRunName name, WindowBorders borders, Progress progress)
    : folder_(fs::absolute(std::move(folder)).lexically_normal()),
      name_(std::move(name)),
      borders_(std::move(borders)),
      progress_(std::move(progress)) {
  if (!folder_.has_filename()) folder_ = folder_.parent_path();
  require_replaceable(folder_);
  std::sort(borders_.at.begin(), borders_.at.end());
  borders_.at.erase(std::unique(borders_.at.begin(), borders_.at.end()), borders_.at.end());
  if (borders_.every == 0) throw UserError("window length: found 0 clocks, expected 1 or more");
  if (borders_.at.size() >= kMostWindows)
    throw UserError(
        fmt::format("border: found {} borders, expected fewer than {}", borders_.at.size(), kMostWindows));
  partial_folder_.emplace(folder_);
  partial_ = partial_folder_->path();
  for (const char* part : {"states", "stimulus", "results"}) fs::create_directories(partial_ / part);
  plan_.job = name_.job;
  plan_.seed = name_.seed;
  plan_.made_by = this_build();
}

WindowPlanner::~WindowPlanner() {
  slice_.reset();  // before its folder goes
}

void WindowPlanner::refuse(const std::string& why) const {
  throw UserError(fmt::format("recording of {}: {}; record it again", name_.job, why));
}

void WindowPlanner::begin(const recording::Header& header) {
  pins_ = header.pins;
  chip_pin_ = chip_pins_in(header, "recording of " + name_.job);
}

void WindowPlanner::change(const recording::Change& change) {
  if (!begun_ && change.cycle != 0)
    refuse(fmt::format("found a beginning at cycle {}, expected 0", change.cycle));
  begun_ = true;
  require_operation(pins_[change.pin], change.value, change.cycle, "recording of " + name_.job);
  if (change.cycle > changed_at_) run_until(change.cycle);
  changed_at_ = change.cycle;
  if (const auto pin = chip_pin_[change.pin]) levels_[*pin] = change.value;
}

void WindowPlanner::end(std::uint64_t final_cycle) {
  const std::uint64_t clocks = final_cycle + 1;
  run_until(clocks);
  if (!borders_.at.empty() && (borders_.at.front() == 0 || borders_.at.back() > final_cycle)) {
    if (final_cycle == 0) throw UserError("border: found one in a recording of one clock, expected none");
    throw UserError(fmt::format("border: found cycle {}, expected 1 to {}",
                                borders_.at.front() == 0 ? 0 : borders_.at.back(), final_cycle));
  }
  close_window();
  plan_.cycles = clocks;
}

std::uint64_t WindowPlanner::next_border() const {
  if (borders_.at.empty()) return (run_.cycle / borders_.every + 1) * borders_.every;
  const auto next = std::upper_bound(borders_.at.begin(), borders_.at.end(), run_.cycle);
  return next == borders_.at.end() ? recording::kMaxCycle : *next;
}

// Before the clocks are run, which may take hours.
void WindowPlanner::require_few_windows(std::uint64_t clocks) const {
  if (!borders_.at.empty() || clocks == 0 || (clocks - 1) / borders_.every < kMostWindows) return;
  throw UserError(fmt::format(
      "recording of {}: found {} windows of {} clocks up to cycle {}, expected at most {}; choose "
      "--window-clocks {} or more",
      name_.job, (clocks - 1) / borders_.every + 1, borders_.every, clocks - 1, kMostWindows,
      (clocks - 1) / kMostWindows + 1));
}

// The clocks from the present one to `cycle`, all with the levels as they stand.
void WindowPlanner::run_until(std::uint64_t cycle) {
  require_few_windows(cycle);
  const std::uint64_t begin = run_.cycle;
  const chip::Inputs in = inputs_of(levels_);
  const chip::Outputs recorded = outputs_of(levels_);
  chip::StillPins still{in};  // between two changes of the recording
  const auto check = [&](std::uint64_t at, const chip::Inputs&, const chip::Outputs& left) {
    const chip::Outputs standing = before_clock(left, in);
    if (standing != recorded) refuse(fmt::format("cycle {}: {}", at, output_difference(recorded, standing)));
  };
  while (run_.cycle < cycle) {
    if (!slice_) open_window();
    for (std::uint32_t pin = 0; pin < kChipPinCount; ++pin) recorder_->set(pin, levels_[pin]);
    recorder_->commit(run_.cycle);
    const std::uint64_t border = next_border();
    const std::uint64_t stop = std::min({cycle, border, run_.cycle + kTellAfter});
    tell(progress_, "planning", run_.cycle - begin, cycle - begin);
    chip::advance(run_, stop, still, check);
    before_ = in;
    if (stop == border) close_window();
  }
}

void WindowPlanner::open_window() {
  const std::size_t number = plan_.windows.size();
  if (number == 0) {
    if (run_.cycle != 0 || levels_[kPinRstN] != 0)
      refuse("found reset released in cycle 0, expected it asserted");
    save_border();
  }
  plan_.windows.push_back({run_.cycle, run_.cycle, border_hash_, "", ""});
  slice_ = std::make_unique<recording::TextWriter>(stimulus_file(partial_, number));
  recorder_ = std::make_unique<recording::Recorder>(
      *slice_, chip_pin_header(
                   fmt::format("meltstage window {} of job={} seed={:#x}", number, name_.job, name_.seed)));
}

void WindowPlanner::close_window() {
  if (!slice_) return;
  PlannedWindow& window = plan_.windows.back();
  window.last_cycle = run_.cycle - 1;
  recorder_->finish(window.last_cycle);
  recorder_.reset();
  slice_.reset();
  window.stimulus = sha256(read_file(stimulus_file(partial_, plan_.windows.size() - 1), kPlanFile));
  save_border();
  window.end_state = border_hash_;
}

void WindowPlanner::save_border() {
  const SavedState state{run_.cycle, before_, run_.chip};
  border_hash_ = state_hash(state);
  write_state(state_file(partial_, plan_.windows.size()), state);
}

WindowPlan WindowPlanner::publish() {
  require_replaceable(folder_);  // a job takes minutes, in which somebody may have put a file there
  write_plan(partial_, plan_);
  bool same = false;
  try {
    same = fs::exists(folder_) && plan_hash(read_plan(folder_)) == plan_hash(plan_);
  } catch (const UserError&) {
    // A plan that can't be read is not the same one.
  }
  if (same) {
    for (const char* part : {"results", "failures"}) {
      if (!fs::exists(folder_ / part)) continue;
      fs::remove_all(partial_ / part);
      fs::rename(folder_ / part, partial_ / part);
    }
  }
  partial_folder_->publish();
  return plan_;
}

}  // namespace meltstage::tb
