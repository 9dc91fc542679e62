// SPDX-License-Identifier: Apache-2.0
// A file that appears whole or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string_view>

namespace meltstage::vectors {

/// A place that can't be written; what() is one line: path, the system's reason, what to do.
class OutputError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Writes to "<path>.partial" beside the target; publish() renames it over the target, and without publish()
/// the destructor removes it. Each failure throws OutputError. Unbuffered: hand it large pieces.
class OutputFile {
 public:
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

/// A whole file at once. Throws OutputError.
void write_whole(const std::filesystem::path& path, std::string_view text);

}  // namespace meltstage::vectors
