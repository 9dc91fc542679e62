// SPDX-License-Identifier: Apache-2.0
// Flashes of a Gerber layer (Ucamco, The Gerber Layer Format Specification, 2022.02; RS-274X): one bump at
// the place of every flash, as on a paste layer.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "base/file.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/gerber_macro.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

/// One word command (without its '*'), or all of an extended one, whose blocks end with '*'. `text` has no
/// line ends, `lines` has.
struct Command {
  std::size_t row = 0;
  bool extended = false;
  std::string text;
  std::string_view lines;
};

/// Splits the file into commands; line ends mean nothing.
class Scanner {
 public:
  Scanner(const std::filesystem::path& path, std::string_view content) : path_(path), content_(content) {}

  /// False at the end of the file.
  bool next(Command& command) {
    while (at_ < content_.size() && std::isspace(static_cast<unsigned char>(content_[at_])) != 0) advance();
    if (at_ == content_.size()) return false;
    command = {row_, content_[at_] == '%', {}, {}};
    if (command.extended) advance();
    const char end = command.extended ? '%' : '*';
    const std::size_t from = at_;
    while (at_ < content_.size() && content_[at_] != end) {
      if (content_[at_] == '%') fail_cut(command.row, end);
      if (content_[at_] != '\r' && content_[at_] != '\n') command.text += content_[at_];
      advance();
    }
    if (at_ == content_.size()) fail_cut(command.row, end);
    command.lines = content_.substr(from, at_ - from);
    advance();
    return true;
  }

  /// What stands behind the last command: no part of it has to be one.
  std::string_view rest() const { return content_.substr(at_); }
  std::size_t row() const { return row_; }

 private:
  [[noreturn]] void fail_cut(std::size_t row, char end) const {
    fail(path_, fmt::format(
                    "row {}: the command that begins here has no end, expected '{}'; the file may be cut off",
                    row, end));
  }
  void advance() {
    if (content_[at_++] == '\n') ++row_;
  }

  const std::filesystem::path& path_;
  std::string_view content_;
  std::size_t at_ = 0, row_ = 1;
};

/// What the LM, LR and LS commands do to an aperture that is flashed; to a block, therefore to its flashes.
struct Transform {
  bool mirror_x = false, mirror_y = false;
  double rotation_deg = 0.0, scale = 1.0;

  RawPoint apply(const RawPoint& p) const {
    double x = p.x * scale * (mirror_x ? -1.0 : 1.0), y = p.y * scale * (mirror_y ? -1.0 : 1.0);
    return turned({x, y, p.row}, rotation_deg);
  }
};

class GerberFile {
 public:
  explicit GerberFile(const std::filesystem::path& path) : path_(path), levels_(1) {}

  void run(std::string_view content) {
    Scanner scanner(path_, content);
    for (Command command; ended_row_ == 0 && scanner.next(command);) {
      row_ = command.row;
      if (command.extended)
        run_extended(command.text);
      else if (is_comment(command.text))
        check_comment(command);
      else
        run_word(command.text);
    }
    if (ended_row_ == 0) fail(path_, "the file ends without M02*, expected it; the file may be cut off");
    check_behind_end(scanner.rest(), scanner.row());
    // Old files leave the end of a step and repeat to the end of the file.
    if (levels_.back().kind == Level::Kind::step) close_step();
    if (levels_.size() > 1) fail(path_, "the file ends inside a block, expected %AB*% before M02*");
  }

  RawPoints finish() && {
    RawPoints result;
    result.has_unit = true;
    result.points = std::move(levels_.front().points);
    for (const RawPoint& point : result.points)
      result.groups.try_emplace(point.group, fmt::format("D{}", point.group));
    const auto note = [&](std::size_t count, std::size_t row, std::string_view what) {
      if (count > 0) result.notes.push_back(no_bump_note(count, what, row));
    };
    note(regions_, first_region_, "region");
    note(draws_, first_draw_, "draw");
    marks_.tell(result);
    vias_.tell(result);
    if (odd_ > 0)
      result.notes.push_back(
          fmt::format("{}, {}in row {}, of an aperture with no copper in its middle {} a bump at "
                      "the flash",
                      odd_ == 1 ? "1 flash" : fmt::format("{} flashes", odd_), odd_ == 1 ? "" : "first ",
                      first_odd_, odd_ == 1 ? "holds" : "hold"));
    if (negative_row_ != 0 && (copper_ || has_copper_ending()))
      fail(path_,
           fmt::format("row {}: found a copper layer of negative polarity, expected a positive one, in which "
                       "flashes are copper",
                       negative_row_));
    if (negative_row_ != 0 && !has_function_)
      result.notes.push_back(
          fmt::format("row {} says that the layer is of negative polarity, and no row which "
                      "layer it is; its flashes make bumps all the same",
                      negative_row_));
    if (unprinted_.row != 0)
      result.notes.push_back(fmt::format("row {} says that this is {}; its flashes make bumps all the same",
                                         unprinted_.row, unprinted_.text));
    const std::optional<Side> by_ending = side_by_ending();
    if (side_ && by_ending && *side_ != *by_ending)
      fail(path_, fmt::format("row {}: found a layer of the {}, expected one of the {}, as the ending says",
                              side_row_, name_of(*side_), name_of(*by_ending)));
    if (const auto side = side_ ? side_ : by_ending) lie_on(result.points, *side);
    return result;
  }

 private:
  /// Protel's endings: paste, mask and copper of the top and of the bottom.
  std::optional<Side> side_by_ending() const {
    const std::string ending = in_small_letters(path_.extension().string());
    if (ending == ".gtp" || ending == ".gts" || ending == ".gtl") return Side::top;
    if (ending == ".gbp" || ending == ".gbs" || ending == ".gbl") return Side::bottom;
    return std::nullopt;
  }

  bool has_copper_ending() const {
    const std::string ending = in_small_letters(path_.extension().string());
    return ending == ".gtl" || ending == ".gbl";
  }

  /// Flashes are gathered in the file, in a repeated step or in a block.
  struct Level {
    enum class Kind { file, step, block } kind = Kind::file;
    std::vector<RawPoint> points;
    int aperture = 0;                        ///< that a block defines
    std::array<double, 2> count{}, pitch{};  ///< of a step
  };

  /// Of what a file may say once.
  struct Statement {
    std::size_t row = 0;
    std::string text;
  };

  [[noreturn]] void fail_here(std::string_view found, std::string_view expected) const {
    fail(path_, fmt::format("row {}: found {}, expected {}", row_, in_quotes(found), expected));
  }

  /// "TF.FileFunction,Paste,Bot", or behind "G04 #@! " in files without extended attributes.
  void read_file_attribute(std::string_view text) {
    read_file_function(text);
    read_file_polarity(text);
  }

  /// What the apertures that are defined next are for; in a comment, too.
  void read_aperture_attribute(std::string_view text) {
    if (text.find("TA.AperFunction,") != std::string_view::npos)
      next_is_ = text.find("FiducialPad") != std::string_view::npos ? Purpose::fiducial
                 : text.find("ViaPad") != std::string_view::npos    ? Purpose::via
                                                                    : Purpose::bump;
    else if (text.ends_with("TD.AperFunction") || text.ends_with("TD"))
      next_is_ = Purpose::bump;
  }

  void read_file_function(std::string_view text) {
    constexpr std::string_view kKey = "TF.FileFunction,";
    const auto at = text.find(kKey);
    if (at == std::string_view::npos) return;
    const std::string_view function = text.substr(at + kKey.size());
    has_function_ = true;
    for (const std::string_view copper :
         {"Copper,", "Plane,", "Signal,", "Mixed,"})  // the last three: old files
      if (function.starts_with(copper)) copper_ = true;
    if (function.find(",Inr") != std::string_view::npos) unprinted_ = {row_, "an inner layer"};
    for (const std::string_view drawn :
         {"Component,", "Legend,", "Profile,", "Drillmap", "AssemblyDrawing,", "FabricationDrawing",
          "ArrayDrawing", "OtherDrawing,", "Vcut", "Keepout,", "Keep-out,"})
      if (function.starts_with(drawn))
        unprinted_ = {row_,
                      fmt::format("a layer of the function {}, which holds no pads", in_quotes(function))};
    if (function.starts_with("NonPlated,")) unprinted_ = {row_, "a layer of unplated holes"};
    for (const auto& [word, side] : {std::pair(",Bot", Side::bottom), std::pair(",Top", Side::top)}) {
      if (function.find(word) == std::string_view::npos) continue;
      if (side_ && *side_ != side) fail_here(text, fmt::format("one side; row {} has the other", side_row_));
      side_ = side;
      side_row_ = row_;
    }
  }

  /// "TF.FilePolarity,Negative": of copper the flashes are then what there is none of.
  void read_file_polarity(std::string_view text) {
    if (text.find("TF.FilePolarity,Negative") != std::string_view::npos) negative_row_ = row_;
  }

  // ---- what isn't read ----

  static bool is_comment(std::string_view text) { return text.starts_with("G04") || text.starts_with("G4 "); }

  /// Letters of a command, and the digit or sign behind it.
  static bool looks_like_command(std::string_view line) {
    constexpr std::string_view kLetters = "XYIJDGM", kSigns = "+-";
    return line.size() > 1 && kLetters.find(line[0]) != std::string_view::npos &&
           (std::isdigit(static_cast<unsigned char>(line[1])) != 0 ||
            kSigns.find(line[1]) != std::string_view::npos);
  }

  /// A comment without its '*' would take the next block with it. Some systems write several comments that
  /// end with one '*'.
  void check_comment(const Command& comment) {
    read_file_attribute(comment.text);
    read_aperture_attribute(comment.text);
    for_lines(comment.lines, [&](const Line& line) {
      const std::string_view text = trimmed(line.text);
      if (line.number == 1 || is_comment(text) || !looks_like_command(text)) return;
      fail(path_, fmt::format("row {}: found {} inside a comment, expected the comment's '*' before it",
                              comment.row + line.number - 1, in_quotes(text)));
    });
  }

  /// Ends again, comments and the mark that old systems put at a file's end do no harm.
  void check_behind_end(std::string_view rest, std::size_t row) const {
    for_lines(rest, [&](const Line& line) {
      std::string_view text = trimmed(line.text);
      for (const std::string_view harmless : {"M00*", "M02*", "M30*"})
        if (text.starts_with(harmless)) text.remove_prefix(harmless.size());
      constexpr std::string_view kEndOfDosFile = "\x1A";
      if (text.empty() || text == kEndOfDosFile ||
          !(text.find_first_of("%*") != std::string_view::npos || looks_like_command(text)))
        return;
      if (is_comment(text) && text.find('*') == text.size() - 1) return;
      fail(path_, fmt::format("row {}: found {}, expected nothing behind the end of the file in row {}",
                              row + line.number - 1, in_quotes(text), ended_row_));
    });
  }

  // ---- extended commands ----

  void run_extended(std::string_view text) {
    // A macro holds several blocks; every other command is one, but old files put several between two %.
    if (text.starts_with("AM")) {
      const auto end = text.find('*');
      if (end == std::string_view::npos) fail_here(text, "an aperture macro with its '*'");
      macros_[std::string(text.substr(2, end - 2))] =
          std::make_shared<const std::string>(text.substr(end + 1));
      return;
    }
    while (!text.empty()) {
      const auto end = text.find('*');
      if (end == std::string_view::npos) fail_here(text, "an extended command that ends with '*'");
      run_block(text.substr(0, end));
      text.remove_prefix(end + 1);
    }
  }

  void run_block(std::string_view text) {
    const std::string_view code = text.substr(0, 2),
                           rest = text.size() > 2 ? text.substr(2) : std::string_view{};
    if (code == "FS")
      set_format(text);
    else if (code == "MO")
      set_unit(text);
    else if (code == "AD")
      define_aperture(text);
    else if (code == "AB")
      block(text);
    else if (code == "SR")
      step(text);
    else if (code == "LP")
      polarity(text);
    else if (code == "LM") {
      transform_.mirror_x = rest.find('X') != std::string_view::npos;
      transform_.mirror_y = rest.find('Y') != std::string_view::npos;
    } else if (code == "LR")
      transform_.rotation_deg = plain_number(text, rest);
    else if (code == "LS")
      transform_.scale = plain_number(text, rest);
    else if (code == "IP") {
      if (rest != "POS") fail_here(text, "IPPOS: an image in negative has no flashes to bump");
    } else if (code == "TF") {
      read_file_attribute(text);
    } else if (text.starts_with("TA.AperFunction,") || text == "TD" || text == "TD.AperFunction") {
      read_aperture_attribute(text);
    } else if (code == "MI" || code == "OF" || code == "SF" || code == "IR" || code == "AS") {
      check_neutral(text);
    } else if (text != "ICAS" && code != "TA" && code != "TO" && code != "TD" && code != "IN" &&
               code != "LN") {
      fail_here(text, "a command of the Gerber layer format");
    }
  }

  double plain_number(std::string_view text, std::string_view number) const {
    const auto value = parse_number(number);
    if (!value || !std::isfinite(*value)) fail_here(text, "a number");
    return *value;
  }

  /// A file has one format and one unit: with two of them, one of the two scales would be a guess.
  void state_once(std::string_view what, std::string_view text, Statement& stated) const {
    if (stated.row != 0 && stated.text != text)
      fail_here(text, fmt::format("one {}; row {} has {}", what, stated.row, in_quotes(stated.text)));
    stated = {row_, std::string(text)};
  }

  void set_format(std::string_view text) {
    state_once("format", text, format_);
    const auto x = text.find('X'), y = text.find('Y');
    const bool whole =
        x != std::string_view::npos && y != std::string_view::npos && x + 2 < y && y + 2 < text.size();
    if (!whole || text.substr(x + 1, 2) != text.substr(y + 1, 2) ||
        std::isdigit(static_cast<unsigned char>(text[x + 1])) == 0 ||
        std::isdigit(static_cast<unsigned char>(text[x + 2])) == 0)
      fail_here(text, "a format such as FSLAX46Y46, alike for X and Y");
    trailing_omitted_ = text.substr(2, x - 2).find('T') != std::string_view::npos;
    incremental_ = text.substr(2, x - 2).find('I') != std::string_view::npos;
    whole_ = text[x + 1] - '0';
    decimals_ = text[x + 2] - '0';
  }

  void set_unit(std::string_view text) {
    if (text != "MOMM" && text != "MOIN") fail_here(text, "MOMM or MOIN");
    take_unit(text, text == "MOMM" ? 1.0 : kInch_mm);
  }

  /// MO, or the G70 and G71 of old files.
  void take_unit(std::string_view text, double unit_mm) {
    if (unit_mm != unit_mm_) state_once("unit", text, unit_);
    unit_mm_ = unit_mm;
  }

  /// "ADD10C,0.5": number, then a standard template or a macro by its name.
  void define_aperture(std::string_view text) {
    if (text.size() < 4 || text[2] != 'D') fail_here(text, "an aperture such as ADD10C,0.5");
    std::size_t at = 3;
    const int number = read_code(text, at);
    const auto comma = std::min(text.find(',', at), text.size());
    const std::string name(text.substr(at, comma - at));
    if (number < 10 || name.empty()) fail_here(text, "an aperture such as ADD10C,0.5");
    const auto macro = macros_.find(name);
    if (name != "C" && name != "R" && name != "O" && name != "P" && macro == macros_.end())
      fail_here(name, "C, R, O, P or a macro that is defined before");
    apertures_.insert(number);
    blocks_.erase(number);
    shaped_.erase(number);
    purposes_[number] = next_is_;
    const bool sized = macro != macros_.end() || has_size(name, parameters(text, comma));
    if (sized)
      sizeless_.erase(number);
    else
      sizeless_.insert(number);
    if (macro != macros_.end())
      shaped_[number] = {macro->second, parameters(text, comma), row_, {}};
    else if (const std::string blocks = template_as_macro(name, parameters(text, comma)); !blocks.empty())
      shaped_[number] = {std::make_shared<const std::string>(blocks), {}, row_, {}};
  }

  /// Of a standard template: without a size nothing is drawn at a flash.
  static bool has_size(std::string_view name, const std::vector<double>& n) {
    const std::size_t lengths = name == "R" || name == "O" ? 2 : 1;
    return n.size() >= lengths && std::all_of(n.begin(), n.begin() + static_cast<std::ptrdiff_t>(lengths),
                                              [](double length) { return length > 0.0; });
  }

  /// A standard template whose middle is empty, as that of one with a hole. Empty for all others. A polygon
  /// is the circle around it: its centre is the flash, whatever the number of its corners.
  static std::string template_as_macro(std::string_view name, const std::vector<double>& n) {
    constexpr std::size_t kPolygonHole = 3;
    const std::size_t hole = name == "P" ? kPolygonHole : name == "C" ? 1 : 2;
    const bool has_hole = n.size() > hole && n[hole] > 0.0;
    if (!has_hole) return {};
    const std::string copper = name == "C" || name == "P" ? fmt::format("1,1,{},0,0*", n[0])
                                                          : fmt::format("21,1,{},{},0,0,0*", n[0], n[1]);
    return copper + fmt::format("1,0,{},0,0*", n[hole]);
  }

  /// "ADD10NAME,0.5X0.3"
  std::vector<double> parameters(std::string_view text, std::size_t comma) const {
    std::vector<double> out;
    for (std::size_t at = comma + 1; at < text.size();) {
      const std::size_t end = std::min(text.find('X', at), text.size());
      out.push_back(plain_number(text, text.substr(at, end - at)));
      at = end + 1;
    }
    return out;
  }

  void block(std::string_view text) {
    if (text == "AB") {
      if (levels_.back().kind != Level::Kind::block) fail_here(text, "the end of a block that is open");
      Level level = std::move(levels_.back());
      levels_.pop_back();
      apertures_.insert(level.aperture);
      blocks_[level.aperture] = std::move(level.points);
      return;
    }
    std::size_t at = 3;
    const int number = read_code(text, at);
    constexpr std::size_t kDeepest = 16;
    if (text.size() < 4 || text[2] != 'D' || number < 10) fail_here(text, "a block such as ABD12");
    if (levels_.size() == kDeepest) fail_here(text, "blocks nested less deeply");
    levels_.push_back({Level::Kind::block, {}, number, {}, {}});
  }

  void step(std::string_view text) {
    if (levels_.back().kind == Level::Kind::step) close_step();
    if (text == "SR") return;
    Level level{Level::Kind::step, {}, 0, {1.0, 1.0}, {0.0, 0.0}};
    for (const auto& [letter, value] : {std::pair('X', &level.count[0]), std::pair('Y', &level.count[1]),
                                        std::pair('I', &level.pitch[0]), std::pair('J', &level.pitch[1])}) {
      const auto start = text.find(letter);
      if (start == std::string_view::npos) continue;
      const std::string_view rest = text.substr(start + 1);
      *value = plain_number(text, rest.substr(0, rest.find_first_not_of("+-.0123456789")));
    }
    const auto is_count = [](double n) {
      return n >= 1.0 && n <= static_cast<double>(kMaxPoints) && n == std::floor(n);
    };
    if (!is_count(level.count[0]) || !is_count(level.count[1]))
      fail_here(text, fmt::format("repeats from 1 to {} in X and in Y", kMaxPoints));
    if (level.count[0] == 1.0 && level.count[1] == 1.0) return;
    need_unit(text);
    for (double& pitch : level.pitch) pitch *= unit_mm_;
    levels_.push_back(std::move(level));
  }

  void close_step() {
    const Level level = std::move(levels_.back());
    levels_.pop_back();
    if (level.points.empty()) return;
    for (double column = 0.0; column < level.count[0]; ++column)
      for (double line = 0.0; line < level.count[1]; ++line)
        for (const RawPoint& p : level.points)
          add({p.x + column * level.pitch[0], p.y + line * level.pitch[1], p.row, std::nullopt, p.group});
  }

  void polarity(std::string_view text) {
    if (text != "LPD" && text != "LPC") fail_here(text, "LPD or LPC");
    clear_ = text == "LPC";
  }

  /// Deprecated commands are fine where they do nothing.
  void check_neutral(std::string_view text) const {
    const std::string_view code = text.substr(0, 2);
    bool does_nothing = code == "AS" ? text == "ASAXBY" : true;
    // Every number of it is the one that leaves the image as it is.
    const double neutral = code == "SF" ? 1.0 : 0.0;
    for (std::size_t at = 2; code != "AS" && at < text.size();) {
      at = text.find_first_of("+-.0123456789", at);
      if (at == std::string_view::npos) break;
      const std::size_t end = std::min(text.find_first_not_of("+-.0123456789", at), text.size());
      does_nothing = does_nothing && parse_number(text.substr(at, end - at)) == neutral;
      at = end;
    }
    if (!does_nothing) fail_here(text, "no change of the whole image; export it without");
  }

  // ---- word commands ----

  void run_word(std::string_view text) {
    if (text.empty()) return;
    std::size_t at = 0;
    while (at < text.size() && text[at] == 'G') {
      ++at;
      general(read_code(text, at), text);
    }
    if (at == text.size()) return;
    if (text[at] == 'M') {
      ++at;
      const int code = read_code(text, at);
      if (at != text.size()) fail_here(text, "the block's '*' before " + in_quotes(text.substr(at)));
      if (code == 2 || code == 0 || code == 30)
        ended_row_ = row_;
      else if (code != 1)
        fail_here(text, "M02");
      return;
    }
    operate(text, at);
  }

  int read_code(std::string_view text, std::size_t& at) const {
    int code = -1;
    for (; at < text.size() && std::isdigit(static_cast<unsigned char>(text[at])) != 0; ++at)
      code = std::min(std::max(code, 0) * 10 + (text[at] - '0'), 1'000'000);
    return code;
  }

  void general(int code, std::string_view text) {
    switch (code) {
      case 36:
        in_region_ = true;
        refuse_clear_behind_flashes(text);
        if (regions_++ == 0) first_region_ = row_;
        return;
      case 37:
        in_region_ = false;
        return;
      case 70:
        take_unit("G70", kInch_mm);
        return;
      case 71:
        take_unit("G71", 1.0);
        return;
      case 90:
        incremental_ = false;
        return;
      case 91:
        incremental_ = true;
        return;
      case 0:
      case 1:
      case 2:
      case 3:
      case 10:
      case 11:
      case 12:
      case 54:
      case 55:
      case 74:
      case 75:
        return;
      default:
        fail_here(text, "a G code of the Gerber layer format");
    }
  }

  /// Coordinates and what to do there, or the choice of an aperture.
  void operate(std::string_view text, std::size_t at) {
    bool moved = false;
    int code = -1;
    std::string letters;
    while (at < text.size()) {
      // A D code ends a block: behind it the next one begins, whose flash would be lost.
      if (code >= 0) fail_here(text, "the block's '*' before " + in_quotes(text.substr(at)));
      const char letter = text[at++];
      if (letters.find(letter) != std::string::npos)
        fail_here(text, fmt::format("{} once in a block", letter));
      letters += letter;
      if (letter == 'D') {
        code = read_code(text, at);
        if (code < 1) fail_here(text, "D01, D02, D03 or an aperture");
        continue;
      }
      if (letter != 'X' && letter != 'Y' && letter != 'I' && letter != 'J')
        fail_here(text, "a coordinate, a D code or a G code");
      const auto end = std::min(text.find_first_not_of("+-0123456789", at), text.size());
      const double value = coordinate(text, text.substr(at, end - at));
      at = end;
      if (letter == 'X') x_ = incremental_ ? x_ + value : value;
      if (letter == 'Y') y_ = incremental_ ? y_ + value : value;
      moved = moved || letter == 'X' || letter == 'Y';
    }
    if (code >= 10) {
      if (!apertures_.contains(code)) fail_here(text, "an aperture that is defined before (%ADD...)");
      aperture_ = code;
      return;
    }
    if (code > 3) fail_here(text, "D01, D02, D03 or an aperture from D10 on");
    if (code > 0) operation_ = code;
    if (code < 0 && !moved) fail_here(text, "a coordinate, a D code or a G code");
    if (operation_ == 3) flash(text);
    if (operation_ != 1 || in_region_) return;
    refuse_clear_behind_flashes(text);
    if (draws_++ == 0) first_draw_ = row_;
  }

  double coordinate(std::string_view text, std::string_view digits) const {
    if (format_.row == 0) fail_here(text, "a format (%FSLAX46Y46*%) before the first coordinate");
    const auto value = parse_number(digits);
    if (!value) fail_here(text, "a coordinate of digits alone");
    need_unit(text);
    const auto shown = static_cast<int>(
        std::count_if(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c) != 0; }));
    if (shown > whole_ + decimals_ + 1)
      fail_here(text,
                fmt::format("coordinates of at most {} digits, as the format says", whole_ + decimals_));
    // Divided rather than multiplied by a negative power: 100000 of format 4.6 are 0.1 exactly.
    const int places = trailing_omitted_ ? shown - whole_ : decimals_;
    return *value / std::pow(10.0, places) * unit_mm_;
  }

  void need_unit(std::string_view text) const {
    if (unit_mm_ == 0.0) fail_here(text, "a unit (%MOMM*% or %MOIN*%) before the first length");
  }

  /// What is cleared later may be the copper of a bump.
  void refuse_clear_behind_flashes(std::string_view text) const {
    if (clear_ && added_ > 0)
      fail_here(text,
                "regions and draws of clear polarity (LPC) before the first flash; behind one they may "
                "take it away");
  }

  void flash(std::string_view text) {
    if (aperture_ == 0) fail_here(text, "an aperture (D10 or higher) before the first flash");
    if (in_region_) fail_here(text, "no flash inside a region");
    if (sizeless_.contains(aperture_))
      fail_here(text, fmt::format("an aperture with copper; D{} has no size", aperture_));
    const Purpose purpose = purposes_[aperture_];
    if (purpose == Purpose::fiducial) marks_.add(row_);
    if (purpose == Purpose::via) vias_.add(row_);
    if (clear_)
      fail_here(text, "flashes of dark polarity (LPD) alone; one in clear polarity takes material away");
    const auto block = blocks_.find(aperture_);
    if (block == blocks_.end()) {
      const RawPoint middle = transform_.apply(middle_of_aperture(text));
      add({x_ + middle.x, y_ + middle.y, row_, std::nullopt, static_cast<std::uint32_t>(aperture_)});
      return;
    }
    for (const RawPoint& p : block->second) {
      const RawPoint turned = transform_.apply(p);
      add({x_ + turned.x, y_ + turned.y, p.row, std::nullopt, p.group});
    }
  }

  /// From where an aperture is flashed to the middle of its copper.
  RawPoint middle_of_aperture(std::string_view text) {
    const auto found = shaped_.find(aperture_);
    if (found == shaped_.end()) return {};
    Shaped& shaped = found->second;
    if (!shaped.copper)
      shaped.copper = copper_of_macro(
          *shaped.blocks, shaped.parameters, macro_steps_,
          [&](std::string_view what, std::string_view expected) {
            fail(path_,
                 fmt::format("row {}: found {} in the macro of aperture D{}, which is defined in row {}, "
                             "expected {}",
                             row_, in_quotes(what), aperture_, shaped.row, expected));
          });
    const MacroCopper& copper = *shaped.copper;
    if (!copper.any) fail_here(text, fmt::format("an aperture with copper; D{} has none", aperture_));
    // What a layout system rounded is no way.
    constexpr double kNone_mm = 1e-3;
    const RawPoint middle{copper.x * unit_mm_, copper.y * unit_mm_, row_};
    const bool at_flash = std::hypot(middle.x, middle.y) <= kNone_mm;
    if (copper.on_middle) return at_flash ? RawPoint{} : middle;
    if (!at_flash && !copper.on_origin)
      fail_here(text, fmt::format("copper at the flash or in the aperture's middle; D{} has it beside both",
                                  aperture_));
    if (odd_++ == 0) first_odd_ = row_;
    return {};
  }

  void add(const RawPoint& point) {
    // Those of blocks count as well, which hold flashes that may never be made.
    constexpr std::size_t kMostAdded = 4 * kMaxPoints;
    if (++added_ > kMostAdded)
      fail(path_,
           fmt::format("row {}: found more than {} flashes in blocks and steps, expected at most so many",
                       row_, kMostAdded));
    levels_.back().points.push_back(point);
    check_point_count(path_, levels_.back().points.size());
  }

  const std::filesystem::path& path_;
  std::vector<Level> levels_;
  std::size_t added_ = 0;
  std::size_t row_ = 0;
  std::size_t ended_row_ = 0;

  Statement format_, unit_;
  double unit_mm_ = 0.0;
  bool trailing_omitted_ = false, incremental_ = false;
  int whole_ = 0, decimals_ = 0;

  /// An aperture of a macro; `copper` is worked out where it is flashed first.
  struct Shaped {
    std::shared_ptr<const std::string> blocks;
    std::vector<double> parameters;
    std::size_t row = 0;
    std::optional<MacroCopper> copper;
  };

  std::map<std::string, std::shared_ptr<const std::string>> macros_;
  std::map<int, Shaped> shaped_;
  std::size_t macro_steps_ = 0;
  std::set<int> apertures_, sizeless_;
  enum class Purpose { bump, fiducial, via };
  std::map<int, Purpose> purposes_;  // of apertures
  Purpose next_is_ = Purpose::bump;  // what the apertures defined next are for
  OtherPads marks_{"flash", "flashes", "a fiducial", "fiducials"}, vias_{"flash", "flashes", "a via", "vias"};
  std::map<int, std::vector<RawPoint>> blocks_;

  int aperture_ = 0, operation_ = 2;
  double x_ = 0.0, y_ = 0.0;
  bool in_region_ = false, clear_ = false;
  Transform transform_;
  std::optional<Side> side_;
  std::size_t side_row_ = 0;
  bool has_function_ = false;     // the file says what layer it is
  bool copper_ = false;           // by the file's own word, as the next
  std::size_t negative_row_ = 0;  //
  Statement unprinted_;           // what kind of layer holds no bumps
  std::size_t regions_ = 0, first_region_ = 0, draws_ = 0, first_draw_ = 0, odd_ = 0, first_odd_ = 0;
};

}  // namespace

RawPoints read_gerber_points(const std::filesystem::path& path, std::string_view content) {
  if (const auto kind = describe_content(content); kind != "text")
    fail(path, fmt::format("found {}, expected a Gerber layer (RS-274X)", kind));
  GerberFile file(path);
  file.run(without_byte_order_mark(content));
  return std::move(file).finish();
}

}  // namespace meltstage::motion::detail
