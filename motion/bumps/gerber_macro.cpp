// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/gerber_macro.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>
#include <vector>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {
namespace {

/// A disc, or what lies inside a polygon.
struct Shape {
  bool dark = true;
  double x = 0.0, y = 0.0, radius = 0.0;
  std::vector<RawPoint> corners;

  bool holds(double at_x, double at_y) const {
    if (corners.empty()) return std::hypot(at_x - x, at_y - y) <= radius;
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
      disc(true, n[1], n[2], n[3], n.size() > 9 ? n[9] : 0.0);  // the rings of a moire
    } else if (n[0] == 7.0) {
      need(6, 7);
      disc(true, n[1], n[2], n[3], n.size() > 6 ? n[6] : 0.0);
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
    shapes_.push_back({dark, middle.x, middle.y, 0.5 * diameter, {}});
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
    polygon(is_dark(n[1]), std::move(corners), n.size() > kCode + 2 * points ? n.back() : 0.0);
  }

  void regular(const std::vector<double>& n) {
    constexpr double kMost = 12.0;
    if (n[2] < 3.0 || n[2] > kMost || n[2] != std::floor(n[2])) fail(block_, "a polygon of 3 to 12 vertices");
    // By its circle: the extent of a triangle's corners has another middle.
    disc(is_dark(n[1]), n[3], n[4], n[5], n.size() > 6 ? n[6] : 0.0);
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
