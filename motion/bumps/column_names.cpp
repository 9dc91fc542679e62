// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/column_names.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

constexpr std::array<Unit, 36> kUnits = {
    {{"mm", 1.0},           {"millimeter", 1.0},   {"millimeters", 1.0},  {"millimetre", 1.0},
     {"millimetres", 1.0},  {"um", 1e-3},          {"\u00b5m", 1e-3},     {"\u03bcm", 1e-3},
     {"micron", 1e-3},      {"microns", 1e-3},     {"micrometer", 1e-3},  {"micrometers", 1e-3},
     {"micrometre", 1e-3},  {"micrometres", 1e-3}, {"mikrometer", 1e-3},  {"nm", 1e-6},
     {"cm", 10.0},          {"centimeter", 10.0},  {"centimeters", 10.0}, {"centimetre", 10.0},
     {"centimetres", 10.0}, {"m", 1000.0},         {"meter", 1000.0},     {"meters", 1000.0},
     {"metre", 1000.0},     {"metres", 1000.0},    {"mil", 0.0254},       {"mils", 0.0254},
     {"thou", 0.0254},      {"in", 25.4},          {"in.", 25.4},         {"inch", 25.4},
     {"inches", 25.4},      {"zoll", 25.4},        {"\"", 25.4},          {"\u2033", 25.4}}};

template <class Words>
bool is_one_of_these(std::string_view word, const Words& words) {
  return std::find(std::begin(words), std::end(words), word) != std::end(words);
}

/// What may stand between the words of a column's name.
constexpr std::string_view kNameSeparators = " \t_()[]/.,:";

/// Behind the words that may stand before the axis: PosX, Mid X, Center-X, Pos. X, Bump X, Columns: X.
std::size_t behind_prefixes(std::string_view name, std::size_t at) {
  constexpr auto kPrefixes = std::to_array<std::string_view>(
      {"columns", "spalten", "format", "order", "bump", "ball", "pad", "centroid", "center", "centre", "mid",
       "position", "pos", "location", "loc", "koordinate", "coordinate", "coord", "mitte"});
  for (const std::string_view prefix : kPrefixes)
    if (name.substr(at).starts_with(prefix))
      at = std::min(name.find_first_not_of(" \t_.:=-", at + prefix.size()), name.size());
  return at;
}

/// Behind a word that may stand after the axis: X Coord, X-coordinate, x_pos, X_Center, X-Achse.
std::size_t behind_suffix(std::string_view name, std::size_t at) {
  constexpr std::array<std::string_view, 14> kSuffixes = {
      "achse",    "axis", "koordinate", "coordinate", "coord",  "position", "pos",
      "location", "loc",  "centroid",   "center",     "centre", "mid",      "mitte"};
  const auto word = std::min(name.find_first_not_of(" \t_-", at), name.size());
  for (const std::string_view suffix : kSuffixes) {
    const std::size_t behind = word + suffix.size();
    if (name.substr(word).starts_with(suffix) &&
        (behind == name.size() || kNameSeparators.find(name[behind]) != std::string_view::npos))
      return behind;
  }
  return at;
}

/// "in mm"
std::string_view without_in(std::string_view unit) {
  if (!unit.starts_with("in")) return unit;
  const auto word = unit.find_first_not_of(kNameSeparators, 2);
  return word == std::string_view::npos || word == 2 ? unit : unit.substr(word);
}

}  // namespace

bool is_blank(const Cell& cell) { return !cell.number && trimmed(cell.text).empty(); }

bool begins_like_number(std::string_view text) {
  const auto first = text.find_first_not_of(" \t+-.");
  return first != std::string_view::npos && std::isdigit(static_cast<unsigned char>(text[first])) != 0;
}

std::string plain_name(const Cell& cell) {
  std::string_view text = trimmed(cell.text);
  while (text.starts_with('#')) text = trimmed(text.substr(1));
  return in_small_letters(text);
}

std::vector<std::string> words_of_name(const Cell& cell) {
  std::vector<std::string> words;
  std::string word;
  for (const char letter : plain_name(cell) + ' ') {
    const auto c = static_cast<unsigned char>(letter);
    constexpr unsigned char kFirstBeyondAscii = 0x80;
    if (std::isalnum(c) != 0 || c >= kFirstBeyondAscii)
      word += letter;
    else if (!word.empty())
      words.push_back(std::exchange(word, {}));
  }
  return words;
}

std::optional<std::string> unit_behind_axis(std::string_view name, char axis) {
  const std::string small = in_small_letters(with_plain_blanks(name));
  const auto first = small.find_first_not_of(kNameSeparators);
  if (first == std::string::npos) return std::nullopt;
  const std::size_t at = behind_prefixes(small, first);
  if (at == small.size() || small[at] != axis) return std::nullopt;
  const std::size_t behind = behind_suffix(small, at + 1);
  // X-mm, Xmm
  const std::string_view close =
      std::string_view(small).substr(behind + (small.substr(behind).starts_with('-') ? 1 : 0));
  if (unit_in_sentence(close) != nullptr) return std::string(close);
  if (behind < small.size() && kNameSeparators.find(small[behind]) == std::string_view::npos)
    return std::nullopt;
  const auto unit = small.find_first_not_of(kNameSeparators, behind);
  if (unit == std::string::npos) return "";
  // "X Offset (mm)" is another column: a word stands between the axis and the unit.
  const auto word_end = small.find_first_of(kNameSeparators, unit);
  const auto bracket = small.find_first_of("([", unit);
  if (bracket != std::string::npos && word_end <= bracket && !small.substr(unit).starts_with("in "))
    return std::nullopt;
  return std::string(
      without_in(std::string_view(small).substr(unit, small.find_last_not_of(kNameSeparators) - unit + 1)));
}

const Unit* find_unit(std::string_view name) {
  const auto* known =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.name == name; });
  return known == kUnits.end() ? nullptr : known;
}

std::optional<Length> length_of(const Cell& cell) {
  if (cell.number) return std::nullopt;
  const std::string_view text = trimmed(cell.text);
  const auto digits = text.find_last_of("0123456789");
  if (digits == std::string_view::npos) return std::nullopt;
  const std::size_t behind = digits + (text.substr(digits + 1).starts_with('.') ? 2 : 1);
  const auto value = parse_number(text.substr(0, behind));
  const Unit* unit = find_unit(trimmed(text.substr(behind)));
  if (!value || unit == nullptr) return std::nullopt;
  return Length{*value, unit};
}

namespace {

/// "X,Y in mils", "All coordinates are in mm", "Measurement units: mil", "(mil)": words of a place and a unit
/// behind them, and no other.
std::optional<std::string> unit_of_sentence(std::string_view sentence) {
  constexpr std::array kWords = std::to_array<std::string_view>(
      {"x",        "y",         "xy",         "and",         "und",          "the",         "all",
       "alle",     "are",       "is",         "in",          "given",        "used",        "units",
       "unit",     "of",        "coordinate", "coords",      "coordinates",  "position",    "positions",
       "location", "locations", "dimension",  "distances",   "dimensions",   "values",      "length",
       "lengths",  "measure",   "measures",   "measurement", "measurements", "koordinaten", "koordinate",
       "einheit",  "einheiten", "maßeinheit", "maße",        "werte",        "angaben"});
  std::vector<std::string> words;
  std::string word;
  for (const char c : std::string(sentence) + ' ') {
    if (std::string_view(" \t,;:=()[]\"/").find(c) == std::string_view::npos)
      word += c;
    else if (!word.empty())
      words.push_back(std::exchange(word, ""));
  }
  if (words.empty() || find_unit(words.back()) == nullptr) return std::nullopt;
  const bool bracketed = sentence.starts_with('(') || sentence.starts_with('[');
  if (words.size() == 1 && !bracketed) return std::nullopt;
  const bool known = std::all_of(words.begin(), words.end() - 1, [&](const std::string& each) {
    return std::find(kWords.begin(), kWords.end(), each) != kWords.end();
  });
  return known ? std::optional(words.back()) : std::nullopt;
}

}  // namespace

std::optional<UnitTold> unit_told(std::string_view line, std::string_view next) {
  constexpr std::string_view kAround = " \t\",;";
  const auto bare = [&](std::string_view text) {
    const auto first = std::min(text.find_first_not_of(kAround), text.size());
    return std::string(text.substr(first, text.find_last_not_of(kAround) + 1 - first));
  };
  constexpr std::array<std::string_view, 15> kKeys = {
      "units used",      "units",       "unit",       "all units",      "coordinate units",
      "coordinate unit", "einheiten",   "einheit",    "all dimensions", "dimensions",
      "all coordinates", "coordinates", "all values", "values",         "ma\u00dfe"};
  const std::string text = bare(plain_name({std::string(line), std::nullopt}));
  for (const std::string_view key : kKeys) {
    if (!text.starts_with(key)) continue;
    std::string_view rest = trimmed(std::string_view(text).substr(key.size()));
    const bool stated = key.find("unit") != std::string_view::npos || key.starts_with("einheit");
    const bool has_mark = rest.starts_with(':') || rest.starts_with('=');
    if (has_mark) rest.remove_prefix(1);
    std::string word = bare(rest);
    word = bare(word.substr(0, word.find_first_of(",;")));
    if (word.empty()) word = bare(plain_name({std::string(next), std::nullopt}));
    for (const std::string_view filler : {"are ", "is ", "in "})
      if (word.starts_with(filler)) word.erase(0, filler.size());
    if (find_unit(word) != nullptr || (stated && has_mark)) return UnitTold{word, stated};
  }
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = std::min(rest.find(". "), rest.size());
    std::string_view sentence = rest.substr(0, end);
    while (sentence.ends_with('.')) sentence.remove_suffix(1);
    if (const auto unit = unit_of_sentence(trimmed(sentence))) return UnitTold{*unit};
    rest.remove_prefix(std::min(end + 2, rest.size()));
  }
  return std::nullopt;
}

const Unit* unit_in_sentence(std::string_view word) {
  return word == "m" || word == "in" ? nullptr : find_unit(word);
}

const Unit* other_unit_in(std::string_view line, const Unit& unit) {
  for (const std::string& word : words_of_name({std::string(line), std::nullopt})) {
    const Unit* other = unit_in_sentence(word);
    if (other != nullptr && other->mm != unit.mm) return other;
  }
  return nullptr;
}

bool names_column_of_units(const Cell& cell) {
  constexpr std::array<std::string_view, 7> kUnitWords = {"unit", "units", "einheit", "einheiten",
                                                          "uom",  "xunit", "yunit"};
  constexpr std::array<std::string_view, 12> kBeside = {"coord",   "coords",   "coordinate", "coordinates",
                                                        "length",  "position", "dimension",  "of",
                                                        "measure", "xy",       "x",          "y"};
  const std::vector<std::string> name = words_of_name(cell);
  const auto is_unit = [&](const std::string& word) { return is_one_of_these(word, kUnitWords); };
  return std::any_of(name.begin(), name.end(), is_unit) &&
         std::all_of(name.begin(), name.end(), [&](const std::string& word) {
           return is_unit(word) || is_one_of_these(word, kBeside);
         });
}

bool is_total(const Cell& cell) {
  // clang-format would put each word in a line of its own.
  // clang-format off
  constexpr auto kWords = std::to_array<std::string_view>({
      // English
      "total", "totals", "subtotal", "grand total", "sum", "average", "avg", "mean", "median", "minimum",
      "maximum", "min", "max", "range", "span", "count", "std", "stdev", "stddev", "std dev",
      "standard deviation", "sigma", "variance", "extents", "bounding box",
      // German
      "summe", "gesamt", "gesamtergebnis", "ergebnis", "teilergebnis", "zwischensumme", "anzahl", "mittel",
      "mittelwert", "durchschnitt", "spannweite", "standardabweichung", "gesamtsumme", "stdabw", "std abw",
      // French, Italian, Spanish, Portuguese
      "totaux", "sous-total", "somme", "moyenne", "moy", "nombre", "\u00e9cart-type", "total g\u00e9n\u00e9ral",
      "totale", "somma", "media", "suma", "total general", "soma", "total geral",
      // other languages of Latin letters
      "totaal", "eindtotaal", "totalt", "i alt", "yhteens\u00e4", "celkem", "suma ko\u0144cowa",
      "\u00f6sszeg", "\u00f6sszesen", "toplam",
      // signs, Greek and Cyrillic letters
      "\u00f8", "x\u0304", "\u03c3", "\u03a3", "\u0438\u0442\u043e\u0433\u043e",
      "\u043e\u0431\u0449\u0438\u0439 \u0438\u0442\u043e\u0433", "\u0441\u0443\u043c\u043c\u0430",
      // Chinese, Japanese, Korean
      "\u5408\u8ba1", "\u603b\u8ba1", "\u5c0f\u8ba1", "\u5408\u8a08", "\u7dcf\u8a08", "\u5c0f\u8a08",
      "\u5e73\u5747", "\ud569\uacc4"});
  // clang-format on
  constexpr std::array<std::string_view, 17> kBeside = {
      "x",   "y",    "xy",    "of",     "the",   "and",    "und",      "bump",     "bumps",
      "pad", "pads", "point", "points", "value", "values", "position", "positions"};
  std::string text = plain_name(cell);
  text.resize(std::min(text.find_first_of(":=("), text.size()));
  std::erase(text, '.');  // "avg.", "std. dev."
  if (is_one_of_these(trimmed(text), kWords)) return true;
  // "Total bumps", "Summe X/Y"
  const std::vector<std::string> words = words_of_name({text, std::nullopt});
  const auto is_word = [&](const std::string& word) {
    return is_one_of_these(word, kWords) || word == "number";
  };
  return words.size() > 1 && std::any_of(words.begin(), words.end(), is_word) &&
         std::all_of(words.begin(), words.end(), [&](const std::string& word) {
           return is_word(word) || is_one_of_these(word, kBeside);
         });
}

}  // namespace meltstage::motion::detail
