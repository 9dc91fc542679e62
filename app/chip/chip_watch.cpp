// SPDX-License-Identifier: Apache-2.0
#include "app/chip/chip_watch.hpp"

#include <fmt/format.h>
#include <langinfo.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <clocale>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "app/chip/chip_chart.hpp"
#include "app/chip/latched_fault.hpp"
#include "base/error.hpp"
#include "base/terminal.hpp"

// Its macros would rename members of the headers above.
#define NCURSES_NOMACROS 1
#include <ncurses.h>

namespace meltstage::app {

namespace {

namespace spec = chip::spec;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kLongestSpan_s = 600.0;
constexpr double kShortestSpan_s = 30.0;
constexpr double kLeastRange_degc = 2.0;
constexpr int kLeastColumns = 40;
constexpr int kLeastRows = 12;

Clock::duration as_duration(double time_s) {
  return std::chrono::duration_cast<Clock::duration>(Seconds(time_s));
}

std::string state_words(const host::Status& status) {
  return host::meaning(host::registers()[spec::kInStatus], status.bits);
}

// ---- CSV ----

void print_csv_header() {
  fmt::print("time_s,temperature_degc,setpoint_degc,duty_percent,state,run,at_temperature,faults\n");
  std::fflush(stdout);
}

void print_csv(double t_s, const host::Status& s) {
  std::string faults = host::fault_names(s.faults);
  std::erase(faults, ',');
  fmt::print("{:.3f},{},{:.1f},{:.2f},{},{:d},{:d},{}\n", t_s,
             s.temperature_degc ? fmt::format("{:.3f}", *s.temperature_degc) : "", s.setpoint_degc,
             s.duty_percent, spec::state_name(s.state), s.running(), s.at_temperature(), faults);
  std::fflush(stdout);
}

// ---- Chart ----

// The terminal in ncurses' hands, given back at the end.
class Screen {
 public:
  Screen() {
    std::setlocale(LC_ALL, "");
    if (std::string_view(nl_langinfo(CODESET)) != "UTF-8") std::setlocale(LC_CTYPE, "C.UTF-8");
    if (newterm(nullptr, stdout, stdin) == nullptr)
      throw UserError(
          "TERM: found a terminal that ncurses does not know; pipe the output for CSV, as in: ... | cat");
    cbreak();
    noecho();
    curs_set(0);
    if (has_colors()) {
      start_color();
      use_default_colors();
      init_pair(kCurve, COLOR_GREEN, -1);
      init_pair(kReference, COLOR_YELLOW, -1);
      init_pair(kAlarm, COLOR_RED, -1);
    }
  }
  ~Screen() { endwin(); }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  static constexpr short kCurve = 1, kReference = 2, kAlarm = 3;
};

struct History {
  std::vector<ChartPoint> temperature;
  std::vector<ChartPoint> setpoint;
  std::vector<ChartPoint> duty;

  void add(double t_s, const host::Status& s) {
    if (s.temperature_degc) temperature.push_back({t_s, *s.temperature_degc});
    if (s.running()) setpoint.push_back({t_s, s.setpoint_degc});
    duty.push_back({t_s, s.duty_percent});
    for (auto* points : {&temperature, &setpoint, &duty})
      std::erase_if(*points, [&](const ChartPoint& p) { return p.t_s < t_s - kLongestSpan_s; });
  }
};

void put_chart(int top, const ChartRows& chart) {
  for (std::size_t row = 0; row < chart.size(); ++row) {
    move(top + static_cast<int>(row), 0);
    for (const ChartCell& cell : chart[row]) {
      const int pair = cell.ink == Ink::curve       ? Screen::kCurve
                       : cell.ink == Ink::reference ? Screen::kReference
                                                    : 0;
      attrset(COLOR_PAIR(pair));
      addstr(to_utf8({&cell, 1}).c_str());
    }
  }
  attrset(0);
}

void put_text(int row, const std::string& text) { mvaddnstr(row, 0, text.c_str(), COLS); }

void draw(const History& history, double t_s, const host::Status& s, const std::string& notice) {
  erase();
  const std::string temperature =
      s.temperature_degc ? fmt::format("{:.2f} degC", *s.temperature_degc) : "no sample yet";
  put_text(0, fmt::format("temperature {}   set-point {:.1f} degC   duty {:.1f} %   {:.0f} s   q ends",
                          temperature, s.setpoint_degc, s.duty_percent, t_s));
  put_text(1, fmt::format("state {}: {}", spec::state_name(s.state), state_words(s)));
  const std::string latched = host::fault_names(s.faults);
  if (!latched.empty() || !notice.empty()) {
    attrset(COLOR_PAIR(Screen::kAlarm) | A_BOLD);
    put_text(2, notice.empty() ? "faults: " + latched : notice);
    attrset(0);
  } else {
    put_text(2, "no fault");
  }
  if (COLS < kLeastColumns || LINES < kLeastRows) {
    put_text(3, fmt::format("a chart needs {} x {}", kLeastColumns, kLeastRows));
    refresh();
    return;
  }
  const double span = std::clamp(t_s, kShortestSpan_s, kLongestSpan_s);
  const double from = std::max(0.0, t_s - span);
  const int duty_rows = std::max(3, LINES / 5 | 1);  // odd: 50 % has a row of its own
  const int temperature_rows = LINES - 6 - duty_rows;
  ChartScale scale = fit_scale(history.temperature, history.setpoint, kLeastRange_degc);
  scale.from_s = from;
  scale.to_s = from + span;
  put_text(3, "degC");
  put_chart(4, draw_chart(history.temperature, history.setpoint, scale, COLS, temperature_rows));
  put_text(4 + temperature_rows, "duty %");
  put_chart(5 + temperature_rows,
            draw_chart(history.duty, {}, {from, from + span, 0.0, 100.0, {}}, COLS, duty_rows));
  mvaddstr(LINES - 1, 9, fmt::format("{:.0f} s", from).c_str());
  const std::string right = fmt::format("{:.0f} s", from + span);
  mvaddstr(LINES - 1, COLS - static_cast<int>(right.size()), right.c_str());
  refresh();
}

// Polls until something ends it; `show` takes the time and what was read, `pause` waits and says whether to
// go on.
int poll_chip(host::Controller& controller, const WatchOptions& options,
              const std::function<void(double, const host::Status&)>& show,
              const std::function<bool(Seconds)>& pause) {
  const Clock::time_point start = Clock::now();
  Clock::time_point next = start;
  for (;;) {
    throw_if_interrupted();
    const host::Status status = controller.status();
    const double t_s = Seconds(Clock::now() - start).count();
    show(t_s, status);
    if (options.for_s && t_s >= *options.for_s) return status.faults == 0 ? 0 : 1;
    next = std::max(next + as_duration(options.period_s), Clock::now());
    if (options.for_s) next = std::min(next, start + as_duration(*options.for_s));
    if (!pause(next - Clock::now())) return status.faults == 0 ? 0 : 1;
  }
}

int watch_as_csv(host::Controller& controller, const WatchOptions& options) {
  bool first = true;
  const auto show = [&](double t_s, const host::Status& status) {
    if (std::exchange(first, false)) print_csv_header();
    print_csv(t_s, status);
  };
  return poll_chip(controller, options, show, [](Seconds time) {
    const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(time);
    while (Clock::now() < end) {  // in pieces, so that Ctrl-C is heard
      throw_if_interrupted();
      std::this_thread::sleep_for(
          std::min<Clock::duration>(end - Clock::now(), std::chrono::milliseconds(50)));
    }
    return true;
  });
}

int watch_as_chart(host::Controller& controller, const WatchOptions& options) {
  controller.check_identity();  // while its message is not drawn over
  const Screen screen;
  History history;
  host::Status last{};
  double last_t_s = 0.0;
  const auto show = [&](double t_s, const host::Status& status) {
    history.add(t_s, status);
    last = status;
    last_t_s = t_s;
    draw(history, t_s, status, "");
  };
  const auto pause = [&](Seconds time) {
    timeout(std::max(1, static_cast<int>(std::lround(time.count() * 1000.0))));
    const int key = getch();
    if (key == KEY_RESIZE) draw(history, last_t_s, last, "");
    return key != 'q' && key != 'Q';
  };
  return poll_chip(controller, options, show, pause);
}

}  // namespace

int watch_chip(host::Controller& controller, const WatchOptions& options) {
  catch_interrupts();
  try {
    const int status =
        isatty(STDOUT_FILENO) != 0 ? watch_as_chart(controller, options) : watch_as_csv(controller, options);
    if (status != 0) on_stderr(fmt::format("{}\n", latched_fault(controller)));
    return status;
  } catch (const Interrupted&) {
    return 0;
  }
}

}  // namespace meltstage::app
