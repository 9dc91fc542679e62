// SPDX-License-Identifier: Apache-2.0
// Tool paths as programs of a machine: RS-274. Each word of each block has to be known, for one that isn't
// may move the tool or the frame.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_lines.hpp"
#include "motion/surface/path_lines.hpp"

namespace meltstage::motion::detail {

namespace {

/// A G or M word that is known. Of one group a block may have one.
struct KnownCode {
  std::string_view name;
  std::string_view group;
};

constexpr std::array kKnownCodes{KnownCode{"G0", "motion"},
                                 KnownCode{"G1", "motion"},
                                 KnownCode{"G80", "cycle"},
                                 KnownCode{"G4", "once"},
                                 KnownCode{"G28", "once"},
                                 KnownCode{"G30", "once"},
                                 KnownCode{"G53", "machine"},
                                 KnownCode{"G17", "plane"},
                                 KnownCode{"G18", "plane"},
                                 KnownCode{"G19", "plane"},
                                 KnownCode{"G20", "unit"},
                                 KnownCode{"G21", "unit"},
                                 KnownCode{"G90", "distance"},
                                 KnownCode{"G91", "distance"},
                                 KnownCode{"G90.1", "arc distance"},
                                 KnownCode{"G91.1", "arc distance"},
                                 KnownCode{"G40", "cutter"},
                                 KnownCode{"G43", "length"},
                                 KnownCode{"G43.1", "length"},
                                 KnownCode{"G49", "length"},
                                 KnownCode{"G54", "frame"},
                                 KnownCode{"G55", "frame"},
                                 KnownCode{"G56", "frame"},
                                 KnownCode{"G57", "frame"},
                                 KnownCode{"G58", "frame"},
                                 KnownCode{"G59", "frame"},
                                 KnownCode{"G59.1", "frame"},
                                 KnownCode{"G59.2", "frame"},
                                 KnownCode{"G59.3", "frame"},
                                 KnownCode{"G61", "path"},
                                 KnownCode{"G61.1", "path"},
                                 KnownCode{"G64", "path"},
                                 KnownCode{"G15", "polar"},
                                 KnownCode{"G69", "turning"},
                                 KnownCode{"G93", "feed"},
                                 KnownCode{"G94", "feed"},
                                 KnownCode{"G95", "feed"},
                                 KnownCode{"G96", "speed"},
                                 KnownCode{"G97", "speed"},
                                 KnownCode{"G98", "return"},
                                 KnownCode{"G99", "return"},
                                 KnownCode{"M0", "stop"},
                                 KnownCode{"M1", "stop"},
                                 KnownCode{"M2", "stop"},
                                 KnownCode{"M30", "stop"},
                                 KnownCode{"M3", "spindle"},
                                 KnownCode{"M4", "spindle"},
                                 KnownCode{"M5", "spindle"},
                                 KnownCode{"M6", "tool"},
                                 KnownCode{"M7", "mist"},
                                 KnownCode{"M8", "coolant"},
                                 KnownCode{"M9", "coolant"},
                                 KnownCode{"M48", "override"},
                                 KnownCode{"M49", "override"},
                                 KnownCode{"M50", "override"},
                                 KnownCode{"M51", "override"},
                                 KnownCode{"M52", "override"},
                                 KnownCode{"M53", "override"},
                                 KnownCode{"M62", "output"},
                                 KnownCode{"M63", "output"},
                                 KnownCode{"M64", "output"},
                                 KnownCode{"M65", "output"},
                                 KnownCode{"M66", "input"},
                                 KnownCode{"M67", "output value"},
                                 KnownCode{"M68", "output value"}};

/// A letter that only says more about another word of its block.
struct Companion {
  char letter;
  std::vector<std::string_view> of;
};

const std::array kCompanions{Companion{'P', {"G4", "G64", "M62", "M63", "M64", "M65", "M66"}},
                             Companion{'Q', {"G64", "M66", "M67", "M68"}},
                             Companion{'L', {"M66"}},
                             Companion{'E', {"M66", "M67", "M68"}},
                             Companion{'H', {"G43"}},
                             Companion{'D', {"G96"}}};

constexpr std::string_view kMoves = "XYZ", kTurns = "ABC", kAnywhere = "GMNFST";

struct Word {
  char letter = 0;  ///< capital
  double value = 0.0;
  std::string_view text;
  std::string code;        ///< of G and M words: "G43.1"
  std::string_view group;  ///< of the code
};

/// "G4, G64 or M62".
std::string any_of_codes(const std::vector<std::string_view>& codes) {
  std::string out;
  for (std::size_t i = 0; i < codes.size(); ++i)
    out += fmt::format("{}{}", i == 0 ? "" : i + 1 == codes.size() ? " or " : ", ", codes[i]);
  return out;
}

/// A row of the program, its words known and fit for each other.
class Block {
 public:
  Block(const PathLines& lines, std::size_t row, std::string_view text) : lines_(lines), row_(row) {
    split(text);
    for (Word& word : words_) name_code(word);
    check_repeats();
    for (const Word& word : words_) check_letter(word);
  }

  const std::vector<Word>& words() const { return words_; }
  bool has(std::string_view code) const {
    return std::any_of(words_.begin(), words_.end(), [&](const Word& w) { return w.code == code; });
  }
  const Word* find(char letter) const {
    const auto at =
        std::find_if(words_.begin(), words_.end(), [&](const Word& w) { return w.letter == letter; });
    return at == words_.end() ? nullptr : &*at;
  }
  /// The first word of a group of codes.
  const Word* of_group(std::string_view group) const {
    const auto at =
        std::find_if(words_.begin(), words_.end(), [&](const Word& w) { return w.group == group; });
    return at == words_.end() ? nullptr : &*at;
  }
  const Word* first_move() const {
    const auto at = std::find_if(words_.begin(), words_.end(), [](const Word& w) {
      return kMoves.find(w.letter) != std::string_view::npos;
    });
    return at == words_.end() ? nullptr : &*at;
  }

 private:
  [[noreturn]] void fail(std::string_view found, std::string_view expected) const {
    lines_.fail(row_, fmt::format("found {}, expected {}", in_quotes(found), expected));
  }

  void split(std::string_view text) {
    for (std::size_t i = 0; i < text.size();) {
      const unsigned char c = static_cast<unsigned char>(text[i]);
      if (c == ';') return;
      if (std::isspace(c) != 0) {
        ++i;
      } else if (c == '(') {
        const auto close = text.find(')', i);
        if (close == std::string_view::npos) lines_.fail(row_, "found a comment without its end, expected )");
        i = close + 1;
      } else if (c == '/') {
        fail("/", "a path that doesn't hang on a switch of the machine");
      } else if (std::isalpha(c) != 0) {
        i = take_word(text, i);
      } else {
        fail(trimmed(text.substr(i)), "a word such as X12.5; expressions and parameters are not read");
      }
    }
  }

  /// Takes the word at `start`; where what is behind it begins.
  std::size_t take_word(std::string_view text, std::size_t start) {
    constexpr std::string_view kOfNumbers = "0123456789+-.";
    const char letter = static_cast<char>(std::toupper(static_cast<unsigned char>(text[start])));
    const std::size_t first = std::min(text.find_first_not_of(" \t", start + 1), text.size());
    const std::size_t end = std::min(text.find_first_not_of(kOfNumbers, first), text.size());
    const bool goes_on =
        end < text.size() && std::string_view("[#<,=*").find(text[end]) != std::string_view::npos;
    if (end == first || goes_on)
      fail(trimmed(text.substr(start, text.find_first_of(";(", start) - start)),
           fmt::format("a number behind {}; expressions and parameters are not read", letter));
    words_.push_back({letter,
                      lines_.number(row_, text.substr(first, end - first)),
                      text.substr(start, end - start),
                      {},
                      {}});
    return end;
  }

  void name_code(Word& word) const {
    if (word.letter != 'G' && word.letter != 'M') return;
    const double tenths = word.value * 10.0;
    if (tenths >= 0.0 && tenths < 10'000.0 && std::abs(tenths - std::round(tenths)) < 1e-6)
      word.code = fmt::format("{}{:g}", word.letter, std::round(tenths) / 10.0);
    const auto* known = std::find_if(kKnownCodes.begin(), kKnownCodes.end(),
                                     [&](const KnownCode& k) { return k.name == word.code; });
    if (known != kKnownCodes.end()) {
      word.group = known->group;
      return;
    }
    fail(word.text,
         word.letter == 'G'
             ? "G0, G1 or a G word that moves nothing; write the path as straight moves in one frame"
             : "M0 to M9, M30, M48 to M53 or M62 to M68; write the path without subprograms and "
               "words of one machine");
  }

  /// Of two words for the same, either could be meant.
  void check_repeats() const {
    for (auto word = words_.begin(); word != words_.end(); ++word) {
      const auto before = std::find_if(words_.begin(), word, [&](const Word& w) {
        return w.letter == word->letter && w.group == word->group;
      });
      if (before != word)
        lines_.fail(row_, fmt::format("found {} behind {}, expected one of them in a row",
                                      in_quotes(word->text), in_quotes(before->text)));
    }
  }

  void check_letter(const Word& word) const {
    if (kMoves.find(word.letter) != std::string_view::npos ||
        kAnywhere.find(word.letter) != std::string_view::npos)
      return;
    if (kTurns.find(word.letter) != std::string_view::npos) {
      if (word.value != 0.0)
        fail(word.text, "a path in the workpiece's frame; give tool axes by .apt or .csv");
      return;
    }
    if (word.letter == 'O') {
      if (words_.size() > 1) fail(word.text, "the program's number alone in its row");
      return;
    }
    const auto* companion = std::find_if(kCompanions.begin(), kCompanions.end(),
                                         [&](const Companion& c) { return c.letter == word.letter; });
    if (companion == kCompanions.end())
      fail(word.text, fmt::format("a move by X, Y and Z; write the path without {}", word.letter));
    if (std::none_of(companion->of.begin(), companion->of.end(),
                     [&](std::string_view code) { return has(code); }))
      fail(word.text, fmt::format("it with {} only", any_of_codes(companion->of)));
  }

  const PathLines& lines_;
  std::size_t row_;
  std::vector<Word> words_;
};

class GcodeReader {
 public:
  GcodeReader(std::string_view file, std::optional<double> unit_mm, bool switched)
      : lines_(file), unit_(lines_, unit_mm), switched_(switched) {}

  std::vector<ClLine> read(std::string_view content) {
    for_lines(content, [&](const Line& line) {
      row_ = line.number;
      const std::string_view text = trimmed(line.text);
      if (text.starts_with('%'))
        read_percent(text);
      else
        read_block(Block(lines_, row_, text));
    });
    if (end_row_ == 0) lines_.fail_cut_off("M2, M30 or %, expected one of them");
    lines_.end_line(switched_);
    return lines_.take();
  }

 private:
  /// The first % begins the program, a later one ends it.
  void read_percent(std::string_view text) {
    if (text != "%") lines_.fail(row_, fmt::format("found {}, expected % alone", in_quotes(text)));
    if ((began_ || percent_) && end_row_ == 0) end_with("%");
    percent_ = true;
  }

  void read_block(const Block& block) {
    if (block.words().empty()) return;
    const Word& first = block.words().front();
    if (end_row_ != 0)
      lines_.fail(row_, fmt::format("found {} behind {} in row {}, expected nothing behind the program's end",
                                    in_quotes(first.text), end_, end_row_));
    if (first.letter == 'O' && began_)
      lines_.fail(row_,
                  fmt::format("found {} behind other words, expected the program's number at its beginning",
                              in_quotes(first.text)));
    began_ = true;
    take_modes(block);
    take_frame(block);
    switch_pressure(block);
    if (block.has("G28") || block.has("G30"))
      go_home(block);
    else if (block.has("G53"))
      go_in_machine(block);
    else if (block.has("G4"))
      check_dwell(block);
    else if (!block.has("G43.1"))  // its numbers are an offset
      go(block);
    for (const std::string_view end : {"M2", "M30"})
      if (block.has(end)) end_with(end);
  }

  void end_with(std::string_view what) {
    end_ = what;
    end_row_ = row_;
  }

  void take_modes(const Block& block) {
    take_motion(block);
    if (const Word* unit = block.of_group("unit")) unit_.say(unit->code == "G20" ? 25.4 : 1.0, row_);
    if (const Word* distance = block.of_group("distance")) absolute_ = distance->code == "G90";
  }

  /// G80 ends a cycle and with it all moves, unless the row says a move itself, as posts begin a program.
  void take_motion(const Block& block) {
    const Word *motion = block.of_group("motion"), *end = block.of_group("cycle"), *way = block.first_move();
    if (motion != nullptr && end != nullptr && way != nullptr)
      lines_.fail(row_, fmt::format("found {} with {} and {}, expected a row of its own for the move",
                                    in_quotes(way->text), in_quotes(motion->text), in_quotes(end->text)));
    if (motion != nullptr)
      motion_ = motion->code;
    else if (end != nullptr)
      motion_ = end->code;
  }

  /// Whichever workpiece's frame the path is in, it stays there. Ways in the machine's frame may come before.
  void take_frame(const Block& block) {
    const Word* frame = block.of_group("frame");
    if (frame == nullptr || frame->code == frame_) return;
    if (!frame_.empty())
      lines_.fail(row_, fmt::format("found {} behind '{}', expected one workpiece's frame in the path",
                                    in_quotes(frame->text), frame_));
    if (moved_)
      lines_.fail(row_, fmt::format("found {} behind a move, expected one workpiece's frame in the path",
                                    in_quotes(frame->text)));
    frame_ = frame->code;
  }

  /// A move within the workpiece's frame.
  void go(const Block& block) {
    const Word* first = block.first_move();
    if (first == nullptr) return;
    if (motion_ != "G0" && motion_ != "G1")
      lines_.fail(
          row_, fmt::format("found {} before G0 or G1, expected one of them first", in_quotes(first->text)));
    const double unit_mm = unit_.mm(row_, "found a move before G20 or G21, expected one of them first");
    Eigen::Vector3d to_mm = at_mm_;
    for (const char letter : kMoves)
      if (const Word* word = block.find(letter)) {
        const auto axis = kMoves.find(letter);
        double& at = to_mm[static_cast<Eigen::Index>(axis)];
        at = (absolute_ ? 0.0 : at) + word->value * unit_mm;
        known_[axis] = known_[axis] || absolute_;
      }
    move(to_mm);
  }

  /// A way in the machine's frame: where it ends, the workpiece's frame doesn't know.
  void go_in_machine(const Block& block) {
    if (motion_ != "G0")
      lines_.fail(row_, fmt::format("found 'G53' with {}, expected G0: a line lies in the workpiece's frame",
                                    motion_.empty() ? "no G0" : motion_));
    leave("G53");
    for (std::size_t axis = 0; axis < known_.size(); ++axis)
      if (block.find(kMoves[axis]) != nullptr) known_[axis] = false;
  }

  void go_home(const Block& block) {
    leave(block.has("G28") ? "G28" : "G30");
    known_ = {};
  }

  void leave(std::string_view code) {
    if (pressure_)
      lines_.fail(row_,
                  fmt::format("found '{}' under pressure, expected a move in the workpiece's frame", code));
    lines_.end_line(switched_);
  }

  /// Seconds stand behind P, or as some controls have it behind X.
  void check_dwell(const Block& block) const {
    for (const char letter : kMoves)
      if (const Word* word = block.find(letter);
          word != nullptr && (letter != 'X' || block.find('P') != nullptr))
        lines_.fail(row_, fmt::format("found {} with G4, expected its seconds alone, such as G4 P0.5",
                                      in_quotes(word->text)));
  }

  /// A point of a line; on a way that begins where no word said, it could lie anywhere.
  void add(const Eigen::Vector3d& at_mm) {
    for (std::size_t axis = 0; axis < known_.size(); ++axis)
      if (!known_[axis])
        lines_.fail(row_, fmt::format("found a line that begins before any {0}, expected X, Y and Z of its "
                                      "beginning, such as {0}5",
                                      kMoves[axis]));
    lines_.add(at_mm, Eigen::Vector3d::UnitZ(), row_);
  }

  void switch_pressure(const Block& block) {
    const Word* output = block.of_group("output");
    if (output == nullptr) return;
    const Word* number = block.find('P');
    if (number == nullptr)
      lines_.fail(row_, fmt::format("found {0} without P, expected the output, such as {1} P0",
                                    in_quotes(output->text), output->code));
    if (switched_by_ && *switched_by_ != number->value)
      lines_.fail(row_,
                  fmt::format("found {} with {} behind P{:g}, expected one output that switches pressure",
                              in_quotes(number->text), output->code, *switched_by_));
    switched_by_ = number->value;
    const bool on = output->code == "M62" || output->code == "M64";
    if (on == pressure_) return;
    pressure_ = on;
    if (on)
      add(at_mm_);
    else
      lines_.end_line(true);
  }

  void move(const Eigen::Vector3d& to_mm) {
    moved_ = true;
    const bool rapid = motion_ == "G0";
    if (switched_) {
      if (pressure_) add(to_mm);
    } else {
      if (rapid) lines_.end_line(false);
      // Rapid moves, one axis after the other, may lead to where a line begins.
      if (!rapid || all_known()) add(to_mm);
    }
    at_mm_ = to_mm;
  }

  bool all_known() const { return known_ == std::array{true, true, true}; }

  PathLines lines_;
  PathUnit unit_;
  bool switched_;
  bool pressure_ = false, absolute_ = true;
  bool percent_ = false, began_ = false, moved_ = false;
  std::string motion_;  ///< "G0", "G1", "G80"; none said yet: empty
  std::string frame_;   ///< "G54"; none said: empty
  std::optional<double> switched_by_;
  std::array<bool, 3> known_{};  ///< X, Y, Z that a word said
  Eigen::Vector3d at_mm_ = Eigen::Vector3d::Zero();
  std::string end_;  ///< what ended the program, and where
  std::size_t row_ = 0, end_row_ = 0;
};

/// Whether the program itself switches pressure, as far as it can be read.
bool switches_pressure(std::string_view file, std::string_view content) {
  const PathLines lines(file);
  bool found = false;
  try {
    for_lines(content, [&](const Line& line) {
      if (found || trimmed(line.text).starts_with('%')) return;
      const Block block(lines, line.number, line.text);
      found = block.has("M62") || block.has("M64");
    });
  } catch (const CoordinateError&) {
    // Reading it tells where and why.
  }
  return found;
}

}  // namespace

std::vector<ClLine> read_gcode_path(std::string_view file, std::string_view content,
                                    std::optional<double> unit_mm) {
  return GcodeReader(file, unit_mm, switches_pressure(file, content)).read(content);
}

}  // namespace meltstage::motion::detail
