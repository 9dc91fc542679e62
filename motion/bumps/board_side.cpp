// SPDX-License-Identifier: Apache-2.0
// The sides of a board, as layout systems name them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

/// "Top(1)": the number of the layer behind its name.
std::string_view without_number(std::string_view word) {
  const auto open = word.find_last_of('(');
  if (open == std::string_view::npos || !word.ends_with(')')) return word;
  const std::string_view inside = word.substr(open + 1, word.size() - open - 2);
  return inside.find_first_not_of("0123456789") == std::string_view::npos ? word.substr(0, open) : word;
}

/// In small letters, without the marks that layout systems write between words.
std::string letters_of(std::string_view word) {
  constexpr std::string_view kMarks = " \t_-./()";
  std::string small;
  for (const char c : in_small_letters(without_number(trimmed(word))))
    if (kMarks.find(c) == std::string_view::npos) small += c;
  return small;
}

// Of the top and of the bottom, in any column: English, KiCad's layers, German, French, Chinese, Japanese,
// Polish, Czech, Russian, Turkish, Swedish, Finnish, Korean.
constexpr std::array<std::string_view, 43> kTopWords = {"top",
                                                        "front",
                                                        "componentside",
                                                        "compside",
                                                        "primaryside",
                                                        "upperside",
                                                        "fcu",
                                                        "fpaste",
                                                        "fmask",
                                                        "fsilks",
                                                        "ffab",
                                                        "fadhes",
                                                        "oben",
                                                        "oberseite",
                                                        "topseite",
                                                        "vorne",
                                                        "vorderseite",
                                                        "best\u00fcckungsseite",
                                                        "bestueckungsseite",
                                                        "dessus",
                                                        "faceavant",
                                                        "facesuperieure",
                                                        "\u9876\u5c42",
                                                        "\u9876\u9762",
                                                        "\u6b63\u9762",
                                                        "\u90e8\u54c1\u9762",
                                                        "\u8868\u9762",
                                                        "g\u00f3ra",
                                                        "horn\u00ed",
                                                        "\u0432\u0435\u0440\u0445",
                                                        "\u0412\u0435\u0440\u0445",
                                                        "\u0432\u0435\u0440\u0445\u043d\u044f\u044f",
                                                        "\u0412\u0435\u0440\u0445\u043d\u044f\u044f",
                                                        "\u0432\u0435\u0440\u0445\u043d\u0438\u0439",
                                                        "\u0412\u0435\u0440\u0445\u043d\u0438\u0439",
                                                        "\u00fcst",
                                                        "ovan",
                                                        "ovansida",
                                                        "toppsida",
                                                        "yl\u00e4",
                                                        "yl\u00e4puoli",
                                                        "\uc717\uba74",
                                                        "\uc0c1\uba74"};
constexpr std::array<std::string_view, 47> kBottomWords = {"bottom",
                                                           "bot",
                                                           "btm",
                                                           "back",
                                                           "solderside",
                                                           "soldside",
                                                           "secondaryside",
                                                           "lowerside",
                                                           "bcu",
                                                           "bpaste",
                                                           "bmask",
                                                           "bsilks",
                                                           "bfab",
                                                           "badhes",
                                                           "unten",
                                                           "unterseite",
                                                           "bottomseite",
                                                           "hinten",
                                                           "r\u00fcckseite",
                                                           "rueckseite",
                                                           "l\u00f6tseite",
                                                           "loetseite",
                                                           "dessous",
                                                           "faceinferieure",
                                                           "\u5e95\u5c42",
                                                           "\u5e95\u9762",
                                                           "\u53cd\u9762",
                                                           "\u80cc\u9762",
                                                           "\u534a\u7530\u9762",
                                                           "\u88cf\u9762",
                                                           "d\u00f3\u0142",
                                                           "spodn\u00ed",
                                                           "doln\u00ed",
                                                           "\u043d\u0438\u0437",
                                                           "\u041d\u0438\u0437",
                                                           "\u043d\u0438\u0436\u043d\u044f\u044f",
                                                           "\u041d\u0438\u0436\u043d\u044f\u044f",
                                                           "\u043d\u0438\u0436\u043d\u0438\u0439",
                                                           "\u041d\u0438\u0436\u043d\u0438\u0439",
                                                           "alt",
                                                           "under",
                                                           "undersida",
                                                           "bottensida",
                                                           "ala",
                                                           "alapuoli",
                                                           "\uc544\ub7ab\uba74",
                                                           "\ud558\uba74"};
// Words beside them that leave the side what it is: "Top Layer", "Bottom Side SMD".
constexpr std::array<std::string_view, 19> kWordsBeside = {
    "side",  "layer",      "smd",    "smt",        "tht",      "copper", "paste",
    "mask",  "soldermask", "solder", "overlay",    "assembly", "silk",   "silkscreen",
    "mount", "mounted",    "board",  "components", "parts"};

// Of a side alone where a column is named after it: English, French, Spanish, Italian.
constexpr auto kTopHints = std::to_array<std::string_view>({"t",
                                                            "f",
                                                            "ts",
                                                            "component",
                                                            "comp",
                                                            "primary",
                                                            "upper",
                                                            "recto",
                                                            "composant",
                                                            "composants",
                                                            "haut",
                                                            "superieur",
                                                            "sup\u00e9rieur",
                                                            "superieure",
                                                            "sup\u00e9rieure",
                                                            "superior",
                                                            "arriba",
                                                            "componentes",
                                                            "sopra",
                                                            "superiore"});
constexpr auto kBottomHints = std::to_array<std::string_view>(
    {"b", "solder", "sold", "secondary", "lower", "verso", "soudure", "soudures", "bas", "inferieur",
     "inf\u00e9rieur", "inferieure", "inf\u00e9rieure", "inferior", "abajo", "soldadura", "sotto",
     "inferiore"});

template <class Words>
bool holds(const Words& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::optional<Side> side_of_letters(std::string_view letters) {
  if (holds(kTopWords, letters)) return Side::top;
  if (holds(kBottomWords, letters)) return Side::bottom;
  return std::nullopt;
}

/// Takes one word of kWordsBeside away, behind the rest or before it; false if there is none.
bool drop_word_beside(std::string_view& letters) {
  for (const std::string_view word : kWordsBeside) {
    if (letters.size() <= word.size()) continue;
    if (letters.ends_with(word)) return letters.remove_suffix(word.size()), true;
    if (letters.starts_with(word)) return letters.remove_prefix(word.size()), true;
  }
  return false;
}

}  // namespace

std::string in_small_letters(std::string_view text) {
  constexpr unsigned char kLatin = 0xC3, kFirst = 0x80, kLast = 0x9E, kTimes = 0x97, kToSmall = 0x20;
  std::string small;
  unsigned char before = 0;
  for (const char letter : text) {
    const auto c = static_cast<unsigned char>(letter);
    const bool capital =
        before == kLatin && c >= kFirst && c <= kLast && c != kTimes;  // of UTF-8: \u00c4, \u00d6 ...
    small += static_cast<char>(capital ? c + kToSmall : std::tolower(c));
    before = c;
  }
  return small;
}

std::optional<Side> side_unmistakably_named(std::string_view word) {
  const std::string text = letters_of(word);
  std::string_view letters = text;
  do {
    if (const auto side = side_of_letters(letters)) return side;
  } while (drop_word_beside(letters));
  return std::nullopt;
}

std::optional<Side> side_named(std::string_view word) {
  const std::string text = letters_of(word);
  if (holds(kTopHints, text)) return Side::top;
  if (holds(kBottomHints, text)) return Side::bottom;
  return side_unmistakably_named(word);
}

std::string_view name_of(Side side) { return side == Side::top ? "top" : "bottom"; }

void lie_on(std::vector<RawPoint>& points, Side side) {
  for (RawPoint& point : points)
    if (!point.side) point.side = side;
}

}  // namespace meltstage::motion::detail
