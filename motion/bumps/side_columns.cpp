// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/side_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <initializer_list>
#include <optional>
#include <string_view>

#include "base/place.hpp"
#include "motion/bumps/column_names.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

template <class Words>
bool is_one_of(std::string_view word, const Words& words) {
  return std::find(std::begin(words), std::end(words), word) != std::end(words);
}

template <class Words>
bool any_is_one_of(const std::vector<std::string>& name, const Words& words) {
  return std::any_of(name.begin(), name.end(),
                     [&](const std::string& word) { return is_one_of(word, words); });
}

// ---- what a cell says ----

std::optional<Side> side_of_word(const Cell& cell) { return side_named(cell.text); }

std::optional<Side> side_of_unmistakable_word(const Cell& cell) { return side_unmistakably_named(cell.text); }

std::optional<bool> yes_or_no(const Cell& cell) {
  constexpr std::array<std::string_view, 8> kYes = {"1", "yes", "y", "true", "x", "ja", "j", "oui"};
  constexpr std::array<std::string_view, 7> kNo = {"0", "no", "n", "false", "none", "nein", "non"};
  const std::string text = plain_name(cell);
  if (is_one_of(text, kYes)) return true;
  if (is_one_of(text, kNo)) return false;
  return std::nullopt;
}

/// Of a column Bottom: yes is the bottom.
std::optional<Side> bottom_if_yes(const Cell& cell) {
  if (const auto yes = yes_or_no(cell)) return *yes ? Side::bottom : Side::top;
  return side_named(cell.text);
}

/// Of a column Top.
std::optional<Side> top_if_yes(const Cell& cell) {
  if (const auto yes = yes_or_no(cell)) return *yes ? Side::top : Side::bottom;
  return side_named(cell.text);
}

/// Of a column Mirror or Flip: what is mirrored lies on the bottom.
std::optional<Side> bottom_if_mirrored(const Cell& cell) {
  constexpr std::array<std::string_view, 6> kMirrored = {"m",    "mirror",  "mirrored",
                                                         "flip", "flipped", "gespiegelt"};
  constexpr std::array<std::string_view, 3> kNot = {"not mirrored", "not flipped", "nicht gespiegelt"};
  const std::string text = plain_name(cell);
  if (is_one_of(text, kMirrored)) return Side::bottom;
  if (is_one_of(text, kNot)) return Side::top;
  return bottom_if_yes(cell);
}

/// Of a column Lage, in German: BS is the Best\u00fcckungsseite, LS the L\u00f6tseite.
std::optional<Side> side_of_german_word(const Cell& cell) {
  const std::string text = plain_name(cell);
  if (text == "bs") return Side::top;
  if (text == "ls") return Side::bottom;
  return side_named(cell.text);
}

/// Of a turn as Eagle writes it: R90, and MR90 or M90 of what is mirrored, which lies on the bottom.
std::optional<Side> bottom_if_turn_is_mirrored(const Cell& cell) {
  const std::string text = plain_name(cell);
  std::string_view rest = text;
  if (rest.starts_with('s')) rest.remove_prefix(1);  // text that is never upside down
  const bool mirrored = rest.starts_with('m');
  if (mirrored) rest.remove_prefix(1);
  const bool turned = rest.starts_with('r');
  if (turned) rest.remove_prefix(1);
  if (!cell.number && !parse_number(rest)) return std::nullopt;
  return mirrored ? Side::bottom : Side::top;
}

// ---- what a name says ----

constexpr std::string_view kSideExpected = "top or bottom, such as TopLayer, F.Cu or Component Side",
                           kYesExpected = "yes or no";

/// Side, Board Side, BoardSide, Layer, layer_name, T/B, TB, Seite, Platinenseite.
bool names_sides(const std::vector<std::string>& name) {
  constexpr std::array<std::string_view, 12> kWords = {
      "side",          "layer",     "tb",       "topbottom", "boardside",  "pcbside",
      "placementside", "mountside", "compside", "layername", "boardlayer", "topbot"};
  // Of other languages the column is known, and its words are refused unless they are known, too.
  constexpr std::array<std::string_view, 22> kOtherLanguages = {"lato",
                                                                "couche",
                                                                "capa",
                                                                "strato",
                                                                "cara",
                                                                "lado",
                                                                "c\u00f4t\u00e9",
                                                                "zijde",
                                                                "strona",
                                                                "\u9762",
                                                                "\u5b9f\u88c5\u9762",
                                                                "warstwa",
                                                                "strana",
                                                                "\u0441\u0442\u043e\u0440\u043e\u043d\u0430",
                                                                "\u0421\u0442\u043e\u0440\u043e\u043d\u0430",
                                                                "\u0441\u043b\u043e\u0439",
                                                                "\u0421\u043b\u043e\u0439",
                                                                "y\u00fcz",
                                                                "sida",
                                                                "puoli",
                                                                "\uc704\uce58",
                                                                "\uba74"};
  const std::vector<std::string> letters = {"t", "b"}, both = {"top", "bottom"};
  return name == letters || name == both || any_is_one_of(name, kWords) ||
         any_is_one_of(name, kOtherLanguages) ||
         std::any_of(name.begin(), name.end(),
                     [](const std::string& word) { return word.ends_with("seite"); });
}

/// Mirror, Mirrored, SYM_MIRROR.
bool names_mirrors(const std::vector<std::string>& name) {
  return std::any_of(name.begin(), name.end(), [](const std::string& word) {
    return word.starts_with("mirror") || word == "gespiegelt";
  });
}

/// Bottom, "On bottom", bottom_side: one of the words, and none that makes another thing of it.
template <class Words>
bool names_one_side(const std::vector<std::string>& name, const Words& words) {
  constexpr std::array<std::string_view, 10> kBeside = {"is",    "on",  "at",  "auf", "side",
                                                        "board", "pcb", "smd", "der", "placed"};
  return any_is_one_of(name, words) && std::all_of(name.begin(), name.end(), [&](const std::string& word) {
           return is_one_of(word, words) || is_one_of(word, kBeside);
         });
}

bool names_bottom(const std::vector<std::string>& name) {
  constexpr std::array<std::string_view, 13> kWords = {
      "bottom",     "bot",   "btm",        "back",           "backside", "bottomside", "underside",
      "solderside", "unten", "unterseite", "r\u00fcckseite", "isbottom", "onbottom"};
  return names_one_side(name, kWords);
}

bool names_top(const std::vector<std::string>& name) {
  constexpr std::array<std::string_view, 9> kWords = {
      "top", "topside", "front", "frontside", "oben", "oberseite", "vorderseite", "istop", "ontop"};
  return names_one_side(name, kWords);
}

/// Flip, isFlipped, "Flip X": a part that is seen from below is flipped over an axis.
bool names_flips(std::vector<std::string> name) {
  constexpr std::array<std::string_view, 6> kWords = {"flip",       "flipped", "isflipped",
                                                      "ismirrored", "flipx",   "flipy"};
  std::erase_if(name, [](const std::string& word) { return word == "x" || word == "y"; });
  return names_one_side(name, kWords);
}

/// Location, Face, Placement: where a part is, which may be its side.
bool names_places(const std::vector<std::string>& name) {
  constexpr std::array<std::string_view, 12> kWords = {"location", "loc",      "place",    "placement",
                                                       "position", "pos",      "face",     "surface",
                                                       "mounted",  "mounting", "assembly", "mount"};
  return any_is_one_of(name, kWords);
}

/// Rotation, Orientation, Angle, Rot.
bool names_turns(const std::vector<std::string>& name) {
  constexpr std::array<std::string_view, 8> kWords = {"rotation", "rot",   "orientation", "orient",
                                                      "angle",    "theta", "drehung",     "winkel"};
  return any_is_one_of(name, kWords);
}

/// Words of any kind stand in such a column, and mean what they like.
bool names_remarks(const std::vector<std::string>& name) {
  constexpr std::array<std::string_view, 24> kWords = {
      "comment", "comments",    "quality", "grade",      "note",   "notes",   "remark",    "remarks",
      "desc",    "description", "name",    "net",        "value",  "val",     "kommentar", "bemerkung",
      "text",    "label",       "ref",     "designator", "refdes", "package", "footprint", "part"};
  return any_is_one_of(name, kWords);
}

struct Meaning {
  SideColumns::Trust trust = SideColumns::Trust::sides;
  SideColumns::Reading side_of = nullptr;
  std::string_view expected;
};

std::optional<Meaning> meaning_of(const Cell& cell) {
  using enum SideColumns::Trust;
  const std::vector<std::string> name = words_of_name(cell);
  if (names_mirrors(name)) return Meaning{sides, bottom_if_mirrored, kYesExpected};
  if (names_flips(name)) return Meaning{sides_or_others, bottom_if_mirrored, kYesExpected};
  if (names_bottom(name)) return Meaning{sides_or_others, bottom_if_yes, kYesExpected};
  if (names_top(name)) return Meaning{sides_or_others, top_if_yes, kYesExpected};
  if (names_sides(name)) return Meaning{sides, side_of_word, kSideExpected};
  if (names_remarks(name)) return std::nullopt;
  if (std::find(name.begin(), name.end(), "lage") != name.end())
    return Meaning{sides_or_others, side_of_german_word, kSideExpected};
  if (names_places(name)) return Meaning{sides_or_others, side_of_word, kSideExpected};
  if (names_turns(name))
    return Meaning{mirrored_turns, bottom_if_turn_is_mirrored, "a turn such as R90 or MR90"};
  return Meaning{words_alone, side_of_unmistakable_word, kSideExpected};
}

constexpr std::string_view kAdvice = "leave the column out where it tells no side of a board";

}  // namespace

void SideColumns::take_names(const TableRow& names, std::size_t x, std::size_t y) {
  for (std::size_t i = 0; i < names.cells.size(); ++i) {
    if (i == x || i == y) continue;
    if (const auto meaning = meaning_of(names.cells[i]))
      columns_.push_back({.index = i,
                          .name = shown(trimmed(names.cells[i].text)),
                          .trust = meaning->trust,
                          .side_of = meaning->side_of,
                          .expected = meaning->expected});
  }
}

namespace {

/// What stands between the signs that separate a label from its value, in small letters, without quotes.
std::vector<std::string> parts_of_line(const TableRow& row) {
  std::vector<std::string> parts;
  for (const Cell& cell : row.cells) {
    const std::string text = plain_name(cell);
    for (std::size_t from = 0; from <= text.size();) {
      const std::size_t end = std::min(text.find_first_of(":=,;\t", from), text.size());
      std::string_view part = std::string_view(text).substr(from, end - from);
      part.remove_prefix(std::min(part.find_first_not_of("\" #"), part.size()));
      part = part.substr(0, part.find_last_not_of("\" ") + 1);
      if (!part.empty()) parts.emplace_back(part);
      from = end + 1;
    }
  }
  return parts;
}

}  // namespace

bool SideColumns::take_above(const TableRow& row) {
  constexpr std::array<std::string_view, 11> kKeys = {"board side", "side", "layer",  "placement side",
                                                      "seite",      "lage", "couche", "c\u00f4t\u00e9",
                                                      "cara",       "capa", "lato"};
  const std::vector<std::string> parts = parts_of_line(row);
  bool told_side = false;
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
    if (!is_one_of(parts[i], kKeys)) continue;
    const std::string& told = parts[i + 1];
    if (const auto side = side_named(told)) {
      if (above_ && above_ != side)
        fail(path_, fmt::format("row {}: found {} above the table, expected {}, as a row before has it",
                                row.row, in_quotes(told), name_of(*above_)));
      above_ = side;
      told_side = true;
      continue;
    }
    const std::vector<std::string> words = words_of_name({told, std::nullopt});
    if (std::any_of(words.begin(), words.end(),
                    [](const std::string& word) { return side_unmistakably_named(word); }))
      fail(path_, fmt::format("row {}: found {} above the table, expected top or bottom; {}", row.row,
                              in_quotes(told), kAdvice));
  }
  if (words_above_.row == 0 && std::any_of(parts.begin(), parts.end(), [](const std::string& part) {
        const std::vector<std::string> words = words_of_name({part, std::nullopt});
        return std::any_of(words.begin(), words.end(),
                           [](const std::string& word) { return side_unmistakably_named(word).has_value(); });
      }))
    words_above_ = {row.row, parts.front()};
  return told_side;
}

void SideColumns::take_nameless(const TableRow& first, std::size_t x, std::size_t y) {
  for (std::size_t i = 0; i < first.cells.size(); ++i)
    if (i != x && i != y)
      columns_.push_back({.index = i,
                          .trust = Trust::words_alone,
                          .side_of = side_of_unmistakable_word,
                          .expected = kSideExpected});
}

void SideColumns::take(const TableRow& row) {
  for (Column& column : columns_) {
    take_cell(column, row);
    if (column.trust == Trust::sides && column.other.row != 0)
      fail(path_, fmt::format("{}: found {}, expected {}; {}", place(column, column.other.row),
                              in_quotes(column.other.word), column.expected, kAdvice));
  }
  // A table may have many more columns than those that tell sides.
  std::erase_if(columns_, [](const Column& column) {
    return column.trust == Trust::words_alone && !column.letters &&
           (column.other.row != 0 || column.empty.row != 0);
  });
}

void SideColumns::take_cell(Column& column, const TableRow& row) {
  const auto note = [&](Seen& seen, std::string_view word) {
    if (seen.row == 0) seen = {row.row, std::string(trimmed(word))};
  };
  std::optional<Side>& side = column.sides.emplace_back();
  if (column.index >= row.cells.size() || is_blank(row.cells[column.index])) {
    column.letters = false;
    return note(column.empty, {});
  }
  const Cell& cell = row.cells[column.index];
  const std::string letter = in_small_letters(trimmed(cell.text));
  column.letters = column.letters && (letter == "t" || letter == "f" || letter == "b");
  if (letter == "b") note(column.letter_b, cell.text);
  side = column.side_of(cell);
  if (!side) return note(column.other, cell.text);
  (*side == Side::top ? column.last_top : column.last_bottom) = row.row;
  const bool by_word = side_named(cell.text).has_value();
  column.unmistakable = column.unmistakable || side_unmistakably_named(cell.text) || !by_word;
}

std::string SideColumns::place(const Column& column, std::size_t row) const {
  return fmt::format("row {}, column {}{}", row, column.index + 1,
                     column.name.empty() ? "" : " (" + column.name + ")");
}

/// Whether the column tells sides; throws where it does so in some of its rows only.
bool SideColumns::tells(const Column& column) const {
  const std::size_t side_row = std::max(column.last_top, column.last_bottom);
  if (side_row == 0) return false;
  if (column.trust == Trust::mirrored_turns && column.last_bottom == 0) return false;
  const bool doubtful = column.trust == Trust::sides_or_others && !column.unmistakable;
  if (column.other.row != 0) {
    if (doubtful) return false;
    fail(path_, fmt::format("{}: found {}, expected {}, as row {} has; {}", place(column, column.other.row),
                            in_quotes(column.other.word), column.expected, side_row, kAdvice));
  }
  if (column.empty.row != 0 && !doubtful)
    fail(path_, fmt::format("{}: found nothing, expected {}, as row {} has one",
                            place(column, column.empty.row), column.expected, side_row));
  return column.empty.row == 0;
}

/// The columns that tell sides. What a column is named counts for more than what stands in another one.
std::vector<const SideColumns::Column*> SideColumns::telling() const {
  std::vector<const Column*> named, by_words;
  for (const Column& column : columns_) {
    std::vector<const Column*>& kind = column.trust == Trust::words_alone ? by_words : named;
    if (tells(column)) kind.push_back(&column);
  }
  return named.empty() ? by_words : named;
}

void SideColumns::tell(RawPoints& table) const {
  const std::vector<const Column*> columns = telling();
  for (std::size_t i = 0; i < table.points.size(); ++i) {
    RawPoint& point = table.points[i];
    point.side = above_;
    for (const Column* column : columns) {
      const std::optional<Side> side = column->sides[i];
      if (!point.side) point.side = side;
      if (side == point.side) continue;
      fail(path_, fmt::format("{}: found {}, expected {}, as {}", place(*column, point.row), name_of(*side),
                              name_of(*point.side),
                              above_ ? "told above the table"
                                     : fmt::format("column {} ({}) tells", columns.front()->index + 1,
                                                   columns.front()->name)));
    }
  }
  if (columns.empty() && !above_ && words_above_.row != 0)
    table.notes.push_back(
        fmt::format("row {} says {}, which is not read; say side = \"top\" or \"bottom\" where it tells one",
                    words_above_.row, in_quotes(words_above_.word)));
  if (columns.empty() && !above_) {
    for (const Column& column : columns_)
      if (column.letters && column.letter_b.row != 0)
        table.notes.push_back(
            fmt::format("{}: found {}, which tells no side without a name such as Side above it",
                        place(column, column.letter_b.row), in_quotes(column.letter_b.word)));
  }
  if (!columns.empty() && columns.front()->trust == Trust::words_alone)
    table.side_place = fmt::format("column {}", columns.front()->index + 1);
}

}  // namespace meltstage::motion::detail
