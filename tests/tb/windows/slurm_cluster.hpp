// SPDX-License-Identifier: Apache-2.0
// A Slurm cluster of one node, this machine: controller and node daemon of our own, with their files in a
// folder that goes away. Needs neither root, systemd, cgroups nor munge.
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "recording.hpp"

namespace meltstage::tb {

class SlurmCluster {
 public:
  // Starts both and waits until the node is idle; SLURM_CONF of this process then names it. Throws
  // std::runtime_error with the daemons' last words.
  SlurmCluster();
  ~SlurmCluster();
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

 private:
  TemporaryFolder folder_;
  pid_t controller_ = -1;
  pid_t node_ = -1;
};

// Output of a command line.
std::string shell(const std::string& line);

}  // namespace meltstage::tb
