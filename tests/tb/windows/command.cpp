// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "recording.hpp"
#include "recording/text.hpp"
#include "tb/windows/window_state.hpp"

namespace meltstage::tb {

namespace fs = std::filesystem;

Background::Background(const std::string& arguments)
    : log_(fs::temp_directory_path() / fmt::format("meltstage_background.{}.log", getpid())) {
  const std::string line = fmt::format("exec {} {} >{} 2>&1", MELTSTAGE_COMMAND, arguments, log_.string());
  pid_ = fork();
  if (pid_ == 0) {
    execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    _exit(127);
  }
}

Background::~Background() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  std::error_code ignored;
  fs::remove(log_, ignored);
}

Ran Background::wait() {
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(log_)};
}

std::optional<pid_t> find_worker(const fs::path& folder, const std::string& verb) {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const std::string line = text_of(entry.path() / "cmdline");  // arguments end in a zero byte each
    const std::string wanted = '\0' + verb + '\0' + folder.string() + '\0';
    if (line.find(wanted) != std::string::npos) return static_cast<pid_t>(std::stol(name));
  }
  return std::nullopt;
}

bool wait_until(const std::function<bool()>& condition, std::chrono::seconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

std::size_t count_results(const fs::path& folder) {
  std::size_t count = 0;
  if (!fs::exists(folder / "results")) return 0;
  for (const auto& entry : fs::directory_iterator(folder / "results"))
    count += entry.path().extension() == ".json";
  return count;
}

Ran plan_by_command(const fs::path& folder, std::uint64_t clocks, std::uint64_t window_clocks) {
  recording::Stream cut;
  cut.begin(lively_recording().pins.header());
  recording::ChangeReader reader(lively_recording().pins);
  for (recording::Change change; reader.next(change) && change.cycle < clocks;) cut.change(change);
  cut.end(clocks - 1);
  const fs::path pins = folder.string() + ".mvec";
  recording::write_text(cut, pins);
  return run_command(
      fmt::format("windows plan {} {} --window-clocks {}", pins.string(), folder.string(), window_clocks));
}

void seed_difference(const fs::path& folder, std::size_t border, const std::string& flop) {
  const fs::path path = folder / "states" / fmt::format("{:06}.state", border);
  std::string text = text_of(path);
  const auto content_hash = [&] {
    const std::size_t begin = text.find("cycle ");
    return sha256(text.substr(begin, text.rfind("sha256 ") - begin));
  };
  const std::string before = content_hash();
  const std::size_t digit = text.find('\n', text.find("flop " + flop + " ")) - 1;
  text[digit] = text[digit] == '0' ? '1' : '0';
  const std::string after = content_hash();
  set_text(path, sealed_state(text));

  auto plan = nlohmann::ordered_json::parse(text_of(folder / "plan.json"));
  plan["content"]["windows"][border - 1]["end_state"] = after;
  plan["content"]["windows"][border]["start_state"] = after;
  plan["sha256"] = sha256(plan["content"].dump());
  set_text(folder / "plan.json", plan.dump(1) + "\n");
}

}  // namespace meltstage::tb
