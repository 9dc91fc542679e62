// SPDX-License-Identifier: Apache-2.0
// Hole positions out of an Excellon drill file (format 1 and 2; IPC-NC-349): one bump at every drilled hole.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "base/count.hpp"
#include "base/file.hpp"
#include "base/number.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

constexpr std::string_view kBlanks = " \t\f\v";
constexpr std::string_view kSingleHoles =
    "single holes; patterns, circles and text to be drilled aren't read: export them as holes";

// What a header says of the machine and of its tools; none of it moves a hole.
constexpr std::array<std::string_view, 36> kMachineSettings = {
    "AFS", "ATC",   "BLKD",   "CCW",      "CP",    "DETECT", "DN",  "DTMDIST", "EXDA", "FSB", "HPCK", "NCSL",
    "OM",  "OSTOP", "OTCLMP", "PCKPARAM", "PF",    "PPR",    "PVS", "R",       "RC",   "RCP", "RCR",  "RD",
    "RH",  "SBK",   "SG",     "SIXM",     "TCCMP", "TCST",   "UP",  "VER",     "Z",    "ZA",  "ZC",   "ZS"};

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }
bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }

std::string in_capitals(std::string_view text) {
  std::string capitals(text);
  for (char& c : capitals) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return capitals;
}

class ExcellonFile {
 public:
  explicit ExcellonFile(const std::filesystem::path& path) : path_(path) { result_.has_unit = true; }

  void add(const Line& line) {
    row_ = line.number;
    raw_ = line.text;
    capitals_ = in_capitals(line.text);
    at_ = 0;
    end_ = std::min(capitals_.find_last_not_of(kBlanks) + 1, capitals_.size());
    skip_blanks();
    if (at_ == end_) return;
    if (rest().starts_with(';')) return read_comment();
    if (!is_message()) cut_comment();
    if (ended_row_ != 0) return read_behind_end();
    if (rest().size() > 1 && rest()[0] == 'N' && is_digit(rest()[1])) take_word();
    skip_blanks();
    if (at_ != end_) read_row();
  }

  RawPoints finish() && {
    if (ended_row_ == 0) fail(path_, "the file ends without M30, expected it; the file may be cut off");
    if (unplated_row_ != 0)
      result_.notes.push_back(
          fmt::format("row {} says that holes are not plated; they make bumps all the same", unplated_row_));
    if (slots_ > 0) result_.notes.push_back(no_bump_note(slots_, "slot", first_slot_));
    if (routed_ > 0) result_.notes.push_back(no_bump_note(routed_, "routing move", first_routed_));
    return std::move(result_);
  }

 private:
  /// A letter and the number behind it.
  struct Word {
    std::size_t at = 0, end = 0;
    char letter = '\0';
    std::string_view number;
  };

  /// Of one row: what it says of X and Y, in millimetres.
  struct Place {
    std::optional<double> x_mm, y_mm;
  };

  enum class Zeros { unknown, leading_kept, trailing_kept, all_kept };

  struct Digits {
    int whole = 0, decimals = 0;
  };

  struct StatedUnit {
    std::size_t row = 0;
    std::string name;
  };

  // ---- the text of a row ----

  std::string_view rest() const { return std::string_view(capitals_).substr(at_, end_ - at_); }

  void skip_blanks() {
    while (at_ < end_ && kBlanks.find(capitals_[at_]) != std::string_view::npos) ++at_;
  }

  void cut_comment() {
    end_ = std::min(end_, capitals_.find(';', at_));
    while (end_ > at_ && kBlanks.find(capitals_[end_ - 1]) != std::string_view::npos) --end_;
  }

  /// An operator's message may hold anything.
  bool is_message() const { return rest().starts_with("M47") || rest().starts_with("M45"); }

  Word take_word() {
    Word word{at_, at_, capitals_[at_], {}};
    ++at_;
    skip_blanks();
    const std::size_t end = std::min(capitals_.find_first_not_of("+-.0123456789", at_), end_);
    word.number = std::string_view(capitals_).substr(at_, end - at_);
    word.end = at_ = end;
    return word;
  }

  /// The whole number of a command.
  int code_of(const Word& word) const {
    constexpr int kMost = 99'999;
    return number_in(word.number, 0, kMost).value_or(-1);
  }

  [[noreturn]] void fail_at(std::size_t from, std::size_t to, std::string_view expected) const {
    fail(path_, fmt::format("row {}, column {}: found {}, expected {}", row_, from + 1,
                            in_quotes(raw_.substr(from, to - from)), expected));
  }
  [[noreturn]] void fail_from(std::size_t from, std::string_view expected) const {
    fail_at(from, end_, expected);
  }
  [[noreturn]] void fail_unknown(std::size_t from) const {
    if (in_header_) fail_from(from, "a command of an Excellon header; the body begins behind % or M95");
    fail_from(from,
              "a command that drills single holes and that this reader knows; export the file without it");
  }

  void expect_end() {
    skip_blanks();
    if (at_ != end_) fail_from(at_, "the end of the row");
  }

  // ---- rows ----

  /// ";FILE_FORMAT=4:4" of some systems says where the decimal point is left out, and so does KiCad's
  /// "; FORMAT={3:3/ absolute / metric / suppress leading zeros}".
  void read_comment() {
    constexpr std::string_view kPlain = "FILE_FORMAT=", kKicad = "FORMAT={";
    const std::string_view text = trimmed(rest().substr(1));
    const bool unplated = text.find("FILEFUNCTION,NONPLATED") != std::string_view::npos ||
                          text.find("APERFUNCTION,NONPLATED") != std::string_view::npos ||
                          text.find("TYPE=NON_PLATED") != std::string_view::npos;
    if (unplated && unplated_row_ == 0) unplated_row_ = row_;
    if (const auto at = text.find(kPlain); at != std::string_view::npos)
      read_digits(text.substr(at + kPlain.size()));
    else if (text.starts_with(kKicad))
      read_kicad_format(text.substr(kKicad.size()));
  }

  static bool says_digits(std::string_view text) {
    return text.size() == 3 && is_digit(text[0]) && text[1] == ':' && is_digit(text[2]);
  }

  void read_digits(std::string_view format) {
    const bool ends = format.size() <= 3 || kBlanks.find(format[3]) != std::string_view::npos;
    if (!ends || !says_digits(format.substr(0, 3))) fail_from(at_, "digits such as FILE_FORMAT=4:4");
    state_digits({format[0] - '0', format[2] - '0'}, at_, end_);
  }

  /// Each part of it is known, or it may say what this reader would not do.
  void read_kicad_format(std::string_view format) {
    const std::size_t begin = static_cast<std::size_t>(format.data() - capitals_.data());
    const std::size_t behind = std::min(capitals_.find('}', begin), end_);
    const auto says = [&](std::string_view words) { return format.find(words) != std::string_view::npos; };
    for (std::size_t at = begin; at < behind;) {
      const std::size_t end = std::min(capitals_.find('/', at), behind);
      const std::string_view part = trimmed(std::string_view(capitals_).substr(at, end - at));
      if (!part.empty()) at_ = static_cast<std::size_t>(part.data() - capitals_.data());
      // "Decimal" numbers have their points; digits beside it mean nothing.
      if (at == begin && says_digits(part)) {
        if (!says("DECIMAL")) state_digits({part[0] - '0', part[2] - '0'}, at_, at_ + part.size());
      } else if (part == "METRIC") {
        state_unit(at_, 1.0, "metric");
      } else if (part == "INCH") {
        state_unit(at_, kInch_mm, "inch");
      } else if (part == "SUPPRESS LEADING ZEROS") {
        state_zeros(Zeros::trailing_kept, at_ + part.size());
      } else if (part == "SUPPRESS TRAILING ZEROS") {
        state_zeros(Zeros::leading_kept, at_ + part.size());
      } else if (part == "KEEP ZEROS") {
        if (stated_) state_zeros(Zeros::all_kept, at_ + part.size());
      } else if (part != "ABSOLUTE" && part != "DECIMAL" && !(at == begin && part == "-:-")) {
        fail_at(at_, at_ + part.size(),
                "digits such as 3:3, absolute, metric, inch, decimal, or the zeros that are kept");
      }
      at = end + 1;
    }
  }

  /// M00 also stops for another tool in some files, whose holes then go on: they would be lost.
  void read_behind_end() {
    constexpr std::string_view kEndOfDosFile = "\x1A";
    if (rest() == "M30" || rest() == "%" || rest() == kEndOfDosFile || at_ == end_) return;
    fail_from(at_, fmt::format("nothing behind the end of the program in row {}", ended_row_));
  }

  void read_row() {
    if (rest() == "%") {
      in_header_ = false;
      return;
    }
    const std::size_t letters =
        static_cast<std::size_t>(std::find_if_not(rest().begin(), rest().end(), is_letter) - rest().begin());
    if (letters > 1 || (letters == 1 && rest().substr(1).starts_with(',')))
      read_setting(rest().substr(0, letters));
    else if (rest()[0] == 'M')
      read_miscellaneous();
    else
      read_motion();
  }

  void read_setting(std::string_view name) {
    if (name == "INCH" || name == "METRIC") return read_unit(name == "INCH" ? kInch_mm : 1.0, name.size());
    if (name == "ICI") {
      if (rest() != "ICI" && rest() != "ICI,ON" && rest() != "ICI,OFF") fail_from(at_, "ICI,ON or ICI,OFF");
      incremental_ = rest() != "ICI,OFF";
    } else if (name == "FMAT") {
      if (rest() != "FMAT,1" && rest() != "FMAT,2") fail_from(at_, "FMAT,1 or FMAT,2");
    } else if (std::find(kMachineSettings.begin(), kMachineSettings.end(), name) == kMachineSettings.end()) {
      fail_unknown(at_);
    }
  }

  /// Two units in one file would make the scale a guess.
  void state_unit(std::size_t from, double unit_mm, std::string_view name) {
    if (stated_unit_.row != 0 && unit_mm != unit_mm_)
      fail_from(from, fmt::format("one unit; row {} has {}", stated_unit_.row, stated_unit_.name));
    unit_mm_ = unit_mm;
    stated_unit_ = {row_, std::string(name)};
  }

  /// Where all zeros are kept, the leading ones and the trailing ones are.
  void state_zeros(Zeros zeros, std::size_t end) {
    if (zeros_ == Zeros::all_kept) return;
    if (zeros_ != Zeros::unknown && zeros_ != zeros && zeros != Zeros::all_kept)
      fail_at(at_, end,
              fmt::format("{}, as row {} has",
                          zeros_ == Zeros::leading_kept ? "LZ (suppress trailing zeros)"
                                                        : "TZ (suppress leading zeros)",
                          zeros_row_));
    zeros_ = zeros;
    zeros_row_ = row_;
  }

  void state_digits(const Digits& digits, std::size_t from, std::size_t end) {
    if (stated_ && (stated_->whole != digits.whole || stated_->decimals != digits.decimals))
      fail_at(from, end,
              fmt::format("{} before the point and {} behind it, as row {} has",
                          counted(static_cast<std::size_t>(stated_->whole), "digit"), stated_->decimals,
                          digits_row_));
    stated_ = digits;
    digits_row_ = row_;
  }

  /// "METRIC,LZ,0000.00": which zeros are kept, and how many digits there are.
  void read_unit(double unit_mm, std::size_t name) {
    state_unit(at_, unit_mm, rest().substr(0, name));
    at_ += name;
    while (at_ < end_) {
      if (capitals_[at_] != ',') fail_from(at_, "a comma");
      ++at_;
      skip_blanks();
      const std::size_t end = std::min(capitals_.find_first_of(", ", at_), end_);
      read_unit_part(end);
      at_ = end;
      skip_blanks();
    }
  }

  void read_unit_part(std::size_t end) {
    const std::string_view part = std::string_view(capitals_).substr(at_, end - at_);
    const auto point = part.find('.');
    constexpr std::size_t kMostDigits = 9;
    if (part == "LZ") {
      state_zeros(Zeros::leading_kept, end);
    } else if (part == "TZ") {
      state_zeros(Zeros::trailing_kept, end);
    } else if (part.find_first_not_of("0.") == std::string_view::npos && point != std::string_view::npos &&
               point > 0 && part.rfind('.') == point && part.size() <= kMostDigits) {
      state_digits({static_cast<int>(point), static_cast<int>(part.size() - point - 1)}, at_, end);
    } else {
      fail_at(at_, end, "LZ, TZ or digits such as 000.000");
    }
  }

  void read_miscellaneous() {
    const bool message = is_message();
    const Word word = take_word();
    if (message) return;
    switch (code_of(word)) {
      case 48:
        in_header_ = true;
        break;
      case 95:
        in_header_ = false;
        break;
      case 0:
      case 30:
        read_place();  // where the table goes
        ended_row_ = row_;
        break;
      case 71:
        state_unit(word.at, 1.0, "M71");
        break;
      case 72:
        state_unit(word.at, kInch_mm, "M72");
        break;
      case 6:  // stops of the machine, and the depth of its tool
      case 9:
      case 14:
      case 15:
      case 16:
      case 17:
      case 18:
        break;
      case 1:
      case 2:
      case 8:
      case 25:
      case 97:
      case 98:
      case 99:
        fail_from(word.at, kSingleHoles);
      case 60:
      case 70:
      case 80:
      case 90:
        fail_from(word.at,
                  "holes where they are to be; export them neither scaled, mirrored nor with swapped axes");
      default:
        fail_unknown(word.at);
    }
    expect_end();
  }

  /// Preparatory commands and a tool, then what is done there.
  void read_motion() {
    for (; at_ < end_; skip_blanks()) {
      switch (capitals_[at_]) {
        case 'G':
          read_general();
          break;
        case 'T':
          read_tool();
          break;
        case 'R':
          return repeat();
        case 'X':
        case 'Y':
          return drill();
        default:
          if (!is_feed(capitals_[at_])) fail_unknown(at_);
          take_word();
      }
    }
  }

  /// Feed, speed, strokes, and depth.
  static bool is_feed(char letter) {
    return std::string_view("FSBHZ").find(letter) != std::string_view::npos;
  }

  void read_general() {
    const Word word = take_word();
    switch (code_of(word)) {
      case 90:
        incremental_ = false;
        break;
      case 91:
        incremental_ = true;
        break;
      case 5:
      case 81:
        routing_ = false;
        break;
      case 0:
      case 1:
      case 2:
      case 3:
        routing_ = true;
        break;
      case 7:  // feed, and the side of the tool that routes
      case 40:
      case 41:
      case 42:
        break;
      case 4:  // waits for X seconds
        skip_blanks();
        if (rest().starts_with('X')) take_word();
        expect_end();
        break;
      case 85:
        slot(word.at);
        break;
      case 92:
      case 93:
        set_zero(word.at);
        break;
      case 32:
      case 33:
      case 82:
      case 83:
      case 84:
      case 87:
        fail_from(word.at, kSingleHoles);
      default:
        fail_unknown(word.at);
    }
  }

  void set_zero(std::size_t from) {
    const Place place = read_place();
    expect_end();
    if (place.x_mm.value_or(0.0) != 0.0 || place.y_mm.value_or(0.0) != 0.0 || x_mm_ != 0.0 || y_mm_ != 0.0)
      fail_from(from, "one zero for the whole file: G92 or G93 with X0Y0 before the first hole");
  }

  /// "T1C0.5F200S65" defines a tool; "T1" in the body takes it.
  void read_tool() {
    const Word word = take_word();
    const int number = code_of(word);
    if (number < 0) fail_at(word.at, word.end, "the number of a tool");
    bool defines = in_header_;
    const std::string_view letters = in_header_ ? "CFSBHZIR" : "CFSBHZI";
    for (skip_blanks(); at_ < end_ && letters.find(capitals_[at_]) != std::string_view::npos; skip_blanks())
      defines = take_word().letter == 'C' || defines;
    if (defines) tools_.insert(number);
    if (in_header_) return;
    // Tool 0 is the empty spindle at the end, unless it is defined.
    if (number != 0 && !tools_.contains(number)) fail_at(word.at, word.end, "a tool that the header defines");
    has_tool_ = tools_.contains(number);
    tool_ = number;
  }

  void count_routed() {
    if (routed_++ == 0) first_routed_ = row_;
  }

  void drill() {
    const std::size_t from = at_;
    if (in_header_) fail_unknown(from);
    move(read_place());
    skip_blanks();
    if (at_ < end_ && capitals_[at_] == 'G') return read_behind_place();
    expect_end();
    follows_hole_ = !routing_;
    if (routing_) return count_routed();
    if (!has_tool_) fail_from(from, "a tool (T1) before the first hole");
    add_hole();
  }

  /// "X1Y1G85X2Y2": a slot from here to there. "X1Y1G84X3": a circle around here.
  void read_behind_place() {
    const std::size_t from = at_;
    const Word word = take_word();
    const int code = code_of(word);
    if (code == 85) return slot(from);
    if (code >= 82 && code <= 87) fail_from(from, kSingleHoles);
    fail_from(from, "the end of the row");
  }

  void slot(std::size_t from) {
    if (in_header_) fail_unknown(from);
    const Place place = read_place();
    if (!place.x_mm && !place.y_mm) fail_from(from, "the end of the slot (G85X2.0Y1.0)");
    expect_end();
    move(place);
    follows_hole_ = false;
    if (slots_++ == 0) first_slot_ = row_;
  }

  void add_hole() {
    const auto tool = static_cast<std::uint32_t>(tool_);
    result_.points.push_back({x_mm_, y_mm_, row_, std::nullopt, tool});
    result_.groups.try_emplace(tool, fmt::format("T{}", tool_));
    check_point_count(path_, result_.points.size());
  }

  /// "R4X2.54": four more holes, each that far from the one before.
  void repeat() {
    const std::size_t from = at_;
    const Word word = take_word();
    if (word.number.empty() || !std::all_of(word.number.begin(), word.number.end(), is_digit) ||
        !follows_hole_)
      fail_from(from, "a repetition such as R4X2.54 behind a hole");
    const Place step = read_place();
    if (at_ != end_) fail_from(at_, "X or Y, and the end of the row");
    // A number that is too large for its type is one hole too many as well.
    const std::size_t count = number_in<std::size_t>(word.number, 0, kMaxPoints).value_or(kMaxPoints + 1);
    if (count == 0 || (!step.x_mm && !step.y_mm))
      fail_from(from, "a repetition such as R4X2.54 behind a hole");
    for (std::size_t hole = 0; hole < count; ++hole) {
      x_mm_ += step.x_mm.value_or(0.0);
      y_mm_ += step.y_mm.value_or(0.0);
      add_hole();
    }
  }

  void move(const Place& place) {
    if (place.x_mm) x_mm_ = (incremental_ ? x_mm_ : 0.0) + *place.x_mm;
    if (place.y_mm) y_mm_ = (incremental_ ? y_mm_ : 0.0) + *place.y_mm;
  }

  /// X and Y as far as they go; the arcs of a router, feeds and depths between them are passed over.
  Place read_place() {
    Place place;
    for (skip_blanks(); at_ < end_; skip_blanks()) {
      const char letter = capitals_[at_];
      const bool arc = routing_ && (letter == 'A' || letter == 'I' || letter == 'J');
      if (letter != 'X' && letter != 'Y' && !arc && !is_feed(letter)) break;
      const Word word = take_word();
      if (letter != 'X' && letter != 'Y') continue;
      std::optional<double>& value = letter == 'X' ? place.x_mm : place.y_mm;
      if (value) fail_at(word.at, word.end, fmt::format("{} once", letter));
      value = number_mm(word);
    }
    return place;
  }

  double number_mm(const Word& word) {
    const auto value = parse_number(word.number);
    if (!value) fail_at(word.at, word.end, fmt::format("a number behind {}", word.letter));
    if (*value == 0.0) return 0.0;  // whatever its scale
    if (unit_mm_ == 0.0)
      fail_at(word.at, word.end, "a unit (METRIC, INCH, M71 or M72) before the first coordinate");
    const bool pointed = word.number.find('.') != std::string_view::npos;
    std::size_t& first = pointed ? first_pointed_ : first_plain_;
    if (first == 0) first = row_;
    if (first_pointed_ != 0 && first_plain_ != 0)
      fail_at(word.at, word.end,
              fmt::format("numbers {} decimal point alone, as row {} has", pointed ? "without a" : "with a",
                          pointed ? first_plain_ : first_pointed_));
    if (pointed) return *value * unit_mm_;
    if (zeros_ == Zeros::unknown)
      fail_at(word.at, word.end,
              "decimal points, or LZ or TZ in the header: without them the scale of the numbers is a guess");
    const auto [whole, decimals] = digits();
    const auto shown = static_cast<int>(std::count_if(word.number.begin(), word.number.end(), is_digit));
    if (zeros_ == Zeros::all_kept && shown != whole + decimals)
      fail_at(word.at, word.end,
              fmt::format("{} (format {}.{}, all zeros kept)",
                          counted(static_cast<std::size_t>(whole + decimals), "digit"), whole, decimals));
    if (shown > whole + decimals)
      fail_at(word.at, word.end,
              fmt::format("at most {} digits (format {}.{})", whole + decimals, whole, decimals));
    // Leading zeros kept: the first digits stand for the whole part; else the last ones for the decimals.
    const int places = zeros_ == Zeros::leading_kept ? shown - whole : decimals;
    return *value / std::pow(10.0, places) * unit_mm_;
  }

  /// How many digits stand before the decimal point that is left out, and behind it.
  Digits digits() const {
    if (stated_) return *stated_;
    return unit_mm_ == kInch_mm ? Digits{2, 4} : Digits{3, 3};
  }

  const std::filesystem::path& path_;
  RawPoints result_;

  std::size_t row_ = 0, at_ = 0, end_ = 0;
  std::string_view raw_;
  std::string capitals_;

  bool in_header_ = false, incremental_ = false, routing_ = false, has_tool_ = false;
  std::size_t ended_row_ = 0;
  double unit_mm_ = 0.0;
  std::optional<Digits> stated_;
  StatedUnit stated_unit_;
  Zeros zeros_ = Zeros::unknown;
  std::size_t unplated_row_ = 0;                     // that says so first
  std::size_t first_pointed_ = 0, first_plain_ = 0;  // rows of numbers with a decimal point and without
  std::size_t zeros_row_ = 0, digits_row_ = 0;
  std::set<int> tools_;
  int tool_ = 0;  // in the spindle
  double x_mm_ = 0.0, y_mm_ = 0.0;
  bool follows_hole_ = false;  // what a repetition repeats
  std::size_t slots_ = 0, first_slot_ = 0, routed_ = 0, first_routed_ = 0;
};

}  // namespace

RawPoints read_excellon_points(const std::filesystem::path& path, std::string_view content) {
  if (const auto kind = describe_content(content); kind != "text")
    fail(path, fmt::format("found {}, expected an Excellon drill file", kind));
  ExcellonFile file(path);
  for_lines(without_byte_order_mark(content), [&](const Line& line) { file.add(line); });
  return std::move(file).finish();
}

}  // namespace meltstage::motion::detail
