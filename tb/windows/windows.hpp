// SPDX-License-Identifier: Apache-2.0
// Time-parallel lockstep: a run is cut into windows, each is checked on its own from the model's saved state,
// and the results are joined into one verdict. What is proved and the formats: docs/verify/windows.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tb/lockstep/lockstep.hpp"
#include "tb/windows/window_state.hpp"

namespace meltstage::tb {

// Clocks [first_cycle, last_cycle] of the run, and the hashes of what the check of them starts from, runs on,
// and must end in.
struct PlannedWindow {
  std::uint64_t first_cycle;
  std::uint64_t last_cycle;
  std::string start_state;
  std::string end_state;
  std::string stimulus;
};

// A work folder's plan.json.
struct WindowPlan {
  std::string job;
  std::uint64_t seed = 0;
  BuildIdentity made_by;
  std::uint64_t cycles = 0;  // clocks of the run
  std::vector<PlannedWindow> windows;
};

// SHA-256 of everything in the plan; results carry it.
std::string plan_hash(const WindowPlan& plan);

// Files of a work folder.
std::filesystem::path plan_file(const std::filesystem::path& folder);
std::filesystem::path state_file(const std::filesystem::path& folder, std::size_t border);
std::filesystem::path stimulus_file(const std::filesystem::path& folder, std::size_t window);
std::filesystem::path result_file(const std::filesystem::path& folder, std::size_t window);

// Whether the folder's plan was written here, be it damaged or by another build.
bool holds_plan(const std::filesystem::path& folder);
void write_plan(const std::filesystem::path& folder, const WindowPlan& plan);
// Throws UserError on a missing or damaged plan or one of another build.
WindowPlan read_plan(const std::filesystem::path& folder);
// Every state and stimulus against the plan's hashes. Throws UserError for the first that is missing or
// damaged.
void check_files(const std::filesystem::path& folder, const WindowPlan& plan);

// What the check of one window found.
struct WindowResult {
  std::filesystem::path file;  // that it was read from, for messages
  std::string plan;            // plan_hash
  std::uint64_t window = 0;
  std::uint64_t first_cycle = 0;
  std::uint64_t last_cycle = 0;
  std::string start_state;  // hash of the state that model and RTL were loaded with
  std::string end_state;    // hash of the state they ended in
  std::string stimulus;
  unsigned flop_bits = 0;
  Compared compared;
  bool equal = false;
  std::string report;  // of a window that is not equal
  std::string host;
  double wall_s = 0.0;
};

// Model and RTL from the window's first state over its stimulus to its border. Throws UserError when a file
// of the folder can't be used; a difference is in the result.
// `progress` is told now and then the share of its clocks that is done, 0..1.
WindowResult check_window(const std::filesystem::path& folder, const WindowPlan& plan, std::size_t window,
                          const std::function<void(double share)>& progress = {});

// How far a worker is with a window: for whoever waits, and nothing that a verdict rests on.
void write_share(const std::filesystem::path& folder, std::size_t window, double share);
// The sum over the windows that are under way.
double shares_under_way(const std::filesystem::path& folder);

// The result appears whole under its name; another one of the same window is replaced.
void write_result(const std::filesystem::path& folder, const WindowResult& result);

struct ReadResults {
  std::vector<WindowResult> results;
  std::vector<std::string> unreadable;  // a line for each file that is no result
};
// All results that lie in the folder, in the order of their file names.
ReadResults read_results(const std::filesystem::path& folder);

enum class WindowState { missing, equal, differs, unusable };

// All windows of a run together.
struct JoinedWindows {
  bool whole = false;                // every clock checked exactly once, all equal
  std::vector<WindowState> windows;  // by number
  std::size_t equal = 0;
  std::uint64_t cycles = 0;  // clocks of the run
  unsigned flop_bits = 0;
  Compared compared;                // sums over equal windows
  std::vector<std::string> faults;  // a line each; empty when whole
};

// Joins results into a chain from reset to the run's last clock: borders without gap or overlap, each
// window's end state the next one's start state, every window once. The plan says only which run the results
// must be of.
JoinedWindows join_windows(const WindowPlan& plan, const std::vector<WindowResult>& results);
// The same with what lies in the folder; files that are no results are faults.
JoinedWindows join_folder(const std::filesystem::path& folder, const WindowPlan& plan);

// Windows that have no usable result yet.
std::vector<std::size_t> windows_to_run(const std::filesystem::path& folder, const WindowPlan& plan);

}  // namespace meltstage::tb
