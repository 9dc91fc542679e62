// SPDX-License-Identifier: Apache-2.0
// Pad positions out of a KiCad footprint (S-expressions, KiCad 5 `module` and KiCad 6+ `footprint`).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "base/count.hpp"
#include "base/file.hpp"
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

/// Reads the one list that a footprint file consists of.
class Reader {
 public:
  Reader(const std::filesystem::path& path, std::string_view text) : path_(path), text_(text) {}

  Node read_footprint() {
    skip_blanks();
    if (at_ == text_.size() || text_[at_] != '(') fail_here(", expected (footprint ...)");
    std::vector<Node> open;
    do {
      read_item(open);
      check_kind(open.front());
      skip_blanks();
    } while (open.size() > 1 || at_ == text_.size() || text_[at_] != ')');
    if (open.front().children.empty()) fail_here(", expected the word footprint");
    advance();
    skip_blanks();
    if (at_ < text_.size()) fail_here(" behind the footprint, expected the end of the file");
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
      fail_here(
          fmt::format(" behind {} words and lists, expected a footprint of at most so many", kMostWords));
    Node node = here();
    if (text_[at_] == '(') {
      if (open.size() == kMostNested)
        fail_here(fmt::format(" nested deeper than {} lists, expected a footprint", kMostNested));
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
    if (root.children.empty() || head(root) == "footprint" || head(root) == "module") return;
    fail(path_, fmt::format("line {}, column {}: found {}, expected a footprint", root.row, root.column,
                            in_quotes(fmt::format("({}", head(root)))));
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

  void skip_blanks() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos)
      advance();
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
  std::size_t at_ = 0, row_ = 1, column_ = 1;
  std::size_t words_ = 0;
};

constexpr std::size_t kTypePlace = 2;

bool has_copper(const Node& pad) {
  const Node* layers = find_list(pad, "layers");
  return layers == nullptr || std::any_of(layers->children.begin(), layers->children.end(),
                                          [](const Node& layer) { return layer.word.ends_with(".Cu"); });
}

/// Pads on copper receive a bump; apertures of the paste or mask layer alone are drawn over pads that are
/// there already.
bool receives_bump(const Node& pad) {
  if (pad.children.size() <= kTypePlace) return false;
  const std::string& type = pad.children[kTypePlace].word;
  return (type == "smd" || type == "thru_hole") && has_copper(pad);
}

/// Copper of any outline around an anchor: where its middle is the file does not say.
bool has_own_shape(const Node& pad) {
  constexpr std::size_t kShapePlace = kTypePlace + 1;
  return pad.children.size() > kShapePlace && pad.children[kShapePlace].word == "custom";
}

/// What kind of pad receives no bump.
std::string_view kind_without_bump(const Node& pad) {
  const std::string_view type =
      pad.children.size() > kTypePlace ? std::string_view(pad.children[kTypePlace].word) : "";
  if (type == "np_thru_hole") return "unplated hole";
  if (type == "connect") return "connect pad";
  return has_copper(pad) ? "unknown pad" : "copperless aperture";
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
         fmt::format("line {}, column {} ({} of pad {}): found {}, expected a finite number such as 12.5",
                     node.row, node.column, axis, in_quotes(pad.children[1].word), in_quotes(node.word)));
  return *value;
}

double number_at(const std::filesystem::path& path, const Node& pad, const Node& list, std::size_t place,
                 std::string_view name) {
  if (list.children.size() <= place) return 0.0;
  return read_position(path, pad, list, place, name);
}

/// The middle of a pad, y upwards. An smd pad's copper may be shifted from the pad's own place, in the frame
/// that turns with the pad; of a thru-hole pad the hole stays where it is.
RawPoint middle_of(const std::filesystem::path& path, const Node& pad, const Node& at) {
  const RawPoint place{read_position(path, pad, at, 1, "x"), -read_position(path, pad, at, 2, "y"), pad.row};
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

}  // namespace

RawPoints read_kicad_points(const std::filesystem::path& path, std::string_view content) {
  if (const auto kind = describe_content(content); kind != "text")
    fail(path, fmt::format("found {}, expected a KiCad footprint (.kicad_mod)", kind));
  content = without_byte_order_mark(content);
  const Node footprint = Reader(path, content).read_footprint();
  RawPoints result;
  result.has_unit = true;
  std::vector<LeftOut> left_out;
  std::size_t custom = 0, first_custom_row = 0;
  for (const Node& node : footprint.children) {
    if (head(node) != "pad") continue;
    require_once(path, node, {"at", "layers", "drill"});
    if (!receives_bump(node)) {
      count_left_out(left_out, node);
      continue;
    }
    const Node* at = find_list(node, "at");
    if (at == nullptr)
      fail(path, fmt::format("line {}, column {}: found pad {} without a position, expected (at x y)",
                             node.row, node.column, in_quotes(node.children[1].word)));
    result.points.push_back(middle_of(path, node, *at));
    result.points.back().side = side_of(node);
    if (has_own_shape(node) && custom++ == 0) first_custom_row = node.row;
    check_point_count(path, result.points.size());
  }
  if (result.points.empty()) fail_without_bumps(path, left_out);
  for (const LeftOut& l : left_out) result.notes.push_back(no_bump_note(l.count, l.kind, l.first_row));
  if (custom > 0)
    result.notes.push_back(
        fmt::format("{} pad{} of custom shape, {}in row {}, {} a bump at the anchor, which need not be the "
                    "copper's middle",
                    custom, custom == 1 ? "" : "s", custom == 1 ? "" : "first ", first_custom_row,
                    custom == 1 ? "holds" : "hold"));
  return result;
}

}  // namespace meltstage::motion::detail
