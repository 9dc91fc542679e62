// SPDX-License-Identifier: Apache-2.0
// Jobs as Slurm job arrays: sbatch starts, squeue says what is still there, scancel ends. Scheduling,
// nodes and requeueing after a node's failure are Slurm's.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <sstream>
#include <system_error>
#include <thread>

#include "base/error.hpp"
#include "base/first_line.hpp"
#include "base/output_file.hpp"
#include "tb/jobs/job_runners.hpp"

namespace meltstage::tb {

namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kLookForInterrupt{200};  // for an interrupt
constexpr std::chrono::seconds kAsk{2};                      // between questions to the controller
constexpr std::chrono::minutes kControllerLost{10};          // without an answer

CommandOutput slurm(const Arguments& arguments) {
  try {
    return run_command(arguments);
  } catch (const std::system_error&) {
    throw UserError(fmt::format(
        "{}: not found, expected Slurm's commands in PATH; install slurm-wlm or leave out --slurm",
        arguments[0]));
  }
}

// Word for the shell.
std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

// Largest number of tasks in one array, by the controller's MaxArraySize (exclusive upper end of the index).
std::size_t max_array_size() {
  const CommandOutput config = slurm({"scontrol", "show", "config"});
  const std::size_t at = config.text.find("MaxArraySize");
  if (config.status != 0 || at == std::string::npos)
    throw UserError(
        fmt::format("scontrol: no answer from Slurm's controller: {}; start it or leave out --slurm",
                    first_line(config.text)));
  std::size_t size = 0;
  std::istringstream(config.text.substr(config.text.find('=', at) + 1)) >> size;
  if (size < 2) throw UserError("scontrol: found MaxArraySize below 2, expected job arrays to be allowed");
  return size;
}

struct Queue {
  std::size_t running = 0;
  std::size_t waiting = 0;
  std::size_t held = 0;  // will never start by itself
};

// Arrays that were submitted; cancelled when this object goes away before they ended.
class Arrays {
 public:
  ~Arrays() {
    if (ids_.empty()) return;
    try {
      cancel();
    } catch (const std::exception&) {
      // Slurm is gone; its jobs end with it.
    }
  }
  explicit Arrays(std::string_view what) : name_(fmt::format("meltstage-{}s", what)) {}
  Arrays(const Arrays&) = delete;
  Arrays& operator=(const Arrays&) = delete;

  void submit(const fs::path& script, const fs::path& log, std::size_t tasks) {
    const CommandOutput out =
        slurm({"sbatch", "--parsable", "--job-name=" + name_, "--ntasks=1", "--cpus-per-task=1", "--requeue",
               fmt::format("--array=0-{}", tasks - 1), "--output=" + log.string(), "--open-mode=append",
               "--chdir=" + script.parent_path().string(), script.string()});
    if (out.status != 0)
      throw UserError(fmt::format("sbatch: refused the job array: {}; see sinfo, or leave out --slurm",
                                  first_line(out.text)));
    const std::string id(first_line(out.text));
    ids_.push_back(id.substr(0, id.find(';')));
  }
  // What is still in the queue; nothing when the controller doesn't answer.
  std::optional<Queue> ask() const {
    Queue queue;
    for (const std::string& id : ids_) {
      // %T state, %r reason; array tasks one by one.
      const CommandOutput out = slurm({"squeue", "--noheader", "--array", "--jobs=" + id, "--format=%T %r"});
      if (out.status != 0) {
        if (out.text.find("Invalid job id") != std::string::npos) continue;  // ended and forgotten
        return std::nullopt;
      }
      std::istringstream lines(out.text);
      for (std::string line; std::getline(lines, line);) {
        if (line.empty()) continue;
        if (!line.starts_with("PENDING")) {
          ++queue.running;
        } else if (line.find("held") != std::string::npos || line.find("Held") != std::string::npos) {
          ++queue.held;
        } else {
          ++queue.waiting;
        }
      }
    }
    return queue;
  }
  // Tasks in the queue or at work; scancel's answer.
  CommandOutput cancel() const {
    Arguments arguments{"scancel"};
    arguments.insert(arguments.end(), ids_.begin(), ids_.end());
    return slurm(arguments);
  }
  std::string names() const { return fmt::format("{}", fmt::join(ids_, ", ")); }
  void ended() { ids_.clear(); }

 private:
  std::string name_;
  std::vector<std::string> ids_;
};

class SlurmRun {
 public:
  SlurmRun(const Jobs& jobs, const JobOptions& options, const JobProgressCall& progress)
      : jobs_(jobs), folder_(fs::absolute(jobs.folder)), options_(options), progress_(progress) {}

  JobsDone run() {
    fs::create_directories(folder_ / "slurm");
    const std::size_t most = max_array_size();
    JobsDone ran;
    std::vector<std::size_t> numbers = jobs_.numbers;
    for (unsigned attempt = 1; !numbers.empty() && attempt <= options_.attempts; ++attempt) {
      Arrays arrays(jobs_.what);
      for (std::size_t begin = 0; begin < numbers.size(); begin += most)
        submit(arrays,
               {numbers.begin() + static_cast<std::ptrdiff_t>(begin),
                numbers.begin() + static_cast<std::ptrdiff_t>(std::min(numbers.size(), begin + most))});
      ran.workers += fmt::format("{}{}", ran.workers.empty() ? "Slurm job " : ", ", arrays.names());
      wait(arrays, ran.notes);
      const std::string names = arrays.names();
      arrays.ended();
      numbers = lost(numbers);
      for (const std::size_t number : numbers) {
        ran.notes.push_back(fmt::format("{} {}: no result from Slurm job {}, {}", jobs_.what, number, names,
                                        attempt < options_.attempts ? "run again" : "given up"));
      }
    }
    return ran;
  }

 private:
  // Task k of the array does the k-th job of the list beside its script.
  void submit(Arrays& arrays, const std::vector<std::size_t>& numbers) {
    std::size_t number = 0;
    fs::path script;
    do script = folder_ / "slurm" / fmt::format("array_{}.sh", number++);
    while (fs::exists(script));
    const fs::path list = fs::path(script).replace_extension("list");
    write(list, fmt::format("{}\n", fmt::join(numbers, "\n")));
    std::string command;
    for (const std::string& word : jobs_.worker) command += quoted(word) + " ";
    write(script, fmt::format("#!/bin/sh\n"
                              "job=$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" {})\n"
                              "exec {}{} \"$job\"\n",
                              quoted(list.string()), command, quoted(folder_.string())));
    arrays.submit(script, folder_ / "slurm" / "%A_%a.log", numbers.size());
  }

  static void write(const fs::path& path, const std::string& text) {
    OutputFile file(path);
    file.write(text);
    file.publish();
  }

  void wait(const Arrays& arrays, std::vector<std::string>& notes) {
    Clock::time_point answered = Clock::now();
    Clock::time_point next = answered;
    std::string detail = "Slurm job " + arrays.names();
    std::size_t done = 0;
    for (;; std::this_thread::sleep_for(kLookForInterrupt)) {
      if (Clock::now() >= next) {
        if (const std::optional<Queue> queue = arrays.ask()) {
          answered = Clock::now();
          if (queue->running + queue->waiting == 0) return cancel_held(arrays, *queue, notes);
          detail = fmt::format("Slurm job {}: {} running, {} waiting", arrays.names(), queue->running,
                               queue->waiting);
        } else if (Clock::now() - answered > kControllerLost) {
          throw UserError(
              "squeue: no answer from Slurm's controller for 10 minutes; run again when it is back");
        }
        done = jobs_.numbers.size() - std::min(jobs_.numbers.size(), jobs_.left().size());
        next = Clock::now() + kAsk;
      }
      progress_({done, jobs_.numbers.size(), detail});
    }
  }

  // A task that Slurm holds after a failed launch counts as lost.
  static void cancel_held(const Arrays& arrays, const Queue& queue, std::vector<std::string>& notes) {
    if (queue.held == 0) return;
    if (const CommandOutput out = arrays.cancel(); out.status != 0)
      notes.push_back(fmt::format("Slurm job {}: scancel refused to end its held tasks: {}; cancel them",
                                  arrays.names(), first_line(out.text)));
  }

  // Of `numbers`, those without a result; a shared file system may show results late.
  std::vector<std::size_t> lost(const std::vector<std::size_t>& numbers) const {
    constexpr int kLooks = 10;
    std::vector<std::size_t> missing;
    for (int look = 0; look < kLooks; ++look) {
      missing.clear();
      for (const std::size_t number : jobs_.left()) {
        if (std::find(numbers.begin(), numbers.end(), number) != numbers.end()) missing.push_back(number);
      }
      if (missing.empty()) break;
      std::this_thread::sleep_for(kLookForInterrupt);
    }
    return missing;
  }

  const Jobs& jobs_;
  fs::path folder_;
  const JobOptions& options_;
  const JobProgressCall& progress_;
};

}  // namespace

JobsDone run_jobs_slurm(const Jobs& jobs, const JobOptions& options, const JobProgressCall& progress) {
  return SlurmRun(jobs, options, progress).run();
}

}  // namespace meltstage::tb
