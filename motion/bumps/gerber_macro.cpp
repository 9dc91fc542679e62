// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/gerber_macro.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <vector>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {
namespace {

/// A disc or ring, perhaps with gaps along the axes of its own frame, or what lies inside a polygon.
struct Shape {
  bool dark = true;
  double x = 0.0, y = 0.0, radius = 0.0;
  std::vector<RawPoint> corners{};
  double hole_radius = 0.0, gap = 0.0, angle_deg = 0.0;

  bool holds(double at_x, double at_y) const {
    return corners.empty() ? ring_holds(at_x, at_y) : polygon_holds(at_x, at_y);
  }

 private:
  bool ring_holds(double at_x, double at_y) const {
    const double distance = std::hypot(at_x - x, at_y - y);
    if (distance > radius || distance < hole_radius) return false;
    const RawPoint own = turned({at_x - x, at_y - y, 0}, -angle_deg);
    return gap == 0.0 || (std::abs(own.x) >= 0.5 * gap && std::abs(own.y) >= 0.5 * gap);
  }

  bool polygon_holds(double at_x, double at_y) const {
    bool inside = false;
    for (std::size_t i = 0, before = corners.size() - 1; i < corners.size(); before = i++) {
      const RawPoint &a = corners[before], &b = corners[i];
      if ((a.y > at_y) != (b.y > at_y) && at_x < a.x + (at_y - a.y) / (b.y - a.y) * (b.x - a.x))
        inside = !inside;
    }
    return inside;
  }
};

class Macro {
 public:
  Macro(std::span<const double> parameters, std::size_t& steps, const MacroDefect& defect)
      : steps_(steps), defect_(defect) {
    for (std::size_t i = 0; i < parameters.size(); ++i) variables_[i + 1] = parameters[i];
  }

  void run(std::string_view blocks) {
    while (!blocks.empty()) {
      const std::size_t end = std::min(blocks.find('*'), blocks.size());
      run_block(blocks.substr(0, end));
      blocks.remove_prefix(std::min(end + 1, blocks.size()));
    }
  }

  MacroCopper copper() const {
    double left = INFINITY, right = -INFINITY, low = INFINITY, high = -INFINITY;
    const auto add = [&](double x, double y, double radius) {
      left = std::min(left, x - radius), right = std::max(right, x + radius);
      low = std::min(low, y - radius), high = std::max(high, y + radius);
    };
    for (const Shape& shape : shapes_) {
      if (!shape.dark) continue;
      if (shape.corners.empty()) add(shape.x, shape.y, shape.radius);
      for (const RawPoint& corner : shape.corners) add(corner.x, corner.y, 0.0);
    }
    MacroCopper out;
    out.any = right >= left;
    if (!out.any) return out;
    out.x = 0.5 * (left + right);
    out.y = 0.5 * (low + high);
    out.on_middle = is_copper(out.x, out.y);
    out.on_origin = is_copper(0.0, 0.0);
    return out;
  }

 private:
  [[noreturn]] void fail(std::string_view found, std::string_view expected) const {
    defect_(found, expected);
    std::abort();  // a defect doesn't return
  }

  static bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

  bool is_copper(double x, double y) const {
    const auto last =
        std::find_if(shapes_.rbegin(), shapes_.rend(), [&](const Shape& s) { return s.holds(x, y); });
    return last != shapes_.rend() && last->dark;
  }

  void run_block(std::string_view text) {
    const auto first = text.find_first_not_of(" \t");
    if (first == std::string_view::npos) return;
    if (text[first] == '0' &&
        (first + 1 == text.size() || !(is_digit(text[first + 1]) || text[first + 1] == '.')))
      return;  // a comment
    block_ = text.substr(first);
    at_ = 0;
    if (block_[0] == '$') {
      const auto equals = block_.find('=');
      if (equals != std::string_view::npos) return assign(equals);
    }
    std::vector<double> numbers = {expression()};
    while (at_ < block_.size()) {
      if (block_[at_] != ',') fail(block_.substr(at_), "a comma in an aperture macro");
      ++at_;
      numbers.push_back(expression());
    }
    draw(numbers);
  }

  void assign(std::size_t equals) {
    const std::size_t variable = read_variable();
    skip_blanks();
    if (at_ != equals) fail(block_, "an assignment such as $4=$1x0.5");
    ++at_;
    const double value = expression();
    if (at_ != block_.size()) fail(block_.substr(at_), "the end of the assignment");
    variables_[variable] = value;
  }

  // ---- expressions ----

  void skip_blanks() {
    while (at_ < block_.size() && (block_[at_] == ' ' || block_[at_] == '\t')) ++at_;
  }

  double expression() {
    double value = product();
    while (at_ < block_.size() && (block_[at_] == '+' || block_[at_] == '-')) {
      const bool less = block_[at_++] == '-';
      const double next = product();
      value += less ? -next : next;
    }
    return value;
  }

  double product() {
    double value = factor();
    while (at_ < block_.size() && (block_[at_] == 'x' || block_[at_] == 'X' || block_[at_] == '/')) {
      const bool divides = block_[at_++] == '/';
      const double next = factor();
      value = divides ? value / next : value * next;
    }
    if (!std::isfinite(value)) fail(block_, "finite numbers in an aperture macro");
    return value;
  }

  double factor() {
    constexpr std::size_t kMostSteps = 50'000'000, kDeepest = 100;
    if (++steps_ > kMostSteps)
      fail(block_, fmt::format("aperture macros of at most {} numbers in all", kMostSteps));
    skip_blanks();
    double sign = 1.0;
    for (; at_ < block_.size() && (block_[at_] == '-' || block_[at_] == '+'); ++at_)
      if (block_[at_] == '-') sign = -sign;
    double value = 0.0;
    if (at_ < block_.size() && block_[at_] == '(') {
      if (++depth_ > kDeepest) fail(block_, "brackets nested less deeply");
      ++at_;
      value = expression();
      if (at_ == block_.size() || block_[at_] != ')') fail(block_, "the end of a bracket");
      ++at_;
      --depth_;
    } else if (at_ < block_.size() && block_[at_] == '$') {
      const auto known = variables_.find(read_variable());
      value = known == variables_.end() ? 0.0 : known->second;  // as the format says
    } else {
      const std::size_t end = std::min(block_.find_first_not_of("0123456789.", at_), block_.size());
      const auto number = parse_number(block_.substr(at_, end - at_));
      if (!number) fail(block_.substr(at_), "a number in an aperture macro");
      value = *number;
      at_ = end;
    }
    skip_blanks();
    return sign * value;
  }

  /// "$3"
  std::size_t read_variable() {
    constexpr std::size_t kMost = 1'000'000;
    const std::size_t from = at_++;
    std::size_t number = 0;
    for (; at_ < block_.size() && is_digit(block_[at_]); ++at_)
      number = std::min(number * 10 + static_cast<std::size_t>(block_[at_] - '0'), kMost);
    if (number == 0 || number == kMost) fail(block_.substr(from), "a variable such as $1");
    return number;
  }

  // ---- primitives ----

  void draw(const std::vector<double>& n) {
    const auto need = [&](std::size_t least, std::size_t most) {
      if (n.size() < least || n.size() > most)
        fail(block_, fmt::format("{} numbers behind the primitive's code", most - 1));
    };
    if (n[0] == 1.0) {
      need(5, 6);
      disc(is_dark(n[1]), n[3], n[4], n[2], n.size() > 5 ? n[5] : 0.0);
    } else if (n[0] == 2.0 || n[0] == 20.0) {
      need(7, 8);
      line(n);
    } else if (n[0] == 21.0 || n[0] == 22.0) {
      need(6, 7);
      const double x = n[0] == 21.0 ? n[4] - 0.5 * n[2] : n[4], y = n[0] == 21.0 ? n[5] - 0.5 * n[3] : n[5];
      polygon(is_dark(n[1]), {{x, y, 0}, {x + n[2], y, 0}, {x + n[2], y + n[3], 0}, {x, y + n[3], 0}},
              n.size() > 6 ? n[6] : 0.0);
    } else if (n[0] == 4.0) {
      outline(n);
    } else if (n[0] == 5.0) {
      need(6, 7);
      regular(n);
    } else if (n[0] == 6.0) {
      need(9, 10);
      moire(n);
    } else if (n[0] == 7.0) {
      need(6, 7);
      thermal(n);
    } else {
      fail(block_, "a primitive of aperture macros: 0, 1, 4, 5, 6, 7, 20, 21 or 22");
    }
  }

  bool is_dark(double exposure) const {
    if (exposure != 0.0 && exposure != 1.0) fail(block_, "exposure 0 or 1");
    return exposure == 1.0;
  }

  void disc(bool dark, double x, double y, double diameter, double angle_deg) {
    if (diameter < 0.0) fail(block_, "a diameter of 0 or more");
    const RawPoint middle = turned({x, y, 0}, angle_deg);
    shapes_.push_back({dark, middle.x, middle.y, 0.5 * diameter});
  }

  /// Rings from the outside inwards, and a cross over them.
  void moire(const std::vector<double>& n) {
    const double diameter = n[3], thickness = n[4], gap = n[5], rings = n[6], cross = n[7], length = n[8];
    constexpr double kMostRings = 10'000.0;
    if (!(diameter >= 0.0 && thickness > 0.0 && gap >= 0.0 && cross >= 0.0 && length >= 0.0))
      fail(block_, "lengths of 0 or more, and rings of a thickness above 0");
    if (rings < 1.0 || rings > kMostRings || rings != std::floor(rings))
      fail(block_, fmt::format("1 to {:.0f} rings", kMostRings));
    const double angle_deg = n.size() > 9 ? n[9] : 0.0;
    const RawPoint middle = turned({n[1], n[2], 0}, angle_deg);
    double radius = 0.5 * diameter;
    for (double ring = 0.0; ring < rings && radius > 0.0; ++ring, radius -= thickness + gap)
      shapes_.push_back({true, middle.x, middle.y, radius, {}, std::max(radius - thickness, 0.0)});
    if (cross == 0.0 || length == 0.0) return;
    rectangle(n[1] - 0.5 * length, n[2] - 0.5 * cross, length, cross, angle_deg);
    rectangle(n[1] - 0.5 * cross, n[2] - 0.5 * length, cross, length, angle_deg);
  }

  /// A ring in four pieces.
  void thermal(const std::vector<double>& n) {
    const double outer = n[3], inner = n[4], gap = n[5];
    if (!(inner >= 0.0 && outer > inner && gap >= 0.0 && gap < outer * std::numbers::sqrt2 / 2.0))
      fail(block_, "an outer diameter above the inner one, and a gap below 0.7 of it");
    const double angle_deg = n.size() > 6 ? n[6] : 0.0;
    const RawPoint middle = turned({n[1], n[2], 0}, angle_deg);
    shapes_.push_back({true, middle.x, middle.y, 0.5 * outer, {}, 0.5 * inner, gap, angle_deg});
  }

  void rectangle(double x, double y, double width, double height, double angle_deg) {
    polygon(true, {{x, y, 0}, {x + width, y, 0}, {x + width, y + height, 0}, {x, y + height, 0}}, angle_deg);
  }

  void polygon(bool dark, std::vector<RawPoint> corners, double angle_deg) {
    for (RawPoint& corner : corners) corner = turned(corner, angle_deg);
    shapes_.push_back({dark, 0.0, 0.0, 0.0, std::move(corners)});
  }

  /// From one point to another, with square ends.
  void line(const std::vector<double>& n) {
    const double along_x = n[5] - n[3], along_y = n[6] - n[4], length = std::hypot(along_x, along_y);
    const double across_x = length > 0.0 ? -0.5 * n[2] * along_y / length : 0.0,
                 across_y = length > 0.0 ? 0.5 * n[2] * along_x / length : 0.0;
    polygon(is_dark(n[1]),
            {{n[3] + across_x, n[4] + across_y, 0},
             {n[3] - across_x, n[4] - across_y, 0},
             {n[5] - across_x, n[6] - across_y, 0},
             {n[5] + across_x, n[6] + across_y, 0}},
            n.size() > 7 ? n[7] : 0.0);
  }

  void outline(const std::vector<double>& n) {
    constexpr std::size_t kCode = 3;  // behind it: a point more than n[2] says, and perhaps an angle
    const std::size_t points = n.size() < kCode ? 0 : (n.size() - kCode) / 2;
    if (points < 2 || n[2] + 1.0 != static_cast<double>(points))
      fail(block_, "an outline with as many points as it says, and the first one again");
    std::vector<RawPoint> corners;
    for (std::size_t i = 0; i < points; ++i) corners.push_back({n[kCode + 2 * i], n[kCode + 2 * i + 1], 0});
    // What a layout system rounded is one point still.
    constexpr double kSame = 1e-5;
    if (std::hypot(corners.back().x - corners.front().x, corners.back().y - corners.front().y) > kSame)
      fail(block_, "an outline whose last point is the first one again");
    polygon(is_dark(n[1]), std::move(corners), n.size() > kCode + 2 * points ? n.back() : 0.0);
  }

  void regular(const std::vector<double>& n) {
    constexpr double kMost = 12.0;
    if (n[2] < 3.0 || n[2] > kMost || n[2] != std::floor(n[2])) fail(block_, "a polygon of 3 to 12 vertices");
    if (n[5] < 0.0) fail(block_, "a diameter of 0 or more");
    std::vector<RawPoint> corners;
    for (double corner = 0.0; corner < n[2]; ++corner) {
      const RawPoint at = turned({0.5 * n[5], 0.0, 0}, 360.0 * corner / n[2]);
      corners.push_back({n[3] + at.x, n[4] + at.y, 0});
    }
    polygon(is_dark(n[1]), std::move(corners), n.size() > 6 ? n[6] : 0.0);
  }

  std::size_t& steps_;
  const MacroDefect& defect_;
  std::map<std::size_t, double> variables_;
  std::string_view block_;
  std::size_t at_ = 0, depth_ = 0;
  std::vector<Shape> shapes_;
};

}  // namespace

MacroCopper copper_of_macro(std::string_view blocks, std::span<const double> parameters, std::size_t& steps,
                            const MacroDefect& defect) {
  Macro macro(parameters, steps, defect);
  macro.run(blocks);
  return macro.copper();
}

}  // namespace meltstage::motion::detail
