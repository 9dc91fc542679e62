// SPDX-License-Identifier: Apache-2.0
// Lines of a file in bounded memory, with the hash of all bytes before the current line.
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/sha256.hpp"

namespace meltstage::recording {

/// How a line came out of the file.
enum class LineEnd { newline, file_end, too_long };

struct Line {
  std::string_view text;  ///< without its newline; valid until the next call
  LineEnd end;
};

class LineReader {
 public:
  /// Throws UserError with one line when the file can't be opened (so does next() when it can't be
  /// read).
  explicit LineReader(const std::filesystem::path& path);

  /// The next line; at the file's end what stands behind the last newline (mostly nothing), with
  /// LineEnd::file_end.
  Line next();
  /// Number of the line that next() gave last, from 1.
  std::size_t number() const { return number_; }
  /// SHA-256 of all bytes before that line. To be called once, as the last line is at hand.
  std::string digest_before_line();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  bool refill();

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Close> file_;
  Sha256 hash_;
  bool hashed_ = false;
  std::vector<char> buffer_;
  std::size_t line_ = 0;    // where the current line begins
  std::size_t next_ = 0;    // where the line after it begins
  std::size_t filled_ = 0;  // bytes of the buffer that are file
  std::size_t number_ = 0;
};

}  // namespace meltstage::recording
