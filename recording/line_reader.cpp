// SPDX-License-Identifier: Apache-2.0
#include "recording/line_reader.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "base/error.hpp"
#include "recording/text_format.hpp"

namespace meltstage::recording {
namespace {

constexpr std::size_t kFirstBufferBytes = std::size_t{256} * 1024;

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  throw UserError(
      fmt::format("{}: cannot read: found \"{}\", expected a readable vector file (.mvec); check the name",
                  path.string(), std::generic_category().message(error)));
}

}  // namespace

LineReader::LineReader(const std::filesystem::path& path) : path_(path), buffer_(kFirstBufferBytes) {
  std::error_code ignored;
  if (std::filesystem::is_other(path, ignored)) fail(path, ENOTSUP);  // a pipe may wait for ever
  file_.reset(std::fopen(path.c_str(), "rb"));
  if (!file_) fail(path, errno);
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
}

Line LineReader::next() {
  line_ = next_;
  ++number_;
  for (std::size_t searched = 0;;) {
    const char* begin = buffer_.data() + line_;
    const std::size_t available = filled_ - line_;
    if (const void* found = std::memchr(begin + searched, '\n', available - searched); found != nullptr) {
      const auto length = static_cast<std::size_t>(static_cast<const char*>(found) - begin);
      next_ = line_ + length + 1;
      return {{begin, length}, length > kMaxLineBytes ? LineEnd::too_long : LineEnd::newline};
    }
    searched = available;
    if (available > kMaxLineBytes) return {{begin, available}, LineEnd::too_long};
    if (!refill()) {
      next_ = filled_;
      return {{buffer_.data() + line_, available}, LineEnd::file_end};
    }
  }
}

std::string LineReader::digest_before_line() {
  hash_.update({buffer_.data(), line_});
  hashed_ = true;
  return hash_.finish();
}

/// Reads on behind what is left of the current line; false at the file's end.
bool LineReader::refill() {
  if (line_ > 0) {
    if (!hashed_) hash_.update({buffer_.data(), line_});
    std::memmove(buffer_.data(), buffer_.data() + line_, filled_ - line_);
    filled_ -= line_;
    line_ = 0;
  }
  if (filled_ == buffer_.size()) buffer_.resize(2 * buffer_.size());
  const std::size_t got = std::fread(buffer_.data() + filled_, 1, buffer_.size() - filled_, file_.get());
  if (got == 0 && std::ferror(file_.get())) fail(path_, errno);
  filled_ += got;
  return got > 0;
}

}  // namespace meltstage::recording
