// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/diagnosis/fail_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "base/byte_order_mark.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::dft {
namespace {

constexpr std::string_view kTitle = "fail log 1";

struct Word {
  std::string_view text;
  std::size_t column = 1;
};

std::vector<Word> words_of(std::string_view line) {
  std::vector<Word> words;
  constexpr std::string_view kBlank = " \t\r";
  for (std::size_t at = line.find_first_not_of(kBlank); at < line.size();) {
    if (line[at] == '#') break;  // a remark
    const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
    words.push_back({line.substr(at, end - at), at + 1});
    at = line.find_first_not_of(kBlank, end);
  }
  return words;
}

class Reader {
 public:
  Reader(std::string name, const CycleStream& stream) : name_(std::move(name)), stream_(stream) {
    for (const TestCycle& cycle : stream.cycles) {
      ends_.push_back(cycles_ += cycle.count);
    }
    for (std::size_t s = 0; s < stream.signals.size(); ++s) signal_[stream.signals[s].name] = s;
  }

  FailLog read(std::string_view text) {
    bool titled = false;
    while (!text.empty()) {
      ++line_;
      const std::size_t end = std::min(text.find('\n'), text.size());
      const std::vector<Word> words = words_of(text.substr(0, text.find('\n')));
      text.remove_prefix(std::min(end + 1, text.size()));
      if (words.empty()) continue;
      if (!titled) {
        title(words);
        titled = true;
      } else if (ended_) {
        fail(words[0], "nothing behind the end of the log");
      } else if (words[0].text == "cycle") {
        add(words);
      } else if (words.size() == 1 && (words[0].text == "end" || words[0].text == "full")) {
        ended_ = true;
        log_.truncated = words[0].text == "full";
        if (log_.truncated && log_.fails.empty()) fail(words[0], "failed strobes before the memory is full");
      } else {
        fail(words[0], "cycle NUMBER SIGNAL, end, or full");
      }
    }
    if (!titled || !ended_)
      throw UserError(defect_at(
          name_, {line_ + 1, 1}, "the end of the file",
          titled ? "end, or full where the tester's memory was: the log is cut off" : std::string(kTitle)));
    std::sort(log_.fails.begin(), log_.fails.end());
    log_.fails.erase(std::unique(log_.fails.begin(), log_.fails.end()), log_.fails.end());
    return std::move(log_);
  }

 private:
  [[noreturn]] void fail(const Word& word, std::string_view expected) const {
    throw UserError(defect_at(name_, {line_, word.column}, shown(word.text), expected));
  }
  void title(const std::vector<Word>& words) const {
    std::string text;
    for (const Word& word : words) text += (text.empty() ? "" : " ") + std::string(word.text);
    if (text != kTitle) throw UserError(defect_at(name_, {line_, words[0].column}, shown(text), kTitle));
  }
  void add(const std::vector<Word>& words) {
    if (words.size() != 3) fail(words.back(), "cycle NUMBER SIGNAL");
    const auto cycle = number_in<std::uint64_t>(words[1].text, 0, ~std::uint64_t{0});
    if (!cycle || *cycle >= cycles_)
      fail(words[1], fmt::format("a cycle of {}, 0 to {}", shown(stream_.title), cycles_ - 1));
    const auto signal = signal_.find(std::string(words[2].text));
    if (signal == signal_.end() || stream_.signals[signal->second].is_input)
      fail(words[2], fmt::format("an output of {}", shown(stream_.title)));
    const auto entry =
        static_cast<std::size_t>(std::upper_bound(ends_.begin(), ends_.end(), *cycle) - ends_.begin());
    const char state = stream_.cycles[entry].states[signal->second];
    if (state != 'H' && state != 'L')
      fail(words[2], fmt::format("an output that {} compares in cycle {}", shown(stream_.title), *cycle));
    log_.fails.push_back({*cycle, signal->second});
  }

  std::string name_;
  const CycleStream& stream_;
  std::vector<std::uint64_t> ends_;  // by entry of the stream, the cycle behind it
  std::uint64_t cycles_ = 0;
  std::unordered_map<std::string, std::size_t> signal_;
  std::size_t line_ = 0;
  bool ended_ = false;
  FailLog log_;
};

}  // namespace

std::string fail_log_text(const FailLog& log, const CycleStream& stream) {
  std::string text(kTitle);
  text += '\n';
  for (const FailedStrobe& fail : log.fails)
    text += fmt::format("cycle {} {}\n", fail.cycle, stream.signals[fail.signal].name);
  return text + (log.truncated ? "full\n" : "end\n");
}

FailLog parse_fail_log(std::string_view text, const std::string& name, const CycleStream& stream) {
  return Reader(name, stream).read(without_byte_order_mark(text));
}

FailLog read_fail_log(const std::filesystem::path& path, const CycleStream& stream) {
  return parse_fail_log(read_file(path, "a tester's fail log"), path.string(), stream);
}

}  // namespace meltstage::dft
