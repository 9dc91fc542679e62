// SPDX-License-Identifier: Apache-2.0
#include "base/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "base/error.hpp"

namespace meltstage {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  throw UserError(
      fmt::format("{}: cannot write: found \"{}\", expected a writable folder with free space; "
                  "choose another place",
                  path.string(), std::generic_category().message(error)));
}

// What has the name of a symbolic link is replaced where it lies, and the link stays.
std::filesystem::path behind_links(std::filesystem::path path) {
  constexpr int kMostLinks = 40;  // as Linux follows
  const std::filesystem::path named = path;
  std::error_code error;
  for (int links = 0; std::filesystem::is_symlink(std::filesystem::symlink_status(path, error)); ++links) {
    if (links == kMostLinks) fail(named, ELOOP);
    const std::filesystem::path to = std::filesystem::read_symlink(path, error);
    if (error) fail(named, error.value());
    path = path.parent_path() / to;
  }
  return path;
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(behind_links(std::move(path))), partial_(path_) {
  std::error_code error;
  const std::filesystem::file_status found = std::filesystem::status(path_, error);
  if (is_directory(found)) fail(path_, EISDIR);
  // The file takes the place of what has its name: a device would be lost.
  if (is_other(found)) fail(path_, ENOTSUP);
  partial_ += ".partial";
  // What a killed run left. Removed rather than written to: it may be a link to another file.
  std::filesystem::remove(partial_, error);
  file_.reset(std::fopen(partial_.c_str(), "wbx"));
  if (!file_) fail(path_, errno);
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
}

OutputFile::~OutputFile() {
  if (partial_.empty()) return;
  file_.reset();
  std::error_code ignored;  // nothing better can be done while an error unwinds
  std::filesystem::remove(partial_, ignored);
}

void OutputFile::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) fail(path_, errno);
}

void OutputFile::publish() {
  if (std::fclose(file_.release()) != 0) fail(path_, errno);
  std::error_code error;
  std::filesystem::rename(partial_, path_, error);
  if (error) fail(path_, error.value());
  partial_.clear();
}

namespace {

// The lock of a folder ends with the process that holds it, however that ends. -1 when another holds it.
int lock_folder(const std::filesystem::path& folder) {
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  if (file >= 0) close(file);
  return -1;
}

void remove_leftovers(const std::filesystem::path& folder, const std::string& prefix) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (!entry.path().filename().string().starts_with(prefix)) continue;
    const int lock = lock_folder(entry.path());
    if (lock < 0) continue;
    std::filesystem::remove_all(entry.path(), error);
    close(lock);
  }
}

}  // namespace

PartialFolder::PartialFolder(const std::filesystem::path& target)
    : target_(folder_to_write(behind_links(folder_to_write(target)))), path_(target_) {
  const std::filesystem::path place = target_.has_parent_path() ? target_.parent_path() : ".";
  std::error_code error;
  std::filesystem::create_directories(place, error);
  remove_leftovers(place, target_.filename().string() + ".partial.");
  path_ += fmt::format(".partial.{}", getpid());
  if (!std::filesystem::create_directory(path_, error)) fail(target_, error ? error.value() : EEXIST);
  lock_ = lock_folder(path_);
}

PartialFolder::~PartialFolder() {
  std::error_code ignored;  // nothing better can be done while an error unwinds
  std::filesystem::remove_all(path_, ignored);
  if (lock_ >= 0) close(lock_);
}

void PartialFolder::publish() {
  std::filesystem::path before = target_;
  before += fmt::format(".before.{}", getpid());
  std::error_code error;
  std::filesystem::rename(target_, before, error);
  const bool replaces = !error;
  if (error && error != std::errc::no_such_file_or_directory) fail(target_, error.value());
  std::filesystem::rename(path_, target_, error);
  if (error) {
    std::error_code ignored;  // the first failure is told
    if (replaces) std::filesystem::rename(before, target_, ignored);
    fail(target_, error.value());
  }
  if (replaces) std::filesystem::remove_all(before, error);  // what can't go stays beside it
}

std::filesystem::path folder_to_write(const std::filesystem::path& path) {
  std::filesystem::path folder = path;
  while ((!folder.has_filename() || folder.filename() == ".") && folder.has_relative_path())
    folder = folder.parent_path();
  if (!folder.has_filename() || folder.filename() == "..")
    throw UserError(
        fmt::format("\"{}\": found a folder without a name of its own, expected the name of a folder "
                    "to write; give one",
                    path.string()));
  return folder;
}

void write_whole(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.publish();
}

}  // namespace meltstage
