// SPDX-License-Identifier: Apache-2.0
// Points and circles out of a drawing in DXF (ASCII): one bump at each of them, blocks written out.
// Reference: Autodesk, DXF Reference (group codes); object coordinates by its "arbitrary axis algorithm".
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/count.hpp"
#include "base/file.hpp"
#include "base/number.hpp"
#include "base/place.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

/// A group code and its value; `row` is the value's.
struct Group {
  int code = 0;
  std::string_view value;
  std::size_t row = 0;
};

std::vector<Group> groups_of(const std::filesystem::path& path, std::string_view content) {
  std::vector<Group> groups;
  int code = 0;
  bool has_code = false;
  for_lines(content, [&](const Line& line) {
    if (has_code) {
      if (code != 999) groups.push_back({code, trimmed(line.text), line.number});  // 999: a comment
      has_code = false;
      return;
    }
    const auto number = number_in(trimmed(line.text), -5, 1071);
    const bool behind_end = !groups.empty() && groups.back().code == 0 && groups.back().value == "EOF";
    if (behind_end && trimmed(line.text).empty()) return;
    if (behind_end)
      fail(path,
           fmt::format("row {}: found {}, expected nothing behind EOF", line.number, in_quotes(line.text)));
    if (!number)
      fail(path, fmt::format("row {}: found {}, expected a group code of DXF, such as 0", line.number,
                             in_quotes(line.text)));
    code = *number;
    has_code = true;
  });
  if (groups.empty() || groups.back().code != 0 || groups.back().value != "EOF")
    fail(path, "the file ends without EOF, expected it; the file may be cut off");
  return groups;
}

/// One entity: its name (code 0), and the groups from there to the next one's.
struct Entity {
  std::string_view kind;
  std::size_t row = 0;
  std::span<const Group> groups;

  /// The first of this code; what is read here stands once. None if there is none.
  const Group* find(int code) const {
    const auto at =
        std::find_if(groups.begin(), groups.end(), [&](const Group& group) { return group.code == code; });
    return at == groups.end() ? nullptr : &*at;
  }
};

struct Block {
  double x = 0.0, y = 0.0;  // base point
  std::string_view file;    // of an external reference: the drawing that holds what belongs here
  std::vector<Entity> entities;
};

/// From a block's own frame to the drawing's, in units of the drawing.
struct Frame {
  double xx = 1.0, xy = 0.0, yx = 0.0, yy = 1.0, x = 0.0, y = 0.0;

  std::pair<double, double> apply(double px, double py) const {
    return {xx * px + xy * py + x, yx * px + yy * py + y};
  }
  /// First `inner`, then this.
  Frame behind(const Frame& inner) const {
    const auto [ox, oy] = apply(inner.x, inner.y);
    return {xx * inner.xx + xy * inner.yx,
            xx * inner.xy + xy * inner.yy,
            yx * inner.xx + yy * inner.yx,
            yx * inner.xy + yy * inner.yy,
            ox,
            oy};
  }
};

/// A layer that a drawing doesn't show, as it is named there, and the bumps that aren't seen for it.
struct UnseenLayer {
  std::string name;
  bool frozen = false;  ///< else merely off
  std::size_t bumps = 0;
};

/// The insert that an entity stands in: its layer, the nearest frozen layer of it and the inserts around it,
/// and how many these are.
struct Holder {
  std::string_view layer;
  UnseenLayer* frozen = nullptr;
  std::size_t depth = 0;
};

class Drawing {
 public:
  explicit Drawing(const std::filesystem::path& path) : path_(path) {}

  RawPoints read(std::string_view content) && {
    const std::vector<Group> groups = groups_of(path_, content);
    for (std::size_t at = 0; at < groups.size();) {
      if (groups[at].code != 0 || groups[at].value != "SECTION") {
        ++at;
        continue;
      }
      std::size_t end = at + 1;
      while (end < groups.size() && !(groups[end].code == 0 && groups[end].value == "ENDSEC")) ++end;
      if (end == groups.size())
        fail(path_, fmt::format("row {}: the file ends inside the section that begins here", groups[at].row));
      if (at + 1 < end && groups[at + 1].code == 2)
        read_section(groups[at + 1].value, std::span(groups).subspan(at + 2, end - at - 2));
      at = end + 1;
    }
    for (const Entity& entity : entities_) draw(entity, {}, {});
    return finish();
  }

 private:
  void read_section(std::string_view name, std::span<const Group> groups) {
    if (name == "HEADER") read_header(groups);
    if (name == "TABLES") read_layers(entities_of(groups));
    if (name == "BLOCKS") read_blocks(entities_of(groups));
    if (name == "ENTITIES") {
      const std::vector<Entity> more = entities_of(groups);
      entities_.insert(entities_.end(), more.begin(), more.end());
    }
  }

  static std::vector<Entity> entities_of(std::span<const Group> groups) {
    std::vector<Entity> entities;
    for (std::size_t at = 0; at < groups.size();) {
      std::size_t end = at + 1;
      while (end < groups.size() && groups[end].code != 0) ++end;
      if (groups[at].code == 0)
        entities.push_back({groups[at].value, groups[at].row, groups.subspan(at + 1, end - at - 1)});
      at = end;
    }
    return entities;
  }

  // ---- header, layers, blocks ----

  /// Lengths of $INSUNITS; 0 says none.
  void read_header(std::span<const Group> groups) {
    static const std::map<int, double> kUnits_mm = {{1, kInch_mm}, {2, 304.8},   {4, 1.0},    {5, 10.0},
                                                    {6, 1000.0},   {8, 25.4e-6}, {9, 0.0254}, {12, 1e-6},
                                                    {13, 1e-3},    {14, 100.0}};
    for (std::size_t i = 0; i + 1 < groups.size(); ++i) {
      if (groups[i].code != 9 || groups[i].value != "$INSUNITS") continue;
      const Group& unit = groups[i + 1];
      const auto number = unit.code == 70 ? number_in(unit.value, 0, 99) : std::nullopt;
      if (number == 0) return;
      const auto known = kUnits_mm.find(number.value_or(-1));
      if (known == kUnits_mm.end())
        fail(path_,
             fmt::format(
                 "row {} ($INSUNITS): found {}, expected the number of a unit: 1 (inch), 2, 4 (mm), 5, 6, "
                 "8, 9 (mil), 12, 13 (um) or 14",
                 unit.row, in_quotes(unit.value)));
      if (has_unit_ && unit_mm_ != known->second)
        fail(path_,
             fmt::format("row {} ($INSUNITS): found {}, expected one unit, as a row before has another",
                         unit.row, in_quotes(unit.value)));
      unit_mm_ = known->second;
      has_unit_ = true;
    }
  }

  void read_layers(const std::vector<Entity>& entries) {
    for (const Entity& entry : entries) {
      const Group* name = entry.find(2);
      if (entry.kind != "LAYER" || name == nullptr) continue;
      const bool frozen = (whole(entry, 70, 0) & 1) != 0, off = whole(entry, 62, 7) < 0;
      if (frozen || off)
        unseen_layers_.try_emplace(in_small_letters(name->value),
                                   UnseenLayer{std::string(name->value), frozen, 0});
    }
  }

  void read_blocks(const std::vector<Entity>& entities) {
    Block* block = nullptr;
    for (const Entity& entity : entities) {
      if (entity.kind == "BLOCK") {
        const Group* name = entity.find(2);
        if (name == nullptr) fail_at(entity, "a block without a name", "one (group code 2)");
        block = &blocks_[in_small_letters(name->value)];
        *block = {number(entity, 10, 0.0), number(entity, 20, 0.0), external_file(entity), {}};
      } else if (entity.kind == "ENDBLK") {
        block = nullptr;
      } else if (block != nullptr) {
        block->entities.push_back(entity);
      }
    }
  }

  std::string_view external_file(const Entity& block) const {
    constexpr int kExternal = 4, kOverlay = 8;
    const Group* file = block.find(1);
    if ((whole(block, 70, 0) & (kExternal | kOverlay)) == 0) return {};
    return file == nullptr || file->value.empty() ? "without a name" : file->value;
  }

  // ---- entities ----

  void draw(const Entity& entity, const Frame& frame, const Holder& holder) {
    // Parts of the entity before them, and what stands in a frame around the drawing.
    constexpr std::array<std::string_view, 3> kParts = {"VERTEX", "SEQEND", "ATTRIB"};
    if (std::find(kParts.begin(), kParts.end(), entity.kind) != kParts.end()) return;
    if (whole(entity, 67, 0) == 1)
      return leave_out("entity of the paper space", "entities of the paper space", entity);
    if (whole(entity, 60, 0) == 1 && hidden_++ == 0) first_hidden_ = entity.row;
    const Group* stated = entity.find(8);
    std::string_view layer = stated == nullptr ? "0" : stated->value;
    if (layer == "0" && !holder.layer.empty()) layer = holder.layer;
    if (entity.kind == "POINT" || entity.kind == "CIRCLE")
      add(entity, frame, layer, holder.frozen);
    else if (entity.kind == "INSERT")
      insert(entity, frame, layer, holder);
    else
      leave_out(shown(entity.kind), shown(entity.kind) + "s", entity);
  }

  /// Object coordinates of a flat drawing: seen from above, or from below, where x is turned round.
  double x_sign(const Entity& entity) const {
    const double nx = number(entity, 210, 0.0), ny = number(entity, 220, 0.0), nz = number(entity, 230, 1.0);
    constexpr double kFlat = 1e-6;
    if (std::abs(nx) > kFlat || std::abs(ny) > kFlat || std::abs(std::abs(nz) - 1.0) > kFlat)
      fail_at(entity, fmt::format("the extrusion ({:g}, {:g}, {:g})", nx, ny, nz),
              "one along z: a flat drawing");
    return nz > 0.0 ? 1.0 : -1.0;
  }

  /// Null for a layer that is seen.
  UnseenLayer* unseen(std::string_view layer) {
    const auto found = unseen_layers_.find(in_small_letters(layer));
    return found == unseen_layers_.end() ? nullptr : &found->second;
  }

  /// An insert in a frozen layer hides all that it holds; in one that is off, only what belongs to that.
  void add(const Entity& entity, const Frame& frame, std::string_view layer, UnseenLayer* frozen_around) {
    // A point's place is the drawing's own, whatever its extrusion.
    const double sign = entity.kind == "POINT" ? 1.0 : x_sign(entity);
    const auto [x, y] = frame.apply(sign * required(entity, 10), required(entity, 20));
    UnseenLayer* own = unseen(layer);
    if (UnseenLayer* hides = own != nullptr ? own : frozen_around; hides != nullptr) ++hides->bumps;
    result_.points.push_back({x * unit_mm_, y * unit_mm_, entity.row, std::nullopt, group_of(layer)});
    check_point_count(path_, result_.points.size());
  }

  std::uint32_t group_of(std::string_view layer) {
    const auto next = static_cast<std::uint32_t>(layers_.size());
    const auto [at, is_new] = layers_.try_emplace(in_small_letters(layer), next);
    if (is_new) result_.groups.emplace(next, layer);
    return at->second;
  }

  void insert(const Entity& entity, const Frame& frame, std::string_view layer, const Holder& around) {
    constexpr std::size_t kDeepest = 32;
    constexpr int kMost = 100'000;
    const Group* name = entity.find(2);
    const auto block = name == nullptr ? blocks_.end() : blocks_.find(in_small_letters(name->value));
    if (block == blocks_.end())
      fail_at(entity, fmt::format("block {}", name == nullptr ? "''" : in_quotes(name->value)),
              "one of the section BLOCKS");
    if (!block->second.file.empty() && block->second.entities.empty())
      fail_at(entity, fmt::format("the external drawing {}", in_quotes(block->second.file)),
              "what it holds in this file; bind the reference");
    if (around.depth == kDeepest) fail_at(entity, fmt::format("blocks nested {} deep", kDeepest), "fewer");
    const double sign = x_sign(entity);
    const double angle = number(entity, 50, 0.0), scale_x = number(entity, 41, 1.0),
                 scale_y = number(entity, 42, 1.0);
    // 0 is written for 1, too.
    const auto repeats = [&](int code) { return whole(entity, code, 1) == 0 ? 1 : whole(entity, code, 1); };
    const int columns = repeats(70), rows = repeats(71);
    if (columns < 1 || rows < 1 || columns > kMost || rows > kMost)
      fail_at(entity, fmt::format("{} columns and {} rows", columns, rows), fmt::format("1 to {}", kMost));
    const RawPoint along_x = turned({1.0, 0.0, 0}, angle), along_y = turned({0.0, 1.0, 0}, angle);
    UnseenLayer* own_layer = unseen(layer);
    const Holder holder{layer, own_layer != nullptr && own_layer->frozen ? own_layer : around.frozen,
                        around.depth + 1};
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        count_work(entity);
        const double dx = column * number(entity, 44, 0.0), dy = row * number(entity, 45, 0.0);
        Frame own{
            scale_x * along_x.x, scale_y * along_y.x, scale_x * along_x.y, scale_y * along_y.y, 0.0, 0.0};
        const auto [bx, by] = own.apply(block->second.x, block->second.y);
        own.x = required(entity, 10) + dx * along_x.x + dy * along_y.x - bx;
        own.y = required(entity, 20) + dx * along_x.y + dy * along_y.y - by;
        const Frame seen = frame.behind(Frame{sign, 0.0, 0.0, 1.0, 0.0, 0.0}.behind(own));
        for (const Entity& part : block->second.entities) {
          count_work(entity);
          draw(part, seen, holder);
        }
      }
  }

  /// Blocks in blocks multiply.
  void count_work(const Entity& entity) {
    constexpr std::size_t kMostDrawn = 4 * kMaxPoints;
    if (++drawn_ > kMostDrawn)
      fail_at(entity, fmt::format("more than {} entities in blocks", kMostDrawn), "at most so many");
  }

  // ---- values ----

  [[noreturn]] void fail_at(const Entity& entity, std::string_view found, std::string_view expected) const {
    fail(path_,
         fmt::format("row {} ({}): found {}, expected {}", entity.row, shown(entity.kind), found, expected));
  }

  double number(const Entity& entity, int code, double fallback) const {
    const Group* at = entity.find(code);
    if (at == nullptr) return fallback;
    const auto value = parse_number(at->value);
    if (!value || !std::isfinite(*value))
      fail(path_, fmt::format("row {} (group code {} of {}): found {}, expected a finite number such as 12.5",
                              at->row, code, shown(entity.kind), in_quotes(at->value)));
    return *value;
  }

  double required(const Entity& entity, int code) const {
    if (entity.find(code) == nullptr)
      fail_at(entity, fmt::format("no {}", code == 10 ? "x" : "y"), fmt::format("one (group code {})", code));
    return number(entity, code, 0.0);
  }

  int whole(const Entity& entity, int code, int fallback) const {
    const Group* at = entity.find(code);
    if (at == nullptr) return fallback;
    constexpr int kMost = 1'000'000;
    const auto value = number_in(at->value, -kMost, kMost);
    if (!value)
      fail(path_, fmt::format("row {} (group code {} of {}): found {}, expected a whole number", at->row,
                              code, shown(entity.kind), in_quotes(at->value)));
    return *value;
  }

  // ---- what is told ----

  struct LeftOut {
    std::string one, many;
    std::size_t count = 0, first_row = 0;
  };

  void leave_out(const std::string& one, const std::string& many, const Entity& entity) {
    const auto [at, is_new] = left_out_.try_emplace(one, LeftOut{one, many, 0, entity.row});
    ++at->second.count;
  }

  RawPoints finish() {
    result_.has_unit = has_unit_;
    for (const auto& [kind, left] : left_out_) {
      const std::string count =
          left.count == 1 ? "1 " + left.one : fmt::format("{} {}", left.count, left.many);
      result_.notes.push_back(fmt::format("{}, {}in row {}, {} no bump", count,
                                          left.count == 1 ? "" : "first ", left.first_row,
                                          left.count == 1 ? "holds" : "hold"));
    }
    for (const auto& [key, unseen] : unseen_layers_)
      if (unseen.bumps > 0)
        result_.notes.push_back(fmt::format("layer {} is off or frozen, and its {} {} taken all the same",
                                            in_quotes(unseen.name), counted(unseen.bumps, "bump"),
                                            unseen.bumps == 1 ? "is" : "are"));
    if (hidden_ > 0)
      result_.notes.push_back(
          fmt::format("{} hidden, first in row {}, and taken all the same",
                      hidden_ == 1 ? "1 entity is" : fmt::format("{} entities are", hidden_), first_hidden_));
    if (result_.points.empty())
      fail(path_, fmt::format("found no circle and no point{}, expected them: each is a bump",
                              left_out_.empty() ? "" : ", but " + left_out_.begin()->second.many));
    return std::move(result_);
  }

  const std::filesystem::path& path_;
  RawPoints result_;
  double unit_mm_ = 1.0;
  bool has_unit_ = false;
  // By their names in small letters: DXF knows no others.
  std::map<std::string, UnseenLayer> unseen_layers_;
  std::map<std::string, std::uint32_t> layers_;
  std::map<std::string, Block> blocks_;  // by its name in small letters
  std::vector<Entity> entities_;
  std::map<std::string, LeftOut> left_out_;
  std::size_t drawn_ = 0, hidden_ = 0, first_hidden_ = 0;
};

}  // namespace

RawPoints read_dxf_points(const std::filesystem::path& path, std::string_view content) {
  if (const auto kind = describe_content(content); kind != "text")
    fail(path, fmt::format("found {}, expected a drawing in ASCII DXF (.dxf)", kind));
  return Drawing(path).read(without_byte_order_mark(content));
}

}  // namespace meltstage::motion::detail
