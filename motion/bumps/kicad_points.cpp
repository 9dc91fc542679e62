// SPDX-License-Identifier: Apache-2.0
// Pad positions out of a KiCad footprint or board (S-expressions, KiCad 5 `module` and KiCad 6+ `footprint`).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <map>

#include "base/count.hpp"
#include "base/file.hpp"
#include "base/number.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

/// A word or quoted string (no children), or a list. `row` is the line where it begins, `column` its place in
/// the line.
struct Node {
  std::string word;
  std::vector<Node> children;
  std::size_t row = 1;
  std::size_t column = 1;
};

/// Word of a list's first child, e.g. "pad".
std::string_view head(const Node& node) {
  return node.children.empty() ? std::string_view{} : node.children[0].word;
}

const Node* find_list(const Node& node, std::string_view name) {
  const auto found = std::find_if(node.children.begin(), node.children.end(),
                                  [&](const Node& child) { return head(child) == name; });
  return found == node.children.end() ? nullptr : &*found;
}

/// Lists that an element has once: of two places, one would be passed over.
void require_once(const std::filesystem::path& path, const Node& node,
                  std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    const Node* first = find_list(node, name);
    if (first == nullptr) continue;
    const auto second =
        std::find_if(node.children.begin() + (first - node.children.data()) + 1, node.children.end(),
                     [&](const Node& child) { return head(child) == name; });
    if (second != node.children.end())
      fail(path,
           fmt::format("line {}, column {}: found a second ({} ...), expected one; the first is in line "
                       "{}, column {}",
                       second->row, second->column, name, first->row, first->column));
  }
}

/// What a file holds, and the names that its one list may have.
struct Kind {
  std::string_view noun, ending;
  std::array<std::string_view, 2> names;
};

constexpr Kind kFootprint{"footprint", ".kicad_mod", {"footprint", "module"}};
constexpr Kind kBoard{"board", ".kicad_pcb", {"kicad_pcb", "kicad_pcb"}};

bool is_of(const Kind& kind, std::string_view name) {
  return std::find(kind.names.begin(), kind.names.end(), name) != kind.names.end();
}

/// Reads the one list that a file of KiCad consists of.
class Reader {
 public:
  Reader(const std::filesystem::path& path, std::string_view text, const Kind& kind)
      : path_(path), text_(text), kind_(kind) {}

  Node read() {
    skip_blanks();
    if (at_ == text_.size() || text_[at_] != '(')
      fail_here(fmt::format(", expected ({} ...)", kind_.names.front()));
    std::vector<Node> open;
    do {
      read_item(open);
      check_kind(open.front());
      skip_blanks();
    } while (open.size() > 1 || at_ == text_.size() || text_[at_] != ')');
    if (open.front().children.empty()) fail_here(fmt::format(", expected the word {}", kind_.names.front()));
    advance();
    skip_blanks();
    if (at_ < text_.size())
      fail_here(fmt::format(" behind the {}, expected the end of the file", kind_.noun));
    return std::move(open.front());
  }

 private:
  /// One bracket, word or text; a closed list moves into the one around it.
  void read_item(std::vector<Node>& open) {
    if (at_ == text_.size())
      fail(path_,
           fmt::format("line {}, column {}: the file ends inside the list that begins here, expected ')'",
                       open.back().row, open.back().column));
    constexpr std::size_t kMostWords = 5'000'000;
    if (++words_ > kMostWords)
      fail_here(fmt::format(" behind {} words and lists, expected a {} of at most so many", kMostWords,
                            kind_.noun));
    Node node = here();
    if (text_[at_] == '(') {
      if (open.size() == kMostNested)
        fail_here(fmt::format(" nested deeper than {} lists, expected a {}", kMostNested, kind_.noun));
      advance();
      open.push_back(std::move(node));
      return;
    }
    if (text_[at_] == ')') {
      advance();
      node = std::move(open.back());
      open.pop_back();
    } else {
      node.word = text_[at_] == '"' ? read_string() : read_word();
    }
    open.back().children.push_back(std::move(node));
  }

  void check_kind(const Node& root) const {
    if (root.children.empty() || is_of(kind_, head(root))) return;
    fail(path_, fmt::format("line {}, column {}: found {}, expected a {}", root.row, root.column,
                            in_quotes(fmt::format("({}", head(root))), kind_.noun));
  }

  [[noreturn]] void fail_here(std::string_view rest) const {
    const auto line = text_.substr(at_, text_.find_first_of("\r\n", at_) - at_);
    fail(path_, fmt::format("line {}, column {}: found {}{}", row_, column_,
                            at_ == text_.size() ? "the end of the file" : in_quotes(line), rest));
  }

  Node here() const { return {{}, {}, row_, column_}; }

  void advance() {
    if (text_[at_++] == '\n') {
      ++row_;
      column_ = 1;
    } else {
      ++column_;
    }
  }

  bool is_first_in_line() const {
    std::size_t before = at_;
    while (before > 0 && (text_[before - 1] == ' ' || text_[before - 1] == '\t')) --before;
    return before == 0 || text_[before - 1] == '\n' || text_[before - 1] == '\r';
  }

  /// Lines that begin with '#' are comments, as KiCad itself reads them.
  void skip_blanks() {
    for (; at_ < text_.size(); advance()) {
      if (text_[at_] == '#' && is_first_in_line())
        while (at_ < text_.size() && text_[at_] != '\n') advance();
      else if (std::string_view(" \t\r\n").find(text_[at_]) == std::string_view::npos)
        return;
      if (at_ == text_.size()) return;
    }
  }

  std::string read_word() {
    const std::size_t start = at_;
    while (at_ < text_.size() && std::string_view(" \t\r\n()\"").find(text_[at_]) == std::string_view::npos)
      advance();
    return std::string(text_.substr(start, at_ - start));
  }

  std::string read_string() {
    const Node start = here();
    std::string out;
    for (advance(); at_ < text_.size() && text_[at_] != '"'; advance()) {
      if (text_[at_] == '\\' && at_ + 1 < text_.size()) advance();
      out += text_[at_];
    }
    if (at_ == text_.size())
      fail(path_,
           fmt::format("line {}, column {}: the file ends inside the text that begins here, expected '\"'",
                       start.row, start.column));
    advance();
    return out;
  }

  const std::filesystem::path& path_;
  std::string_view text_;
  const Kind& kind_;
  std::size_t at_ = 0, row_ = 1, column_ = 1;
  std::size_t words_ = 0;
};

constexpr std::size_t kTypePlace = 2;

template <class IsThat>
bool has_layer(const Node& pad, const IsThat& is_that) {
  const Node* layers = find_list(pad, "layers");
  return layers == nullptr || std::any_of(layers->children.begin(), layers->children.end(),
                                          [&](const Node& layer) { return is_that(layer.word); });
}

bool has_copper(const Node& pad) {
  return has_layer(pad, [](std::string_view layer) { return layer.ends_with(".Cu"); });
}

bool has_outer_copper(const Node& pad) {
  return has_layer(pad,
                   [](std::string_view layer) { return layer.ends_with(".Cu") && !layer.starts_with("In"); });
}

/// Pads on the board's outer copper receive a bump; apertures of the paste or mask layer alone are drawn over
/// pads that are there already.
bool receives_bump(const Node& pad) {
  if (pad.children.size() <= kTypePlace) return false;
  const std::string& type = pad.children[kTypePlace].word;
  return (type == "smd" || type == "thru_hole") && has_outer_copper(pad);
}

/// Copper of any outline around an anchor: where its middle is the file does not say.
bool has_own_shape(const Node& pad) {
  constexpr std::size_t kShapePlace = kTypePlace + 1;
  return pad.children.size() > kShapePlace && pad.children[kShapePlace].word == "custom";
}

/// (property pad_prop_fiducial_glob), of the board or of a component.
bool is_fiducial(const Node& pad) {
  return std::any_of(pad.children.begin(), pad.children.end(), [](const Node& node) {
    return head(node) == "property" && node.children.size() > 1 &&
           node.children[1].word.starts_with("pad_prop_fiducial");
  });
}

/// What kind of pad receives no bump.
std::string_view kind_without_bump(const Node& pad) {
  const std::string_view type =
      pad.children.size() > kTypePlace ? std::string_view(pad.children[kTypePlace].word) : "";
  if (type == "np_thru_hole") return "unplated hole";
  if (type == "connect") return "connect pad";
  if (!has_copper(pad)) return "copperless aperture";
  return has_outer_copper(pad) ? "unknown pad" : "pad of inner layers";
}

/// The side that a pad is on, by its copper; nothing for one that has copper on both.
std::optional<Side> side_of(const Node& pad) {
  const Node* layers = find_list(pad, "layers");
  if (layers == nullptr) return std::nullopt;
  std::optional<Side> side;
  for (const Node& layer : layers->children) {
    if (!layer.word.ends_with(".Cu")) continue;
    if (side || (layer.word != "F.Cu" && layer.word != "B.Cu")) return std::nullopt;
    side = layer.word == "F.Cu" ? Side::top : Side::bottom;
  }
  return side;
}

double read_position(const std::filesystem::path& path, const Node& pad, const Node& at, std::size_t place,
                     std::string_view axis) {
  if (at.children.size() <= place)
    fail(path, fmt::format("line {}, column {}: found no {}, expected (at x y)", at.row, at.column, axis));
  const Node& node = at.children[place];
  const auto value = parse_number(node.word);
  if (!value || !std::isfinite(*value))
    fail(path,
         fmt::format("line {}, column {} ({} of {} {}): found {}, expected a finite number such as 12.5",
                     node.row, node.column, axis, head(pad), in_quotes(pad.children[1].word),
                     in_quotes(node.word)));
  return *value;
}

double number_at(const std::filesystem::path& path, const Node& pad, const Node& list, std::size_t place,
                 std::string_view name) {
  if (list.children.size() <= place) return 0.0;
  return read_position(path, pad, list, place, name);
}

/// Where a footprint lies on its board, y upwards, and its angle counter-clockwise.
struct Placement {
  double x = 0.0, y = 0.0, angle_deg = 0.0;
};

/// The middle of a pad, y upwards. Its place turns with the footprint; its own angle counts the footprint's
/// in. An smd pad's copper may be shifted from the pad's own place, in the frame that turns with the pad; of
/// a thru-hole pad the hole stays where it is.
RawPoint middle_of(const std::filesystem::path& path, const Placement& footprint, const Node& pad,
                   const Node& at) {
  const RawPoint own =
      turned({read_position(path, pad, at, 1, "x"), -read_position(path, pad, at, 2, "y"), pad.row},
             footprint.angle_deg);
  const RawPoint place{footprint.x + own.x, footprint.y + own.y, pad.row};
  const Node* drill = find_list(pad, "drill");
  if (drill != nullptr) require_once(path, *drill, {"offset"});
  const Node* offset = drill == nullptr ? nullptr : find_list(*drill, "offset");
  if (offset == nullptr || pad.children[kTypePlace].word != "smd") return place;
  const RawPoint shift = turned({read_position(path, pad, *offset, 1, "x of the offset"),
                                 -read_position(path, pad, *offset, 2, "y of the offset"), pad.row},
                                number_at(path, pad, at, 3, "angle"));
  return {place.x + shift.x, place.y + shift.y, pad.row};
}

/// How many pads of a kind receive no bump, and where the first of them stands.
struct LeftOut {
  std::string_view kind;
  std::size_t count = 0, first_row = 0;
};

void count_left_out(std::vector<LeftOut>& all, const Node& pad) {
  const std::string_view kind = kind_without_bump(pad);
  const auto same = std::find_if(all.begin(), all.end(), [&](const LeftOut& l) { return l.kind == kind; });
  if (same == all.end())
    all.push_back({kind, 1, pad.row});
  else
    ++same->count;
}

[[noreturn]] void fail_without_bumps(const std::filesystem::path& path,
                                     const std::vector<LeftOut>& left_out) {
  std::string found;
  for (const LeftOut& l : left_out)
    found += fmt::format("{}{}{} in row {}", found.empty() ? "" : ", ", counted(l.count, l.kind),
                         l.count == 1 ? "" : ", first", l.first_row);
  fail(path, fmt::format("found {}, expected pads of type smd or thru_hole on a copper layer, which hold the "
                         "bumps; change the pads' type where they do",
                         found.empty() ? "no pads" : found));
}

/// (attr smd dnp)
bool is_unpopulated(const Node& footprint) {
  const Node* attributes = find_list(footprint, "attr");
  return attributes != nullptr && std::any_of(attributes->children.begin(), attributes->children.end(),
                                              [](const Node& attribute) { return attribute.word == "dnp"; });
}

/// The bumps of footprints, one after the other.
class Pads {
 public:
  explicit Pads(const std::filesystem::path& path) : path_(path) { result_.has_unit = true; }

  void add(const Node& footprint, const Placement& placement) {
    const bool unpopulated = is_unpopulated(footprint);
    for (const Node& node : footprint.children) {
      if (head(node) != "pad") continue;
      const std::size_t before = result_.points.size();
      add_pad(node, placement);
      if (unpopulated && result_.points.size() > before) unpopulated_.add(node.row);
    }
  }

  void leave_via_out(std::size_t row) {
    if (vias_++ == 0) first_via_row_ = row;
  }

  /// The same; the pads are a group of this name.
  void add(const Node& footprint, const Placement& placement, const std::string& name) {
    const std::size_t first = result_.points.size();
    add(footprint, placement);
    if (result_.points.size() == first) return;
    const auto group = static_cast<std::uint32_t>(result_.groups.size());
    result_.groups.emplace(group, name);
    for (std::size_t i = first; i < result_.points.size(); ++i) result_.points[i].group = group;
  }

  RawPoints finish() && {
    if (result_.points.empty()) fail_without_bumps(path_, left_out_);
    for (const LeftOut& l : left_out_) result_.notes.push_back(no_bump_note(l.count, l.kind, l.first_row));
    if (custom_ > 0)
      result_.notes.push_back(
          fmt::format("{} pad{} of custom shape, {}in row {}, {} a bump at the anchor, which need not be the "
                      "copper's middle",
                      custom_, custom_ == 1 ? "" : "s", custom_ == 1 ? "" : "first ", first_custom_row_,
                      custom_ == 1 ? "holds" : "hold"));
    marks_.tell(result_);
    unpopulated_.tell(result_);
    if (vias_ > 0) result_.notes.push_back(no_bump_note(vias_, "via", first_via_row_));
    return std::move(result_);
  }

 private:
  void add_pad(const Node& pad, const Placement& placement) {
    require_once(path_, pad, {"at", "layers", "drill"});
    if (!receives_bump(pad)) return count_left_out(left_out_, pad);
    const Node* at = find_list(pad, "at");
    if (at == nullptr)
      fail(path_, fmt::format("line {}, column {}: found pad {} without a position, expected (at x y)",
                              pad.row, pad.column, in_quotes(pad.children[1].word)));
    result_.points.push_back(middle_of(path_, placement, pad, *at));
    result_.points.back().side = side_of(pad);
    if (has_own_shape(pad) && custom_++ == 0) first_custom_row_ = pad.row;
    if (is_fiducial(pad)) marks_.add(pad.row);
    check_point_count(path_, result_.points.size());
  }

  const std::filesystem::path& path_;
  RawPoints result_;
  std::vector<LeftOut> left_out_;
  std::size_t custom_ = 0, first_custom_row_ = 0;
  std::size_t vias_ = 0, first_via_row_ = 0;
  OtherPads marks_{"pad", "pads", "a fiducial", "fiducials"},
      unpopulated_{"pad", "pads", "of a part not populated", "of parts not populated"};
};

/// The list of a file of this kind.
Node read_file_of(const Kind& kind, const std::filesystem::path& path, std::string_view content) {
  if (const auto found = describe_content(content); found != "text")
    fail(path, fmt::format("found {}, expected a KiCad {} ({})", found, kind.noun, kind.ending));
  return Reader(path, without_byte_order_mark(content), kind).read();
}

/// Such as U1: (property "Reference" "U1" ...), before KiCad 8 (fp_text reference "U1" ...).
std::string reference_of(const Node& footprint) {
  for (const Node& node : footprint.children)
    if (node.children.size() > 2 && ((head(node) == "property" && node.children[1].word == "Reference") ||
                                     (head(node) == "fp_text" && node.children[1].word == "reference")))
      return node.children[2].word;
  return "unnamed";
}

Placement placement_of(const std::filesystem::path& path, const Node& footprint) {
  require_once(path, footprint, {"at"});
  const Node* at = find_list(footprint, "at");
  if (at == nullptr || footprint.children.size() < 2)
    fail(path, fmt::format("line {}, column {}: found a footprint without a position, expected (at x y)",
                           footprint.row, footprint.column));
  return {read_position(path, footprint, *at, 1, "x"), -read_position(path, footprint, *at, 2, "y"),
          number_at(path, footprint, *at, 3, "angle")};
}

/// Copper's own names, by those that a board of KiCad 5 or older gives its layers: (layers (0 Top signal)
/// ...).
std::map<std::string, std::string> copper_names(const Node& board) {
  constexpr std::array<std::string_view, 4> kCopperTypes = {"signal", "power", "mixed", "jumper"};
  constexpr std::size_t kBack = 31;
  std::map<std::string, std::string> names;
  const Node* layers = find_list(board, "layers");
  if (layers == nullptr) return names;
  for (const Node& layer : layers->children) {
    if (layer.children.size() < 3 || layer.children[1].word.ends_with(".Cu")) continue;
    const auto number = number_in<std::size_t>(layer.children[0].word, 0, kBack);
    if (!number ||
        std::find(kCopperTypes.begin(), kCopperTypes.end(), layer.children[2].word) == kCopperTypes.end())
      continue;
    names[layer.children[1].word] = *number == 0       ? "F.Cu"
                                    : *number == kBack ? "B.Cu"
                                                       : fmt::format("In{}.Cu", *number);
  }
  return names;
}

/// Gives the copper of pads its own names.
void name_copper(Node& board) {
  const std::map<std::string, std::string> names = copper_names(board);
  if (names.empty()) return;
  for (Node& footprint : board.children)
    for (Node& pad : footprint.children)
      for (Node& list : pad.children)
        if (head(list) == "layers")
          for (Node& layer : list.children)
            if (const auto named = names.find(layer.word); named != names.end()) layer.word = named->second;
}

}  // namespace

RawPoints read_kicad_points(const std::filesystem::path& path, std::string_view content) {
  Pads pads(path);
  pads.add(read_file_of(kFootprint, path, content), {});
  return std::move(pads).finish();
}

RawPoints read_kicad_board(const std::filesystem::path& path, std::string_view content) {
  Pads pads(path);
  Node board = read_file_of(kBoard, path, content);
  name_copper(board);
  for (const Node& node : board.children) {
    if (is_of(kFootprint, head(node))) pads.add(node, placement_of(path, node), reference_of(node));
    if (head(node) == "via") pads.leave_via_out(node.row);
  }
  return std::move(pads).finish();
}

}  // namespace meltstage::motion::detail
