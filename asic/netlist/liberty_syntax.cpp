// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/liberty_syntax.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "base/byte_order_mark.hpp"
#include "base/error.hpp"
#include "base/number.hpp"

namespace meltstage::liberty {

namespace {

constexpr std::size_t kMostNested = 32;  // groups; libraries have up to seven
constexpr double kMostNumber = 1e30;

bool is_blank(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }
bool is_control(char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0 && !is_blank(c); }

class Parser {
 public:
  Parser(std::string_view text, const std::string& file)
      : text_(without_byte_order_mark(text)), file_(file) {}

  Group whole() {
    Group top;
    statement(top, 0);
    if (top.groups.size() != 1 || top.groups[0].name != "library")
      fail(0, "no library group", "library (NAME) { ... }");
    return std::move(top.groups[0]);
  }

 private:
  // Lines are counted on from the last place that was asked for.
  Place place(std::size_t offset) {
    if (offset < known_offset_) known_offset_ = 0, known_ = {};
    const Place further = place_of(text_.substr(known_offset_), offset - known_offset_);
    known_.column = further.line == 1 ? known_.column + further.column - 1 : further.column;
    known_.line += further.line - 1;
    known_offset_ = offset;
    return known_;
  }
  [[noreturn]] void fail(std::size_t offset, const std::string& found, const std::string& expected) {
    throw UserError(defect_at(file_, place(offset), found, expected));
  }
  std::string here() const {
    return at_ < text_.size() ? fmt::format("\"{}\"", shown(text_.substr(at_, 1))) : "the end of the file";
  }
  char peek() {
    while (at_ < text_.size()) {
      if (is_blank(text_[at_]) || text_[at_] == '\\') {
        ++at_;
      } else if (text_.substr(at_, 2) == "/*") {
        const std::size_t end = text_.find("*/", at_ + 2);
        if (end == std::string_view::npos) fail(at_, "an open comment", "*/");
        at_ = end + 2;
      } else if (text_.substr(at_, 2) == "//") {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else {
        return text_[at_];
      }
    }
    return '\0';
  }
  bool take(char c) {
    if (peek() != c || at_ == text_.size()) return false;
    ++at_;
    return true;
  }

  std::string name() {
    peek();
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_blank(text_[at_]) && !is_control(text_[at_]) &&
           std::string_view(":;,(){}\"\\").find(text_[at_]) == std::string_view::npos)
      ++at_;
    if (at_ == begin) fail(at_, here(), "a name");
    return std::string(text_.substr(begin, at_ - begin));
  }

  // Up to one of `stops` outside quotes; quotes and the line ends of continued lists are taken out.
  std::string value(std::string_view stops) {
    std::string found;
    peek();
    while (at_ < text_.size() && stops.find(text_[at_]) == std::string_view::npos) {
      const char c = text_[at_];
      if (c == '"') {
        const std::size_t end = text_.find('"', at_ + 1);
        if (end == std::string_view::npos) fail(at_, "an open string", "\"");
        for (const char quoted : text_.substr(at_ + 1, end - at_ - 1)) {
          if (quoted != '\\') found += quoted;
        }
        at_ = end + 1;
      } else {
        if (c != '\\') found += c;
        ++at_;
      }
    }
    if (std::any_of(found.begin(), found.end(), is_control))
      fail(at_, fmt::format("control characters in \"{}\"", shown(found)), "text");
    while (!found.empty() && is_blank(found.back())) found.pop_back();
    return found;
  }

  void statement(Group& parent, std::size_t depth) {
    peek();
    const std::size_t begin = at_;
    std::string word = name();
    if (take(':')) {
      parent.attributes.push_back({std::move(word), {value(";}\n")}, place(begin)});
      take(';');
      return;
    }
    if (!take('(')) fail(at_, here(), "\":\" or \"(\"");
    std::vector<std::string> list;
    while (!take(')')) {
      if (at_ == text_.size()) fail(begin, "an open argument list", "\")\"");
      list.push_back(value(",)"));
      take(',');
    }
    if (take('{')) {
      if (depth == kMostNested)
        fail(begin, fmt::format("groups {} deep", depth + 1), fmt::format("at most {}", kMostNested));
      Group group{std::move(word), std::move(list), {}, {}, place(begin)};
      while (!take('}')) {
        if (at_ == text_.size()) fail(begin, "group " + shown(group.name) + " left open", "\"}\"");
        statement(group, depth + 1);
      }
      parent.groups.push_back(std::move(group));
    } else {
      parent.attributes.push_back({std::move(word), std::move(list), place(begin)});
    }
    take(';');
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  std::size_t known_offset_ = 0;
  Place known_;
};

double number_of(std::string_view text, const Attribute& attribute, const std::string& file) {
  const auto value = number_in(text, -kMostNumber, kMostNumber);
  if (!value)
    throw UserError(defect_at(file, attribute.place,
                              fmt::format("{} \"{}\"", shown(attribute.name), shown(text)),
                              fmt::format("a number of at most {:g}", kMostNumber)));
  return *value;
}

template <class Items>
auto first_of(const Items& items, std::string_view name) -> decltype(items.data()) {
  const auto found = std::find_if(items.begin(), items.end(), [&](const auto& i) { return i.name == name; });
  return found == items.end() ? nullptr : &*found;
}

}  // namespace

const Attribute* Group::find(std::string_view attribute) const { return first_of(attributes, attribute); }
const Attribute* Group::only(std::string_view attribute, const std::string& file) const {
  const Attribute* const first = find(attribute);
  if (first == nullptr) return nullptr;
  for (const Attribute& other : attributes) {
    if (other.name == attribute && other.values != first->values)
      throw UserError(defect_at(
          file, other.place,
          fmt::format("{} again, other than in line {}", shown(attribute), first->place.line), "it once"));
  }
  return first;
}
const Group* Group::find_group(std::string_view group) const { return first_of(groups, group); }

std::string Group::label() const { return arguments.empty() ? "" : arguments[0]; }

std::string Group::text(std::string_view attribute) const {
  const Attribute* const found = find(attribute);
  return found == nullptr || found->values.empty() ? "" : found->values[0];
}

double Group::number(std::string_view attribute, const std::string& file) const {
  const Attribute* const found = only(attribute, file);
  return found == nullptr || found->values.empty() ? 0.0 : number_of(found->values[0], *found, file);
}

std::vector<double> Group::numbers(std::string_view attribute, const std::string& file) const {
  std::vector<double> list;
  const Attribute* const found = only(attribute, file);
  if (found == nullptr) return list;
  for (const std::string& value : found->values) {
    constexpr std::string_view kBetween = ", \t\r\n";
    for (std::size_t at = value.find_first_not_of(kBetween); at != std::string::npos;) {
      const std::size_t end = std::min(value.find_first_of(kBetween, at), value.size());
      list.push_back(number_of(std::string_view(value).substr(at, end - at), *found, file));
      at = value.find_first_not_of(kBetween, end);
    }
  }
  return list;
}

Group parse(std::string_view text, const std::string& file) { return Parser(text, file).whole(); }

}  // namespace meltstage::liberty
