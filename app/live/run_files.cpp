// SPDX-License-Identifier: Apache-2.0
#include "app/live/run_files.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <system_error>
#include <vector>

#include "app/live/samples.hpp"
#include "base/error.hpp"
#include "base/number.hpp"

namespace meltstage::app::live {
namespace {

constexpr std::string_view kHeader = "time_s,temperature_degc,setpoint_degc,duty_percent\n";
constexpr std::size_t kMostRuns = 1000;
constexpr std::size_t kMostRows = 2000;
constexpr std::size_t kLongestLine = 200;

std::string reason() { return std::generic_category().message(errno); }

std::string cell(double value) { return std::isnan(value) ? "" : fmt::format("{:.3f}", value); }

// Nothing for a line that is none of a run: the header, a part of a line.
std::optional<Sample> sample_in(std::string_view line) {
  std::array<double, 4> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t comma = line.find(',');
    if ((comma == std::string_view::npos) != (i + 1 == values.size())) return std::nullopt;
    const std::string_view text = line.substr(0, comma);
    constexpr double kMost = 1e12;
    const auto value =
        text.empty() ? std::numeric_limits<double>::quiet_NaN() : number_in(text, -kMost, kMost);
    if (!value) return std::nullopt;
    values[i] = *value;
    line.remove_prefix(std::min(comma + 1, line.size()));
  }
  if (std::isnan(values[0])) return std::nullopt;
  return Sample{values[0], values[1], values[2], values[3]};
}

// Calls `use` with each sample of the file.
template <class Use>
void for_each_sample(const std::filesystem::path& path, Use&& use) {
  std::error_code ignored;
  if (std::filesystem::symlink_status(path, ignored).type() != std::filesystem::file_type::regular)
    throw UserError(path.filename().string() + ": found no such run, expected one of /runs");
  std::ifstream file(path);
  std::array<char, kLongestLine> line{};
  while (file.getline(line.data(), line.size()) || (file.fail() && !file.eof() && file.gcount() > 0)) {
    const bool whole = !file.fail() && !file.eof();  // the last one may still be written
    if (file.fail()) {
      file.clear();
      file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
    if (const auto sample = whole ? sample_in(line.data()) : std::nullopt) use(*sample);
  }
}

}  // namespace

RunFile::RunFile(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  const std::string stem = fmt::format("run_{:%Y-%m-%d_%H%M%S}", fmt::localtime(now));
  constexpr int kMostInASecond = 1000;
  for (int i = 1; file_ < 0 && i < kMostInASecond; ++i) {
    name_ = i == 1 ? stem + ".csv" : fmt::format("{}_{}.csv", stem, i);
    constexpr mode_t kMode = 0666;
    file_ = open((folder / name_).c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, kMode);
    if (file_ < 0 && errno != EEXIST) break;
  }
  if (file_ < 0)
    throw UserError(fmt::format("--keep: {}: can't be written ({}), expected a folder for the runs",
                                (folder / name_).string(), reason()));
  append(kHeader);
}

RunFile::~RunFile() { close(file_); }

std::string RunFile::append(std::string_view line) {
  const ssize_t written = write(file_, line.data(), line.size());
  if (written == static_cast<ssize_t>(line.size())) {
    size_ += written;
    return "";
  }
  const std::string why = written < 0 ? reason() : "no room for a line";
  if (ftruncate(file_, size_) != 0) return why + "; its last line is torn";
  return why;
}

std::string RunFile::add(const Sample& sample) {
  if (size_ == 0)
    if (std::string why = append(kHeader); !why.empty()) return why;
  return append(fmt::format("{:.3f},{},{},{}\n", sample.time_s, cell(sample.temperature_degc),
                            cell(sample.setpoint_degc), cell(sample.duty_percent)));
}

std::string runs_json(const std::filesystem::path& folder) {
  static const std::regex kName{std::string(kRunName)};
  std::vector<std::pair<std::string, std::uintmax_t>> runs;
  std::error_code error;
  for (auto entry = std::filesystem::directory_iterator(folder, error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    std::error_code ignored;
    std::string name = entry->path().filename().string();
    if (entry->symlink_status(ignored).type() != std::filesystem::file_type::regular) continue;
    if (std::regex_match(name, kName)) runs.emplace_back(std::move(name), entry->file_size(ignored));
  }
  std::sort(runs.rbegin(), runs.rend());
  if (runs.size() > kMostRuns) runs.resize(kMostRuns);
  nlohmann::json json = nlohmann::json::array();
  for (const auto& [name, bytes] : runs) json.push_back({{"name", name}, {"bytes", bytes}});
  return json.dump();
}

std::string run_json(const std::filesystem::path& folder, const std::string& name) {
  std::size_t count = 0;
  for_each_sample(folder / name, [&](const Sample&) { ++count; });
  const std::size_t stride = std::max<std::size_t>(1, (count + kMostRows - 1) / kMostRows);
  std::string rows;
  std::size_t number = 0;
  for_each_sample(folder / name, [&](const Sample& sample) {
    if (number++ % stride == 0) rows += (rows.empty() ? "" : ",") + sample_json(sample);
  });
  return "[" + rows + "]";
}

}  // namespace meltstage::app::live
