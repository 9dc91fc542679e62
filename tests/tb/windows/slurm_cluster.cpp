// SPDX-License-Identifier: Apache-2.0
#include "slurm_cluster.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <pwd.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <vector>

#include "command.hpp"

namespace meltstage::tb {

namespace fs = std::filesystem;

namespace {

int free_port() {
  const int socket_fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool bound = bind(socket_fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 &&
                     getsockname(socket_fd, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  close(socket_fd);
  if (!bound) throw std::runtime_error("no free port on 127.0.0.1");
  return ntohs(address.sin_port);
}

std::string short_host_name() {
  char name[256] = {};
  gethostname(name, sizeof name - 1);
  const std::string host = name;
  return host.substr(0, host.find('.'));
}

pid_t start(const std::vector<std::string>& arguments, const fs::path& log) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  dup2(out, STDOUT_FILENO);
  dup2(out, STDERR_FILENO);
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  execvp(argv[0], argv.data());
  _exit(127);
}

void stop(pid_t pid) {
  if (pid <= 0) return;
  kill(pid, SIGTERM);
  const bool ended =
      wait_until([&] { return waitpid(pid, nullptr, WNOHANG) != 0; }, std::chrono::seconds(10));
  if (ended) return;
  kill(pid, SIGKILL);
  waitpid(pid, nullptr, 0);
}

}  // namespace

std::string shell(const std::string& line) {
  FILE* pipe = popen((line + " 2>&1").c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer;
  while (const std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) text.append(buffer.data(), n);
  pclose(pipe);
  return text;
}

SlurmCluster::SlurmCluster() {
  const std::string host = short_host_name();
  const passwd* user = getpwuid(getuid());
  const fs::path& folder = folder_.path();
  const fs::path conf = folder / "slurm.conf";
  for (const char* part : {"state", "spool"}) fs::create_directories(folder / part);
  set_text(conf, fmt::format("ClusterName=meltstage\n"
                             "SlurmctldHost={host}(127.0.0.1)\n"
                             "SlurmctldPort={controller_port}\n"
                             "SlurmdPort={node_port}\n"
                             "SlurmUser={user}\n"
                             "SlurmdUser={user}\n"
                             "AuthType=auth/none\n"
                             "CredType=cred/none\n"
                             "ProctrackType=proctrack/linuxproc\n"
                             "TaskPlugin=task/none\n"
                             "JobAcctGatherType=jobacct_gather/none\n"
                             "AccountingStorageType=accounting_storage/none\n"
                             "SelectType=select/cons_tres\n"
                             "SelectTypeParameters=CR_CPU\n"
                             "SlurmdParameters=config_overrides\n"
                             "ReturnToService=2\n"
                             "MailProg=/bin/true\n"
                             "StateSaveLocation={folder}/state\n"
                             "SlurmdSpoolDir={folder}/spool\n"
                             "SlurmctldPidFile={folder}/slurmctld.pid\n"
                             "SlurmdPidFile={folder}/slurmd.pid\n"
                             "NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN\n"
                             "PartitionName=work Nodes=ALL Default=YES MaxTime=INFINITE State=UP\n",
                             fmt::arg("host", host), fmt::arg("controller_port", free_port()),
                             fmt::arg("node_port", free_port()),
                             fmt::arg("user", user != nullptr ? user->pw_name : "root"),
                             fmt::arg("folder", folder.string())));
  // Named, so that no mounted control groups are looked for; nothing here uses them.
  set_text(folder / "cgroup.conf", "CgroupPlugin=cgroup/v1\n");
  setenv("SLURM_CONF", conf.c_str(), 1);
  // Debian keeps the daemons where a user's PATH may not look.
  setenv("PATH", (std::string(getenv("PATH")) + ":/usr/sbin:/sbin").c_str(), 1);
  controller_ = start({"slurmctld", "-D", "-i"}, folder / "slurmctld.log");
  node_ = start({"slurmd", "-D", "-N", host}, folder / "slurmd.log");
  const bool up =
      wait_until([] { return shell("sinfo --noheader --format=%T") == "idle\n"; }, std::chrono::seconds(60));
  if (!up) {
    const std::string words =
        shell("sinfo") + text_of(folder / "slurmctld.log") + text_of(folder / "slurmd.log");
    stop(node_);
    stop(controller_);
    throw std::runtime_error("Slurm did not come up:\n" + words);
  }
}

SlurmCluster::~SlurmCluster() {
  stop(node_);
  stop(controller_);
}

}  // namespace meltstage::tb
