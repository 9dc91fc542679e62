// SPDX-License-Identifier: Apache-2.0
// Who does the numbered jobs of a work folder: worker processes of this machine, or a Slurm cluster. Results
// lie in the folder; a worker that is lost leaves none, and its job is done again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tb/jobs/process.hpp"

namespace meltstage::tb {

struct Jobs {
  std::string_view what;  // one of them, for messages: "window"
  Arguments worker;       // command that does one; folder and number are appended
  std::filesystem::path folder;
  std::vector<std::size_t> numbers;
  std::function<std::vector<std::size_t>()> left;  // those of the folder that have no result now
};

struct JobOptions {
  unsigned processes = 1;  // on this machine at once
  unsigned attempts = 3;   // for a job in all, before it is left without result
};

struct JobProgress {
  std::size_t done;  // of this call
  std::size_t total;
  std::string detail;  // "2 processes", "Slurm job 17: 3 running, 5 waiting"
};
// Called several times a second; may throw to end the run: workers are then killed, Slurm's jobs cancelled.
using JobProgressCall = std::function<void(const JobProgress&)>;

struct JobsDone {
  std::string workers;             // "2 processes on this machine", "Slurm job 17"
  std::vector<std::string> notes;  // a line for each lost worker
};

// A worker ends with exit status 0 or 1, its verdict, once its result lies in the folder. Both throw
// UserError when one says that the folder's files can't be used (exit status 2), or when the engine is
// missing.
JobsDone run_jobs_here(const Jobs& jobs, const JobOptions& options, const JobProgressCall& progress);
JobsDone run_jobs_slurm(const Jobs& jobs, const JobOptions& options, const JobProgressCall& progress);

}  // namespace meltstage::tb
