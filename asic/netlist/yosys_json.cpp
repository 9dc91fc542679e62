// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/yosys_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage::yosys {

namespace {

using nlohmann::json;

constexpr const char* kWanted = "a netlist of Yosys' write_json";
constexpr std::size_t kMostNested = 64;  // objects and arrays

// Walks over the text for the JSON parser and tells how far it has come.
class Cursor {
 public:
  using iterator_category = std::forward_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  Cursor() = default;
  Cursor(const char* at, const char** reached) : at_(at), reached_(reached) {}
  reference operator*() const { return *at_; }
  Cursor& operator++() {
    *reached_ = ++at_;
    return *this;
  }
  Cursor operator++(int) {
    const Cursor before = *this;
    ++*this;
    return before;
  }
  friend bool operator==(const Cursor& a, const Cursor& b) { return a.at_ == b.at_; }

 private:
  const char* at_ = nullptr;
  const char** reached_ = nullptr;
};

struct Draft {
  Module module;
  bool is_black_box = false;
  bool is_top = false;
  Place place;
};

// Takes the parser's events. path_ holds the keys from the root to where it stands: modules, MODULE, ports,
// PORT, bits.
class Reader : public nlohmann::json_sax<json> {
 public:
  Reader(std::string_view text, const std::string& file) : text_(text), file_(file), reached_(text.data()) {}

  Module read() {
    json::sax_parse(Cursor(text_.data(), &reached_), Cursor(text_.data() + text_.size(), &reached_), this);
    if (!has_modules_) fail("no \"modules\"", kWanted);
    const Draft& found = top();
    check(found);
    Module module = found.module;
    module.directions = directions_of(module);
    return module;
  }

  bool null() override { return other("null"); }
  bool boolean(bool value) override {
    if (is_in("attributes", 4)) mark(value);
    return other(value ? "true" : "false");
  }
  bool number_integer(number_integer_t value) override { return number(value); }
  bool number_unsigned(number_unsigned_t value) override {
    return number(value > std::numeric_limits<std::int64_t>::max() ? std::numeric_limits<std::int64_t>::max()
                                                                   : static_cast<std::int64_t>(value));
  }
  bool number_float(number_float_t, const string_t& text) override { return other(text); }
  bool string(string_t& text) override {
    if (is_bits()) {
      take(text == "0"   ? kZero
           : text == "1" ? kOne
           : text == "x" ? kUnknown
                         : wrong(fmt::format("bit \"{}\"", shown(text))));
    } else if (is_in("ports", 5) && path_.back() == "direction") {
      port().is_input = text == "input";
      directed_.emplace(path_[1], path_[3]);
      if (text != "input" && text != "output")
        odd_ports_.try_emplace(
            {path_[1], path_[3]},
            defect_at(file_, place(), fmt::format("port {}: {}", shown(path_[3]), shown(text)),
                      "input or output; split it"));
    } else if (is_in("cells", 5) && path_.back() == "type") {
      cell().type = escaped(text);
    } else if (is_in("cells", 6) && path_[4] == "port_directions") {
      if (text != "input" && text != "output" && text != "inout")
        fail(fmt::format("direction {} of cell {}/{}", shown(text), shown(path_[3]), shown(path_[5])),
             "input, output or inout");
      directions_[{path_[1], path_[3]}][path_[5]] = text;
    } else if (is_in("attributes", 4)) {
      mark(text.find_first_not_of('0') != std::string::npos);  // Yosys writes numbers in bits
    }
    return true;
  }
  bool binary(binary_t&) override { return other("binary data"); }

  bool start_object(std::size_t) override {
    if (is_bits()) wrong("an object");
    deeper();
    const std::size_t keys = path_.size();
    if (keys == 1 && path_[0] == "modules") has_modules_ = true;
    if (keys == 2 && path_[0] == "modules") {
      drafts_.emplace(path_[1], Draft{});
      draft().module.name = path_[1];
      draft().place = place();
    }
    if (is_in("ports", 4)) draft().module.ports.try_emplace(path_[3]);
    if (is_in("cells", 4)) draft().module.cells.try_emplace(path_[3]);
    if (is_in("netnames", 4)) draft().module.net_names.try_emplace(path_[3]);
    keys_.emplace_back();
    path_.emplace_back();
    return true;
  }
  bool key(string_t& text) override {
    if (std::any_of(text.begin(), text.end(), [](char c) { return (c >= 0 && c <= ' ') || c == '\x7F'; }))
      fail(fmt::format("name \"{}\"", shown(text)), "one without blanks and control characters");
    path_.back() = text;
    // the parser would take the last of two
    if (!keys_.back().insert(text).second)
      fail(fmt::format("{} {} again", kind(), shown(text)), "each name once");
    return true;
  }
  bool end_object() override {
    path_.pop_back();
    keys_.pop_back();
    --depth_;
    return true;
  }
  bool start_array(std::size_t) override {
    if (is_bits()) wrong("a list");
    deeper();
    if (bits_depth_ == 0 && is_bits_key()) {
      bits_depth_ = depth_;
      pin_bits_ = 0;
    }
    return true;
  }
  bool end_array() override {
    if (bits_depth_ == depth_) bits_depth_ = 0;
    --depth_;
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& error) override {
    const std::string text = error.what();
    const std::size_t detail = text.find(": ", text.find("column"));
    fail(fmt::format("no JSON ({})", shown(detail == std::string::npos ? text : text.substr(detail + 2))),
         kWanted);
  }

 private:
  std::size_t text_offset() const {
    const auto behind = static_cast<std::size_t>(reached_ - text_.data());
    return behind == 0 ? 0 : behind - 1;
  }
  Place place() const { return place_of(text_, text_offset()); }
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw UserError(defect_at(file_, place(), found, expected));
  }
  /// What the key that was read names.
  const char* kind() const {
    if (path_.size() == 2 && path_[0] == "modules") return "module";
    if (is_in("ports", 4)) return "port";
    if (is_in("cells", 4)) return "cell";
    return is_in("netnames", 4) ? "net name" : "key";
  }
  [[noreturn]] Bit wrong(const std::string& found) const {
    fail(found, fmt::format("a net from 2 to {}, \"0\", \"1\" or \"x\"", kMostNets));
  }
  void deeper() {
    if (++depth_ > kMostNested)
      fail(fmt::format("objects and lists {} deep", depth_), fmt::format("at most {}", kMostNested));
  }

  bool is_in(std::string_view section, std::size_t keys) const {
    return path_.size() == keys && path_[0] == "modules" && path_[2] == section;
  }
  bool is_bits_key() const {
    return (path_.size() == 5 && path_.back() == "bits" && (is_in("ports", 5) || is_in("netnames", 5))) ||
           (path_.size() == 6 && is_in("cells", 6) && path_[4] == "connections");
  }
  bool is_bits() const { return bits_depth_ != 0 && bits_depth_ == depth_; }
  Draft& draft() { return drafts_.at(path_[1]); }
  Port& port() { return draft().module.ports.at(path_[3]); }
  Cell& cell() { return draft().module.cells.at(path_[3]); }
  NetName& net_name() { return draft().module.net_names.at(path_[3]); }

  // An attribute of a module.
  void mark(bool set) {
    if (path_.back() == "blackbox" || path_.back() == "whitebox") draft().is_black_box |= set;
    if (path_.back() == "top") draft().is_top |= set;
  }
  // The one that is marked, or the only one; of several nobody but the user knows which.
  const Draft& top() const {
    std::vector<const Draft*> marked, designs;
    for (const auto& [name, draft] : drafts_) {
      if (draft.is_black_box) continue;
      designs.push_back(&draft);
      if (draft.is_top) marked.push_back(&draft);
    }
    if (designs.empty()) fail("black boxes alone", "a design");
    const std::vector<const Draft*>& left = marked.empty() ? designs : marked;
    if (left.size() == 1) return *left[0];
    const auto named = [&](std::size_t i) {
      return fmt::format("{} (line {})", shown(left[i]->module.name), left[i]->place.line);
    };
    throw UserError(defect_at(
        file_, left[1]->place,
        marked.empty() ? fmt::format("{} modules, {} and {}, none of them marked as the top", left.size(),
                                     named(0), named(1))
                       : fmt::format("modules {} and {} both marked as the top", named(0), named(1)),
        "one; flatten the design with Yosys' synth -flatten -top NAME"));
  }

  bool number(std::int64_t value) {
    if (is_bits()) {
      if (value < 2 || value > kMostNets) wrong(fmt::format("net {}", value));
      take(static_cast<Bit>(value));
    } else if (path_.size() == 5 && path_.back() == "offset" && (is_in("ports", 5) || is_in("netnames", 5))) {
      constexpr std::int64_t kMostOffset = 1'000'000'000;
      if (value < -kMostOffset || value > kMostOffset)
        fail(fmt::format("offset {}", value), fmt::format("one of at most {}", kMostOffset));
      (is_in("ports", 5) ? static_cast<Wire&>(port()) : net_name()).offset = static_cast<int>(value);
    } else if (path_.size() == 5 && path_.back() == "upto" && (is_in("ports", 5) || is_in("netnames", 5))) {
      (is_in("ports", 5) ? static_cast<Wire&>(port()) : net_name()).rises = value != 0;
    } else if (is_in("netnames", 5) && path_.back() == "hide_name") {
      net_name().is_hidden = value != 0;
    } else if (is_in("attributes", 4)) {
      mark(value != 0);
    }
    return true;
  }
  bool other(const std::string& text) {
    if (is_bits()) wrong(fmt::format("bit {}", text));
    return true;
  }
  void take(Bit bit) {
    if (is_in("ports", 5)) {
      port().bits.push_back(bit);
    } else if (is_in("netnames", 5)) {
      net_name().bits.push_back(bit);
    } else {
      if (++pin_bits_ == 2)
        wide_pins_.try_emplace(
            path_[1],
            defect_at(
                file_, place(), fmt::format("cell {}/{}: several bits", shown(path_[3]), shown(path_[5])),
                "a mapped netlist with one bit a pin; map it to the library (abc -liberty, dfflibmap)"));
      cell().pins[path_[5]] = bit;
    }
  }
  // By type of cell: what its cells say of its pins. Two that differ have no type in common.
  std::map<std::string, Directions> directions_of(const Module& module) const {
    std::map<std::string, Directions> by_type;
    for (const auto& [name, cell] : module.cells) {
      const auto said = directions_.find({module.name, name});
      if (said == directions_.end()) continue;
      for (const auto& [pin, direction] : said->second) {
        const auto [first, is_new] = by_type[cell.type].try_emplace(pin, direction);
        if (first->second != direction)
          throw UserError(fmt::format("{}: cell {}/{}: found {}, expected {} as in another cell of {}", file_,
                                      shown(name), shown(pin), direction, first->second, shown(cell.type)));
      }
    }
    return by_type;
  }
  // Black boxes may have what the design itself may not.
  void check(const Draft& draft) const {
    for (const auto& [where, message] : odd_ports_) {
      if (where.first == draft.module.name) throw UserError(message);
    }
    for (const auto& [name, port] : draft.module.ports) {
      if (port.bits.empty() || directed_.count({draft.module.name, name}) == 0)
        throw UserError(fmt::format("{}: port {}: found no {}, expected one", file_, shown(name),
                                    port.bits.empty() ? "bit" : "direction"));
    }
    const auto wide = wide_pins_.find(draft.module.name);
    if (wide != wide_pins_.end()) throw UserError(wide->second);
    for (const auto& [name, cell] : draft.module.cells) {
      if (cell.type.empty())
        throw UserError(
            fmt::format("{}: cell {}: found no type, expected one of the library", file_, shown(name)));
    }
  }

  std::string_view text_;
  const std::string& file_;
  const char* reached_;
  std::vector<std::string> path_;
  std::vector<std::set<std::string>> keys_;  // that were read, of each object around
  std::size_t depth_ = 0;
  std::size_t bits_depth_ = 0;  // of the list of bits that is read; 0: none
  std::size_t pin_bits_ = 0;
  bool has_modules_ = false;
  std::map<std::string, Draft> drafts_;
  std::set<std::pair<std::string, std::string>> directed_;                // module and port
  std::map<std::pair<std::string, std::string>, std::string> odd_ports_;  // likewise
  std::map<std::pair<std::string, std::string>, Directions> directions_;  // of module and cell
  std::map<std::string, std::string> wide_pins_;                          // the first of a module
};

}  // namespace

Module parse_top_module(std::string_view text, const std::string& file) { return Reader(text, file).read(); }

Module read_top_module(const std::filesystem::path& path) {
  return parse_top_module(read_file(path, kWanted), path.string());
}

std::string quoted(const std::string& name) { return json(name).dump(); }

}  // namespace meltstage::yosys
