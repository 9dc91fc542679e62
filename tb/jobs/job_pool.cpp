// SPDX-License-Identifier: Apache-2.0
// Worker processes of this machine.
#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <thread>

#include "base/error.hpp"
#include "tb/jobs/job_runners.hpp"

namespace meltstage::tb {

namespace {

constexpr std::chrono::milliseconds kLookAtChildren{10};

struct Task {
  std::size_t job;
  unsigned attempt;  // from 1
};

struct Worker {
  Task task;
  Child process;
};

// 0 and 1 are verdicts; the result lies in the folder.
bool gave_result(int wait_status) { return WIFEXITED(wait_status) && WEXITSTATUS(wait_status) <= 1; }

}  // namespace

JobsDone run_jobs_here(const Jobs& jobs, const JobOptions& options, const JobProgressCall& progress) {
  const unsigned processes = std::max(1u, options.processes);
  JobsDone ran{fmt::format("{} process{} on this machine", processes, processes == 1 ? "" : "es"), {}};
  std::deque<Task> tasks;
  for (const std::size_t job : jobs.numbers) tasks.push_back({job, 1});
  std::vector<Worker> workers;
  std::size_t done = 0;

  const auto start = [&](const Task& task) {
    Arguments arguments = jobs.worker;
    arguments.push_back(jobs.folder.string());
    arguments.push_back(std::to_string(task.job));
    workers.push_back({task, Child(arguments)});
  };
  const auto take_end = [&](const Task& task, int status) {
    if (gave_result(status)) {
      ++done;
      return;
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 2)
      throw UserError(fmt::format("{} {}: its files cannot be used", jobs.what, task.job));
    const bool again = task.attempt < options.attempts;
    ran.notes.push_back(fmt::format("{} {}: worker lost ({}), {}", jobs.what, task.job, describe_end(status),
                                    again ? "run again" : "given up"));
    if (again) tasks.push_back({task.job, task.attempt + 1});
  };

  while (!tasks.empty() || !workers.empty()) {
    while (!tasks.empty() && workers.size() < processes) {
      start(tasks.front());
      tasks.pop_front();
    }
    progress({done, jobs.numbers.size(), fmt::format("{} processes", workers.size())});
    std::this_thread::sleep_for(kLookAtChildren);
    for (std::size_t i = 0; i < workers.size();) {
      const std::optional<int> status = workers[i].process.poll();
      if (!status) {
        ++i;
        continue;
      }
      const Task task = workers[i].task;
      workers.erase(workers.begin() + static_cast<std::ptrdiff_t>(i));
      take_end(task, *status);
    }
  }
  progress({done, jobs.numbers.size(), "done"});
  return ran;
}

}  // namespace meltstage::tb
