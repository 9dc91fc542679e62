// SPDX-License-Identifier: Apache-2.0
// Rows of a workbook (.xls) through freexl. freexl 1.0 follows lengths and counts of a damaged file out of
// its own buffers, so it runs in a child process that hands the rows back over a pipe: what breaks is the
// child.
#include <fcntl.h>
#include <fmt/format.h>
#include <freexl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <system_error>
#include <type_traits>

#include "base/file.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/xls_records.hpp"

namespace meltstage::motion::detail {
namespace {

constexpr rlim_t kTimeLimit_s = 10;  // of the child's processor time; a sheet of full size takes about 1 s
constexpr std::size_t kMaxCount = 1U << 20;  // cells of a row, bytes of a text; the format allows less

// ---- the pipe: 'r', row and cells; 'e' and an error's text; 's' and another sheet's name; 'z' at the end
// ----

template <typename T>
void put(std::FILE* pipe, T value) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::fwrite(&value, sizeof value, 1, pipe);
}

void put_text(std::FILE* pipe, std::string_view text) {
  put(pipe, text.size());
  std::fwrite(text.data(), 1, text.size(), pipe);
}

// ---- the child ----

void check_xls(int result, const std::filesystem::path& path, std::string_view what) {
  if (result != FREEXL_OK)
    fail(path, fmt::format("{} (freexl {}), expected an Excel 97-2003 workbook; it may be damaged or cut off",
                           what, result));
}

Cell to_cell(const FreeXL_CellValue& value) {
  switch (value.type) {
    case FREEXL_CELL_INT:
      return {std::to_string(value.value.int_value), value.value.int_value};
    case FREEXL_CELL_DOUBLE:
      return {fmt::format("{}", value.value.double_value), value.value.double_value};
    case FREEXL_CELL_NULL:
      return {};
    default:
      return {value.value.text_value == nullptr ? "" : value.value.text_value, std::nullopt};
  }
}

unsigned int sheet_count(const void* book, const std::filesystem::path& path) {
  unsigned int sheets = 0;
  check_xls(freexl_get_info(book, FREEXL_BIFF_SHEET_COUNT, &sheets), path, "the workbook can't be read");
  return sheets;
}

/// The number of the first sheet that is shown; 0 where none is.
unsigned short first_sheet(const void* book, const std::filesystem::path& path, std::string_view content) {
  const std::string shown = first_shown_sheet(content);
  const unsigned int sheets = sheet_count(book, path);
  for (unsigned short sheet = 0; sheet < sheets; ++sheet) {
    const char* name = nullptr;
    check_xls(freexl_get_worksheet_name(book, sheet, &name), path, "a sheet has no name");
    if (name != nullptr && shown == name) return sheet;
  }
  return 0;
}

/// Sends the names of the sheets but `read` that have any size.
void send_other_sheets(const void* book, const std::filesystem::path& path, unsigned short read,
                       std::FILE* pipe) {
  const unsigned int sheets = sheet_count(book, path);
  for (unsigned short sheet = 0; sheet < sheets; ++sheet) {
    if (sheet == read) continue;
    unsigned int rows = 0;
    unsigned short columns = 0;
    const char* name = nullptr;
    check_xls(freexl_select_active_worksheet(book, sheet), path, "a sheet can't be read");
    check_xls(freexl_worksheet_dimensions(book, &rows, &columns), path, "a sheet has no size");
    check_xls(freexl_get_worksheet_name(book, sheet, &name), path, "a sheet has no name");
    if (rows == 0 || columns == 0) continue;
    put(pipe, 's');
    put_text(pipe, name == nullptr ? "" : name);
  }
}

/// Sends every row that has content, without the blank cells at its end. The workbook is left to the end of
/// the process: closing a damaged one may fail after all has been read.
void send_workbook(const std::filesystem::path& path, std::string_view content, std::FILE* pipe) {
  const void* book = nullptr;
  check_xls(freexl_open(path.c_str(), &book), path, "the workbook can't be opened");
  unsigned int password = 0;
  check_xls(freexl_get_info(book, FREEXL_BIFF_PASSWORD, &password), path, "the workbook can't be read");
  if (password == FREEXL_BIFF_OBFUSCATED)
    fail(path, "found a workbook with a password, expected one without; save it again unprotected");
  const unsigned short sheet = first_sheet(book, path, content);
  check_xls(freexl_select_active_worksheet(book, sheet), path, "there is no first sheet");
  unsigned int row_count = 0;
  unsigned short column_count = 0;
  check_xls(freexl_worksheet_dimensions(book, &row_count, &column_count), path,
            "the first sheet has no size");
  const auto others = cells_read_apart(content);
  if (!others.empty())
    row_count = std::max(row_count, static_cast<unsigned int>(others.rbegin()->first.first) + 1);
  std::vector<Cell> cells;
  for (unsigned int r = 0; r < row_count; ++r) {
    cells.clear();
    for (unsigned short c = 0; c < column_count; ++c) {
      if (const auto other = others.find({r, c}); other != others.end()) {
        cells.push_back(other->second);
        continue;
      }
      FreeXL_CellValue value{};
      check_xls(freexl_get_cell_value(book, r, c, &value), path, fmt::format("row {} can't be read", r + 1));
      cells.push_back(to_cell(value));
    }
    while (!cells.empty() && !cells.back().number && cells.back().text.empty()) cells.pop_back();
    if (cells.empty()) continue;
    put(pipe, 'r');
    put(pipe, std::size_t{r} + 1);
    put(pipe, cells.size());
    for (const Cell& cell : cells) {
      put(pipe, cell.number.has_value());
      put(pipe, cell.number.value_or(0.0));
      put_text(pipe, cell.text);
    }
  }
  send_other_sheets(book, path, sheet, pipe);
  put(pipe, 'z');
}

[[noreturn]] void run_child(const std::filesystem::path& path, std::string_view content, int write_end) {
  // Its end is the parent's to report: no handler of the parent, no words of the C library, no core file.
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGPIPE, SIGXCPU}) {
    std::signal(signal, SIG_DFL);
  }
  const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (null >= 0) dup2(null, STDERR_FILENO);
  const rlimit time{kTimeLimit_s, kTimeLimit_s + 1}, no_core{0, 0};
  if (setrlimit(RLIMIT_CPU, &time) != 0 || setrlimit(RLIMIT_CORE, &no_core) != 0) _exit(EXIT_FAILURE);
  std::FILE* pipe = fdopen(write_end, "wb");
  if (pipe == nullptr) _exit(EXIT_FAILURE);
  try {
    send_workbook(path, content, pipe);
  } catch (const std::exception& error) {
    put(pipe, 'e');
    put_text(pipe, error.what());
  }
  _exit(std::fflush(pipe) == 0 ? EXIT_SUCCESS : EXIT_FAILURE);
}

// ---- the parent ----

class Child {
 public:
  Child(const std::filesystem::path& path, std::string_view content) : path_(path) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) fail_system();
    pid_ = fork();
    if (pid_ == 0) run_child(path, content, ends[1]);
    close(ends[1]);
    pipe_.reset(fdopen(ends[0], "rb"));
    if (pid_ < 0 || !pipe_) fail_system();
  }
  ~Child() {
    if (pid_ > 0) end();
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  template <typename T>
  T get() {
    T value{};
    read(&value, sizeof value);
    return value;
  }
  /// A child whose memory is overwritten may send any count.
  std::size_t get_count() {
    const auto count = get<std::size_t>();
    if (count > kMaxCount) fail_child();
    return count;
  }
  std::string get_text() {
    std::string text(get_count(), '\0');
    read(text.data(), text.size());
    return text;
  }

 private:
  void read(void* to, std::size_t size) {
    if (size != 0 && std::fread(to, size, 1, pipe_.get()) != 1) fail_child();
  }
  /// How the child ended: SIGKILL changes nothing for one that has ended before.
  int end() {
    int status = 0;
    kill(pid_, SIGKILL);
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }
  [[noreturn]] void fail_child() {
    const int status = end();
    const bool killed = WIFSIGNALED(status);
    fail(path_,
         fmt::format("damaged: the spreadsheet reader failed ({} {}); expected an .xls of Excel 97-2003; "
                     "save the file again or export it as .csv",
                     killed ? "signal" : "exit status", killed ? WTERMSIG(status) : WEXITSTATUS(status)));
  }
  [[noreturn]] void fail_system() const {
    fail(path_, fmt::format("can't be read ({})", std::generic_category().message(errno)));
  }

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  const std::filesystem::path& path_;
  pid_t pid_ = -1;
  std::unique_ptr<std::FILE, Close> pipe_;
};

}  // namespace

std::vector<std::string> read_xls_rows(const std::filesystem::path& path, std::string_view content,
                                       const RowHandler& handle) {
  if (const auto kind = describe_content(content); !kind.starts_with("an OLE2"))
    fail(path, fmt::format("found {}, expected an Excel 97-2003 workbook (.xls)", kind));
  Child child(path, content);
  TableRow row;
  std::vector<std::string> others;
  for (char tag = child.get<char>(); tag != 'z'; tag = child.get<char>()) {
    if (tag == 'e') throw CoordinateError(child.get_text());
    if (tag == 's') {
      others.push_back(child.get_text());
      continue;
    }
    row.row = child.get<std::size_t>();
    row.cells.resize(child.get_count());
    for (Cell& cell : row.cells) {
      const bool is_number = child.get<bool>();
      const double number = child.get<double>();
      cell = {child.get_text(), is_number ? std::optional<double>(number) : std::nullopt};
    }
    handle(row);
  }
  return others;
}

}  // namespace meltstage::motion::detail
