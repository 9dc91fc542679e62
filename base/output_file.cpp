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

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)), partial_(path_) {
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

PartialFolder::PartialFolder(const std::filesystem::path& target) : path_(target) {
  const std::filesystem::path place = target.has_parent_path() ? target.parent_path() : ".";
  std::error_code error;
  std::filesystem::create_directories(place, error);
  remove_leftovers(place, target.filename().string() + ".partial.");
  path_ += fmt::format(".partial.{}", getpid());
  if (!std::filesystem::create_directory(path_, error)) fail(target, error ? error.value() : EEXIST);
  lock_ = lock_folder(path_);
}

PartialFolder::~PartialFolder() {
  std::error_code ignored;  // nothing better can be done while an error unwinds
  std::filesystem::remove_all(path_, ignored);
  if (lock_ >= 0) close(lock_);
}

void write_whole(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.publish();
}

}  // namespace meltstage
