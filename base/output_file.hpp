// SPDX-License-Identifier: Apache-2.0
// A file that appears whole or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string_view>

namespace meltstage {

/// Writes to "<path>.partial" beside the target; publish() renames it over the target, and without publish()
/// the destructor removes it. Each failure throws UserError. Unbuffered: hand it large pieces.
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

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::filesystem::path path_;
  std::filesystem::path partial_;
  std::unique_ptr<std::FILE, Close> file_;
};

/// A folder "<target>.partial.<process>" beside the target, to be filled and then renamed. Those that killed
/// runs left are removed, and so is this one by the destructor if it still has its name. Each failure throws
/// UserError.
class PartialFolder {
 public:
  explicit PartialFolder(const std::filesystem::path& target);
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;
  ~PartialFolder();

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;  // held for as long as this process lives
};

/// A whole file at once. Throws UserError.
void write_whole(const std::filesystem::path& path, std::string_view text);

}  // namespace meltstage
