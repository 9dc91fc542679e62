// SPDX-License-Identifier: Apache-2.0
// A file that appears whole or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace meltstage {

/// Writes to "<path>.partial.<process>" beside the target, a file of its own for each writer; publish()
/// renames it over the target, and without publish() the destructor removes it. Those that killed runs left
/// are removed. A symbolic link stays one: what it points to is the target. Each failure throws UserError;
/// what was published is closed, and a write() or publish() after that throws std::logic_error. Unbuffered:
/// hand it large pieces.
class OutputFile {
 public:
  /// A piece that is large enough.
  static constexpr std::size_t kPiece_bytes = std::size_t{256} * 1024;

  explicit OutputFile(std::filesystem::path path);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  void write(std::string_view bytes);
  void publish();
  /// The same where nothing has the name yet; else false, and what has it stays.
  bool publish_new();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void require_open() const;
  void finish();

  std::filesystem::path path_;
  std::filesystem::path partial_;
  std::unique_ptr<std::FILE, Close> file_;
  int lock_ = -1;  // of the same file, until it has its name
};

/// A folder "<target>.partial.<process>" beside the target, to be filled and then published. Those that
/// killed runs left are removed, and so is this one by the destructor if it still has its name. A symbolic
/// link stays one: what it points to is the target. Each failure throws UserError.
class PartialFolder {
 public:
  explicit PartialFolder(const std::filesystem::path& target);
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;
  ~PartialFolder();

  const std::filesystem::path& path() const { return path_; }

  /// Takes the target's name; a second time throws std::logic_error. A folder that has it goes only then;
  /// until then it waits as
  /// "<target>.before.<process>", where it stays should this process be killed.
  void publish();

 private:
  std::filesystem::path target_, path_;
  bool published_ = false;
  int lock_ = -1;  // until it has the name
};

/// The path of a folder to write without what the completion of a shell puts behind it ("out/", "out/."):
/// what stands beside the folder is named after it. Throws UserError for one without a name of its own, such
/// as "." or "/".
std::filesystem::path folder_to_write(const std::filesystem::path& path);

/// A whole file at once. Throws UserError.
void write_whole(const std::filesystem::path& path, std::string_view text);

/// The same where nothing has the name yet, also when another process takes it meanwhile; else false.
bool write_whole_new(const std::filesystem::path& path, std::string_view text);

/// Several such files: none takes its name before all could be written. Empty paths aren't written.
void write_all_whole(const std::vector<std::pair<std::filesystem::path, std::string>>& files);

}  // namespace meltstage
