// SPDX-License-Identifier: Apache-2.0
#include "base/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "base/error.hpp"
#include "base/output_name.hpp"
#include "base/path_lock.hpp"

namespace meltstage {

using detail::lock_of;

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  throw UserError(
      fmt::format("{}: cannot write: found \"{}\", expected a writable folder with free space; "
                  "choose another place",
                  path.string(), std::generic_category().message(error)));
}

// What has the name of a symbolic link is replaced where it lies, and the link stays.
std::filesystem::path behind_links(std::filesystem::path path) {
  require_name_to_write(path);
  if (path.empty()) throw UserError("\"\": found an empty name, expected that of a file to write");
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

// Of a file or folder that is being written, until it takes its name: beside the target, by its process.
std::string partial_prefix(const std::filesystem::path& target) {
  return target.filename().string() + ".partial.";
}

std::filesystem::path folder_of(const std::filesystem::path& target) {
  return target.has_parent_path() ? target.parent_path() : ".";
}

// "<target>.partial.4711", and nothing of somebody else's such as "<target>.partial.mine".
bool is_partial(const std::string& name, const std::string& prefix) {
  return name.size() > prefix.size() && name.starts_with(prefix) &&
         name.find_first_not_of("0123456789.", prefix.size()) == std::string::npos;
}

void remove_leftovers(const std::filesystem::path& target, std::filesystem::file_type type) {
  const std::string prefix = partial_prefix(target);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder_of(target), error)) {
    if (!is_partial(entry.path().filename().string(), prefix)) continue;
    if (entry.symlink_status(error).type() != type) continue;
    const int lock = lock_of(entry.path(), type == std::filesystem::file_type::directory ? O_DIRECTORY : 0);
    if (lock < 0) continue;
    std::filesystem::remove_all(entry.path(), error);
    close(lock);
  }
}

// A new file of its own, locked. -1 with errno when it can't be; EEXIST when the name is taken.
int create_locked(const std::filesystem::path& path) {
  constexpr mode_t kAsUmaskSays = 0666;
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kAsUmaskSays);
  if (file < 0) return -1;
  flock(file, LOCK_EX);
  struct stat now {};
  if (fstat(file, &now) == 0 && now.st_nlink > 0) return file;
  close(file);  // taken for a leftover before it was locked
  errno = EEXIST;
  return -1;
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(behind_links(std::move(path))) {
  std::error_code error;
  const std::filesystem::file_status found = std::filesystem::status(path_, error);
  if (is_directory(found)) fail(path_, EISDIR);
  // The file takes the place of what has its name: a device would be lost.
  if (is_other(found)) fail(path_, ENOTSUP);
  remove_leftovers(path_, std::filesystem::file_type::regular);
  const std::string first = path_.string() + fmt::format(".partial.{}", getpid());
  constexpr int kMostNames = 1000;  // of files that one process writes to one name at a time
  int file = -1;
  for (int name = 0; file < 0; ++name) {
    partial_ = name == 0 ? first : fmt::format("{}.{}", first, name);
    file = create_locked(partial_);
    if (file < 0 && (errno != EEXIST || name == kMostNames)) fail(path_, errno);
  }
  lock_ = dup(file);
  file_.reset(fdopen(file, "wb"));
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
}

OutputFile::~OutputFile() {
  std::error_code ignored;  // nothing better can be done while an error unwinds
  if (!partial_.empty()) std::filesystem::remove(partial_, ignored);
  if (lock_ >= 0) close(lock_);
}

void OutputFile::require_open() const {
  if (!file_) throw std::logic_error(path_.string() + ": was published, expected nothing more to write");
}

void OutputFile::write(std::string_view bytes) {
  require_open();
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) fail(path_, errno);
}

void OutputFile::finish() {
  require_open();
  if (std::fclose(file_.release()) != 0) fail(path_, errno);
}

// The lock is held until the file has its name, so that nobody takes it for a leftover.
void OutputFile::publish() {
  finish();
  std::error_code error;
  std::filesystem::rename(partial_, path_, error);
  if (error) fail(path_, error.value());
  partial_.clear();
}

bool OutputFile::publish_new() {
  finish();
  const bool renamed = renameat2(AT_FDCWD, partial_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) == 0;
  // A network's file system can't rename so (EINVAL), but makes a second name only where none is.
  if (!renamed && (errno != EINVAL || link(partial_.c_str(), path_.c_str()) != 0)) {
    if (errno == EEXIST) return false;
    fail(path_, errno);
  }
  if (renamed) partial_.clear();
  return true;
}

PartialFolder::PartialFolder(const std::filesystem::path& target)
    : target_(folder_to_write(behind_links(folder_to_write(target)))), path_(target_) {
  std::error_code error;
  std::filesystem::create_directories(folder_of(target_), error);
  if (error) fail(target_, error.value());
  remove_leftovers(target_, std::filesystem::file_type::directory);
  path_ += fmt::format(".partial.{}", getpid());
  if (!std::filesystem::create_directory(path_, error)) fail(target_, error ? error.value() : EEXIST);
  lock_ = lock_of(path_, O_DIRECTORY);
}

PartialFolder::~PartialFolder() {
  std::error_code ignored;  // nothing better can be done while an error unwinds
  std::filesystem::remove_all(path_, ignored);
  if (lock_ >= 0) close(lock_);
}

void PartialFolder::publish() {
  if (published_) throw std::logic_error(target_.string() + ": was published, expected it once");
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
  published_ = true;
  if (replaces) std::filesystem::remove_all(before, error);  // what can't go stays beside it
  if (lock_ >= 0) close(lock_);  // it is no leftover any more, and another may lock it
  lock_ = -1;
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

void write_all_whole(const std::vector<std::pair<std::filesystem::path, std::string>>& files) {
  std::vector<std::unique_ptr<OutputFile>> open;
  for (const auto& [path, text] : files) {
    if (path.empty()) continue;
    open.push_back(std::make_unique<OutputFile>(path));
    open.back()->write(text);
  }
  for (const auto& file : open) file->publish();
}

void write_whole(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.publish();
}

bool write_whole_new(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  return file.publish_new();
}

}  // namespace meltstage
