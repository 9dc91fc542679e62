// SPDX-License-Identifier: Apache-2.0
// Cuts a run into windows: takes the recording of a print while it runs, or from a file, and writes the work
// folder.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "base/progress.hpp"
#include "cmodel/advance.hpp"
#include "recording/stream.hpp"
#include "recording/text.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/windows/windows.hpp"

namespace meltstage::tb {

// Where windows end.
struct WindowBorders {
  std::uint64_t every = chip::spec::kClkHz;  // clocks; 1 s
  std::vector<std::uint64_t> at = {};        // instead, when not empty: first cycles of windows but the first
};

// A recording of a few lines may claim centuries.
inline constexpr std::size_t kMostWindows = 100'000;

// Who ran, for the plan.
struct WindowRunName {
  std::string job;
  std::uint64_t seed = 0;
};

// A sink for any recording that has the chip's pins (others are left out) and begins at cycle 0 in reset. The
// model runs along on the recorded inputs and must give the recorded outputs. The work folder gets its name
// in publish(); results that lie there already stay if they are of the same plan.
class WindowPlanner final : public recording::Sink {
 public:
  // Throws UserError when `folder` exists and is no work folder. `progress` is told the share of the clocks
  // up to the next change or end, at least every second of chip time; it may throw to end the planning.
  WindowPlanner(std::filesystem::path folder, WindowRunName name, WindowBorders borders,
                Progress progress = {});
  ~WindowPlanner() override;
  WindowPlanner(const WindowPlanner&) = delete;
  WindowPlanner& operator=(const WindowPlanner&) = delete;

  // Throw UserError when the recording is not one of this chip, or has more than kMostWindows.
  void begin(const recording::Header& header) override;
  void change(const recording::Change& change) override;
  void end(std::uint64_t final_cycle) override;

  // After end().
  WindowPlan publish();

 private:
  void require_few_windows(std::uint64_t clocks) const;
  void run_until(std::uint64_t cycle);
  void open_window();
  void close_window();
  void save_border();
  std::uint64_t next_border() const;
  [[noreturn]] void refuse(const std::string& why) const;

  std::filesystem::path folder_;
  std::optional<PartialFolder> partial_folder_;
  std::filesystem::path partial_;
  WindowRunName name_;
  WindowBorders borders_;
  Progress progress_;
  WindowPlan plan_;
  std::vector<recording::Pin> pins_;                    // of the recording
  std::vector<std::optional<std::uint32_t>> chip_pin_;  // by pin of the recording
  std::array<std::uint64_t, kChipPinCount> levels_{};
  bool begun_ = false;
  std::uint64_t changed_at_ = 0;  // first cycle of the levels

  chip::Run run_;
  chip::Inputs before_ = {.rst_n = false};
  std::string border_hash_;
  std::unique_ptr<recording::TextWriter> slice_;
  std::unique_ptr<recording::Recorder> recorder_;
};

}  // namespace meltstage::tb
