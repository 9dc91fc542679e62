// SPDX-License-Identifier: Apache-2.0
// The project's own vector file, .mvec: one line a cycle with changes. docs/make/formats/mvec.md is its
// definition.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/output_file.hpp"
#include "base/sha256.hpp"
#include "recording/stream.hpp"

namespace meltstage::recording {

/// A defect of a vector file. what() is one line: "file:line:column: defect: found ..., expected ...; what to
/// do".
class FormatError : public UserError {
 public:
  FormatError(const std::string& message, std::size_t line, std::size_t column)
      : UserError(message), line_(line), column_(column) {}
  /// Both count from 1; the column counts bytes.
  std::size_t line() const { return line_; }
  std::size_t column() const { return column_; }

 private:
  std::size_t line_;
  std::size_t column_;
};

/// Writes a recording as .mvec while it runs, in constant memory. The file appears under its name at end();
/// without it (an exception on the way) nothing is left. Throws std::runtime_error when the disk refuses.
class TextWriter final : public Sink {
 public:
  explicit TextWriter(std::filesystem::path path);

  void begin(const Header& header) override;
  void change(const Change& change) override;
  void end(std::uint64_t final_cycle) override;

 private:
  struct PinText {
    std::string assignment;  // " name=" or " name=0x"
    bool is_bit;
  };

  void flush();

  OutputFile file_;
  Sha256 hash_;
  ChangeCheck check_;
  std::vector<PinText> pins_;
  std::string pending_;
  std::uint64_t line_cycle_ = 0;
  bool line_open_ = false;
};

/// Writes a complete stream as .mvec.
void write_text(const Stream& stream, const std::filesystem::path& path);

/// Reads a .mvec file in constant memory and plays it into `sink`. sink.end() is called only after the file's
/// hash was found right, so that a file-writing sink never publishes a damaged recording. Throws FormatError
/// on any defect of the content, std::runtime_error when the file can't be read.
void read_text_into(const std::filesystem::path& path, Sink& sink);

/// Reads a .mvec file whole; errors as read_text_into().
Stream read_text(const std::filesystem::path& path);

}  // namespace meltstage::recording
