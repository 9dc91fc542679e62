// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/place/drivers.hpp"

#include <set>

#include "asic/layout/db/paths.hpp"

namespace meltstage::layout {

namespace {

/// Macros of the same function, by name: that of `macro` with any number at the end, smallest first.
std::vector<int> sizes_of(const Technology& technology, int macro) {
  const auto stem_of = [](const std::string& name) {
    const std::size_t end = name.find_last_not_of("0123456789");
    return end == std::string::npos || end + 1 == name.size() || (name[end] != '_' && name[end] != 'X')
               ? name
               : name.substr(0, end + 1);
  };
  const Macro& now = technology.macros[static_cast<std::size_t>(macro)];
  std::vector<int> sizes;
  for (std::size_t m = 0; m < technology.macros.size(); ++m)
    if (technology.macros[m].macro_class == now.macro_class &&
        stem_of(technology.macros[m].name) == stem_of(now.name))
      sizes.push_back(static_cast<int>(m));
  std::sort(sizes.begin(), sizes.end(), [&](int a, int b) {
    return technology.macros[static_cast<std::size_t>(a)].width <
           technology.macros[static_cast<std::size_t>(b)].width;
  });
  return sizes;
}

/// Chooses drivers: sizes where a library has them, buffers behind the others.
class DriverSizing {
 public:
  DriverSizing(Design& design, const Technology& technology, const Delays& delays,
               const std::string& clock_port, const DriverOptions& options, const TreeOptions& trees)
      : design_(design),
        technology_(technology),
        delays_(delays),
        options_(options),
        clock_(net_of_port(design, clock_port)),
        builder_(design, technology, delays, trees, "drive"),
        sizes_(technology.macros.size()),
        most_slew_ns_(design.nets.size(), options.most_slew_ns) {}

  SizedDrivers run() {
    choose();
    double longest = std::numeric_limits<double>::infinity();
    for (PathsNow now = look_at_paths(); now.may_be_faster && now.longest_ns < kWorthIt * longest;
         now = look_at_paths()) {
      longest = now.longest_ns;
      choose();
    }
    return {static_cast<int>(resized_.size()), builder_.made()};
  }

 private:
  static constexpr double kSlewInNs = 0.1;
  static constexpr double kWorthIt =
      0.99;  // the longest path has to become shorter by this, else it is left as it is
  static constexpr double kFaster = 0.7;        // what a round asks of an edge on a path that is too long
  static constexpr double kFastEnoughNs = 0.1;  // nothing more is asked of such an edge

  struct Driver {
    int component = kDiePin;
    int macro = 0;
    std::string pin;
    double load_pf = 0.0;
  };

  Driver driver_of(std::size_t n) const {
    Driver driver;
    const Net& net = design_.nets[n];
    if (net.use != Use::signal || static_cast<int>(n) == clock_) return driver;
    for (const PinRef& ref : net.pins) {
      if (ref.component == kDiePin || !is_driver(design_, technology_, ref)) continue;
      const DelayCell* cell = delay_cell_of(design_, technology_, delays_, ref.component);
      if (cell == nullptr || cell->is_clock_gate) continue;
      const int macro = design_.components[static_cast<std::size_t>(ref.component)].macro;
      driver = {
          ref.component, macro,
          technology_.macros[static_cast<std::size_t>(macro)].pins[static_cast<std::size_t>(ref.pin)].name,
          expected_load_pf(design_, technology_, delays_, net)};
    }
    return driver;
  }

  /// Of a cell's output the most of its arcs' figures.
  template <typename Figure>
  double most(int macro, const std::string& pin, const Figure& figure) const {
    double most = 0.0;
    const auto cell = delays_.find(technology_.macros[static_cast<std::size_t>(macro)].name);
    if (cell == delays_.end()) return most;
    const auto found = cell->second.pins.find(pin);
    if (found != cell->second.pins.end())
      for (const DelayArc& arc : found->second.arcs) most = std::max(most, figure(arc));
    return most;
  }
  double slew_ns(int macro, const std::string& pin, double load_pf) const {
    return most(macro, pin, [&](const DelayArc& arc) { return arc.slowest_slew_ns(kSlewInNs, load_pf); });
  }
  double delay_ns(const Driver& driver, double load_pf) const {
    return most(driver.macro, driver.pin, [&](const DelayArc& arc) {
      return std::max(arc.delay.at(kSlewInNs, load_pf), arc.fall_delay.at(kSlewInNs, load_pf));
    });
  }

  std::vector<std::vector<int>> nets_of_components() const {
    std::vector<std::vector<int>> nets(design_.components.size());
    for (std::size_t n = 0; n < design_.nets.size(); ++n) {
      for (const PinRef& ref : design_.nets[n].pins) {
        if (ref.component == kDiePin) continue;
        std::vector<int>& of = nets[static_cast<std::size_t>(ref.component)];
        if (of.empty() || of.back() != static_cast<int>(n)) of.push_back(static_cast<int>(n));
      }
    }
    return nets;
  }

  /// Sizes first: buffers move pins to other nets.
  void choose() {
    const std::vector<std::vector<int>> nets_of = nets_of_components();
    const std::size_t nets = design_.nets.size();
    for (std::size_t n = 0; n < nets; ++n) choose_size(n, nets_of);
    for (std::size_t n = 0; n < nets; ++n) help(n);
    most_slew_ns_.resize(design_.nets.size(), options_.most_slew_ns);
  }

  void choose_size(std::size_t n, const std::vector<std::vector<int>>& nets_of) {
    const Driver driver = driver_of(n);
    if (driver.component == kDiePin) return;
    auto& known = sizes_[static_cast<std::size_t>(driver.macro)];
    if (known.empty()) known = sizes_of(technology_, driver.macro);
    int best = driver.macro;
    for (const int size : known)
      if (slew_ns(best, driver.pin, driver.load_pf) > most_slew_ns_[n] &&
          slew_ns(size, driver.pin, driver.load_pf) < slew_ns(best, driver.pin, driver.load_pf))
        best = size;
    if (best == driver.macro) return;
    change_macro(design_, technology_, driver.component, best,
                 nets_of[static_cast<std::size_t>(driver.component)]);
    resized_.insert(driver.component);
  }

  void help(std::size_t n) {
    const Driver driver = driver_of(n);
    if (driver.component == kDiePin || slew_ns(driver.macro, driver.pin, driver.load_pf) <= most_slew_ns_[n])
      return;
    std::vector<Sink> sinks;
    for (const PinRef& ref : take_sinks(design_, technology_, static_cast<int>(n)))
      sinks.push_back(builder_.sink(ref, 0.0));
    if (sinks.empty()) return;
    const Buffer& buffer = builder_.smallest_for(sinks, most_slew_ns_[n]);
    const bool is_too_slow = slew_ns(driver.macro, driver.pin, driver.load_pf) > options_.most_slew_ns;
    if (is_too_slow ||
        delay_ns(driver, buffer.load_pf) + builder_.delay(buffer, sinks) < delay_ns(driver, driver.load_pf))
      builder_.insert(buffer, sinks, static_cast<int>(n));
    else
      for (const Sink& sink : sinks) design_.nets[n].pins.push_back(sink.pin);
  }

  struct PathsNow {
    double longest_ns = 0.0;
    bool may_be_faster = false;
  };

  /// Edges on paths that are too long have to be faster from now on.
  PathsNow look_at_paths() {
    std::vector<double> load_pf(design_.nets.size());
    std::transform(design_.nets.begin(), design_.nets.end(), load_pf.begin(), [&](const Net& net) {
      return net.use == Use::signal ? expected_load_pf(design_, technology_, delays_, net) : 0.0;
    });
    const std::vector<double> path_ns = longest_paths_ns(design_, technology_, delays_, load_pf);
    PathsNow now;
    for (std::size_t n = 0; n < path_ns.size(); ++n) {
      now.longest_ns = std::max(now.longest_ns, path_ns[n]);
      if (path_ns[n] <= options_.most_path_ns) continue;
      const Driver driver = driver_of(n);
      const double slew =
          driver.component == kDiePin ? 0.0 : slew_ns(driver.macro, driver.pin, driver.load_pf);
      if (slew <= kFastEnoughNs) continue;
      most_slew_ns_[n] = std::min(most_slew_ns_[n], kFaster * slew);
      now.may_be_faster = true;
    }
    return now;
  }

  Design& design_;
  const Technology& technology_;
  const Delays& delays_;
  const DriverOptions& options_;
  const int clock_;
  TreeBuilder builder_;
  std::vector<std::vector<int>> sizes_;  ///< by macro: those of its function, smallest first
  std::vector<double> most_slew_ns_;     ///< by net
  std::set<int> resized_;
};

}  // namespace

SizedDrivers size_drivers(Design& design, const Technology& technology, const Delays& delays,
                          const std::string& clock_port, const DriverOptions& options,
                          const TreeOptions& trees) {
  return DriverSizing(design, technology, delays, clock_port, options, trees).run();
}

}  // namespace meltstage::layout
