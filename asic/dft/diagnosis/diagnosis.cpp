// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/diagnosis/diagnosis.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/lanes.hpp"

namespace meltstage::dft {
namespace {

constexpr const char* kNames[] = {"stuck-at-0",   "stuck-at-1", "slow-to-rise", "slow-to-fall",
                                  "dominated-by", "wired-and",  "wired-or",     "cell-internal",
                                  "falls-to-0",   "rises-to-1", "unsteady"};

std::size_t count(const Lanes& word) {
  std::size_t bits = 0;
  for (std::size_t i = 0; i < kLanes / 64; ++i) bits += static_cast<std::size_t>(std::popcount(word[i]));
  return bits;
}

// What a wrong level on one line does to the outputs, event by event.
class Flips {
 public:
  explicit Flips(const Circuit& circuit)
      : circuit_(circuit),
        value_(circuit.size()),
        changed_(circuit.size(), 0),
        pending_(circuit.size() / 64 + 1, 0),
        output_of_(circuit.size(), 0) {
    for (std::size_t o = 0; o < circuit.outputs().size(); ++o)
      output_of_[circuit.outputs()[o]] = static_cast<std::uint32_t>(o);
  }

  struct Response {
    std::uint32_t output;
    Word lanes;  // in which it changes
  };
  const std::vector<Response>& of(const Line& line, const std::vector<Word>& good) {
    responses_.clear();
    for (const Node node : touched_) changed_[node] = 0;
    touched_.clear();
    const auto value = [&](Node node) -> const Lanes& {
      return lanes(changed_[node] != 0 ? value_[node] : good[node]);
    };
    Lanes wrong{};
    if (line.pin == kStem) {
      wrong = ~lanes(good[line.node]);
    } else {
      const auto fanin = circuit_.fanin(line.node);
      const Lanes flipped = ~lanes(good[fanin[static_cast<std::size_t>(line.pin)]]);
      evaluate(
          circuit_.kind(line.node), fanin.size(),
          [&](std::size_t i) -> const Lanes& {
            return i == static_cast<std::size_t>(line.pin) ? flipped : lanes(good[fanin[i]]);
          },
          wrong);
    }
    set(line.node, wrong, good);
    for (std::size_t word = line.node / 64; word < pending_.size(); ++word) {
      while (pending_[word] != 0) {
        const auto bit = static_cast<unsigned>(std::countr_zero(pending_[word]));
        pending_[word] &= pending_[word] - 1;
        const Node node = static_cast<Node>(64 * word + bit);
        const auto fanin = circuit_.fanin(node);
        Lanes now{};
        evaluate(
            circuit_.kind(node), fanin.size(), [&](std::size_t i) -> const Lanes& { return value(fanin[i]); },
            now);
        set(node, now, good);
      }
    }
    return responses_;
  }

 private:
  void set(Node node, const Lanes& now, const std::vector<Word>& good) {
    const Lanes change = now ^ lanes(good[node]);
    if (is_zero(change)) return;
    lanes(value_[node]) = now;
    changed_[node] = 1;
    touched_.push_back(node);
    if (circuit_.kind(node) == Gate::output) {
      lanes(responses_.emplace_back(Response{output_of_[node], {}}).lanes) = change;
      return;
    }
    for (const Node next : circuit_.fanout(node)) pending_[next / 64] |= std::uint64_t{1} << (next % 64);
  }

  const Circuit& circuit_;
  std::vector<Word> value_;
  std::vector<std::uint8_t> changed_;
  std::vector<Node> touched_;
  std::vector<std::uint64_t> pending_;
  std::vector<std::uint32_t> output_of_;  // by node
  std::vector<Response> responses_;
};

// Behaviours of which none is plainer than the other rank alike.
int plainness(Behaviour behaviour) {
  switch (behaviour) {
    case Behaviour::stuck_at_0:
    case Behaviour::stuck_at_1:
      return 0;
    case Behaviour::slow_to_rise:
    case Behaviour::slow_to_fall:
      return 1;
    case Behaviour::dominated_by:
    case Behaviour::wired_and:
    case Behaviour::wired_or:
      return 2;
    case Behaviour::cell_internal:
      return 3;
    case Behaviour::falls_to_0:
    case Behaviour::rises_to_1:
      return 4;
    default:
      return 5;
  }
}

std::string cell_of(const std::string& site) { return site.substr(0, site.rfind('/')); }

}  // namespace

const char* to_string(Behaviour behaviour) { return kNames[static_cast<std::size_t>(behaviour)]; }

bool ranks_before(const Suspect& a, const Suspect& b) {
  const auto key = [](const Suspect& s) {
    return std::tuple(~s.explained, plainness(s.behaviour), s.contradicted);
  };
  return key(a) < key(b);
}

Diagnoser::Diagnoser(const Circuit& circuit, Captures captures, std::vector<std::vector<Node>> neighbours)
    : circuit_(circuit),
      captures_(std::move(captures)),
      neighbours_(std::move(neighbours)),
      blocks_(blocks_of(captures_.patterns, circuit.inputs().size(), captures_.compared)) {
  for (const PatternBlock& block : blocks_) simulate(circuit, block, good_.emplace_back(circuit.size()));
  for (const PatternBlock& block : blocks_of(captures_.before, circuit.inputs().size()))
    simulate(circuit, block, before_.emplace_back(circuit.size()));
  std::map<std::string, std::vector<Node>> inputs;  // of a cell
  std::map<Node, std::string> driver;               // cell
  std::set<Line> lines;
  for (const Site& site : circuit.sites()) {
    if (site.node == kNoNode) continue;
    const Line line{site.node, site.pin};
    if (site.pin == kStem)
      driver[site.node] = cell_of(site.name);
    else
      inputs[cell_of(site.name)].push_back(source_of(circuit, line));
    lines.insert(stem_of(circuit, line));
  }
  lines_.assign(lines.begin(), lines.end());
  std::set<Node> nets;
  for (const Line& line : lines_) {
    const Node source = source_of(circuit, line);
    nets.insert(source);
    const auto cell = driver.find(source);
    cell_inputs_.push_back(cell == driver.end() ? std::vector<Node>() : inputs[cell->second]);
  }
  nets_.assign(nets.begin(), nets.end());
}

// One log.
class Case {
 public:
  Case(const Diagnoser& diagnoser, const FailLog& log)
      : d_(diagnoser), circuit_(diagnoser.circuit_), flips_(circuit_) {
    for (std::size_t b = 0; b < d_.blocks_.size(); ++b) {
      used_.push_back(d_.blocks_[b].used());
      failing_.emplace_back();
      failed_.emplace_back();
      unknown_.emplace_back();
    }
    place(log);
    if (log.truncated && !log.fails.empty()) leave_out_from(log.fails.back().cycle);
    for (std::size_t b = 0; b < used_.size(); ++b) {
      lanes(failing_[b]) &= lanes(used_[b]);
      result_.failing_patterns += count(lanes(failing_[b]));
      result_.passing_patterns += count(lanes(used_[b]) & ~lanes(failing_[b]));
    }
  }

  Diagnosis run() {
    const std::vector<std::size_t> lines = possible_lines();
    for (const std::size_t line : lines) effects_.push_back(effect_of(line));
    std::vector<Word> open = failing_;
    for (std::size_t left = result_.failing_patterns; left != 0 && result_.defects.size() < kMostDefects;) {
      DefectFound found = best_for(lines, open);
      if (found.suspects.empty()) break;
      const Line first = found.suspects[0].line;
      for (std::size_t i = 0; i < lines.size(); ++i) {
        if (d_.lines_[lines[i]] != first) continue;
        for (std::size_t b = 0; b < open.size(); ++b) lanes(open[b]) &= ~lanes(effects_[i].explained[b]);
      }
      left -= found.suspects[0].explained;
      result_.defects.push_back(std::move(found));
    }
    for (const Word& word : open) result_.unexplained_patterns += count(lanes(word));
    return std::move(result_);
  }

 private:
  // By block: failing patterns that a wrong level on the line explains, and passing ones in which it shows.
  struct Effect {
    std::vector<Word> explained, visible;
  };

  void place(const FailLog& log) {
    const Captures& captures = d_.captures_;
    std::vector<std::uint32_t> captured;  // by pattern: the first cycle in which it is compared
    for (const auto& cycles : captures.compared_in)
      captured.push_back(*std::min_element(cycles.begin(), cycles.end()));
    for (const FailedStrobe& fail : log.fails) {
      const auto behind = std::upper_bound(captured.begin(), captured.end(), fail.cycle);
      if (behind == captured.begin() || !note(static_cast<std::size_t>(behind - captured.begin()) - 1, fail))
        ++result_.elsewhere;
    }
  }
  bool note(std::size_t pattern, const FailedStrobe& fail) {
    const auto& cycles = d_.captures_.compared_in[pattern];
    for (std::size_t o = 0; o < cycles.size(); ++o) {
      if (cycles[o] != fail.cycle || d_.captures_.compared_at[o] != fail.signal) continue;
      const std::size_t block = pattern / kLanes, lane = pattern % kLanes;
      failing_[block].set(lane, true);
      failed_[block][static_cast<std::uint32_t>(o)].set(lane, true);
      return true;
    }
    return false;
  }
  // Of strobes from that cycle on the log tells those alone that it names.
  void leave_out_from(std::uint64_t cycle) {
    for (std::size_t p = 0; p < d_.captures_.patterns.size(); ++p) {
      const std::size_t block = p / kLanes, lane = p % kLanes;
      const auto& cycles = d_.captures_.compared_in[p];
      bool any_known = false;
      std::vector<std::uint32_t> unknown;
      for (std::uint32_t o = 0; o < cycles.size(); ++o) {
        if (cycles[o] == Captures::kNotCompared) continue;
        const auto failed = failed_[block].find(o);
        const bool known = cycles[o] < cycle || (failed != failed_[block].end() && failed->second.bit(lane));
        any_known = any_known || known;
        if (!known) unknown.push_back(o);
      }
      if (!any_known) used_[block].set(lane, false);
      if (!any_known || unknown.empty()) continue;
      for (const std::uint32_t o : unknown) unknown_[block][o].set(lane, true);
    }
  }

  // Lines that lead to every failed output of one of the first failing patterns.
  std::vector<std::size_t> possible_lines() {
    constexpr std::size_t kMostPatterns = 256;
    std::vector<std::uint8_t> possible(circuit_.size(), 0);
    std::map<std::uint32_t, std::vector<bool>> cones;  // by output
    std::set<std::vector<std::uint32_t>> done;
    std::size_t looked_at = 0;
    for (std::size_t b = 0; b < failing_.size(); ++b) {
      for (std::size_t lane = 0; lane < kLanes && looked_at < kMostPatterns; ++lane) {
        if (!failing_[b].bit(lane)) continue;
        ++looked_at;
        std::vector<std::uint32_t> outputs;
        for (const auto& [output, word] : failed_[b])
          if (word.bit(lane)) outputs.push_back(output);
        if (!done.insert(outputs).second) continue;
        std::vector<const std::vector<bool>*> all;
        for (const std::uint32_t output : outputs) {
          auto cone = cones.find(output);
          if (cone == cones.end())
            cone = cones.emplace(output, cone_of(circuit_, circuit_.outputs()[output])).first;
          all.push_back(&cone->second);
        }
        for (Node node = 0; node < circuit_.size(); ++node)
          if (possible[node] == 0 &&
              std::all_of(all.begin(), all.end(), [&](const auto* c) { return (*c)[node]; }))
            possible[node] = 1;
      }
    }
    std::vector<std::size_t> lines;
    for (std::size_t i = 0; i < d_.lines_.size(); ++i)
      if (possible[d_.lines_[i].node] != 0) lines.push_back(i);
    return lines;
  }

  Effect effect_of(std::size_t line) {
    Effect effect;
    for (std::size_t b = 0; b < d_.blocks_.size(); ++b) {
      Lanes shows{}, differs{};
      std::map<std::uint32_t, const Word*> unmet;
      for (const auto& [output, word] : failed_[b]) unmet[output] = &word;
      for (const Flips::Response& response : flips_.of(d_.lines_[line], d_.good_[b])) {
        Lanes seen = lanes(response.lanes) & lanes(d_.blocks_[b].compared[response.output]);
        if (const auto unknown = unknown_[b].find(response.output); unknown != unknown_[b].end())
          seen &= ~lanes(unknown->second);
        shows |= seen;
        const auto failed = unmet.find(response.output);
        if (failed == unmet.end()) {
          differs |= seen;
        } else {
          differs |= seen ^ lanes(*failed->second);
          unmet.erase(failed);
        }
      }
      for (const auto& [output, word] : unmet) differs |= lanes(*word);
      Word explained, visible;
      lanes(explained) = lanes(failing_[b]) & shows & ~differs;
      lanes(visible) = shows & lanes(used_[b]) & ~lanes(failing_[b]);
      effect.explained.push_back(explained);
      effect.visible.push_back(visible);
    }
    return effect;
  }

  DefectFound best_for(const std::vector<std::size_t>& lines, const std::vector<Word>& open) const {
    std::vector<std::pair<std::size_t, std::size_t>> best;  // patterns explained, index
    for (std::size_t i = 0; i < lines.size(); ++i) {
      std::size_t explained = 0;
      for (std::size_t b = 0; b < open.size(); ++b)
        explained += count(lanes(effects_[i].explained[b]) & lanes(open[b]));
      if (explained != 0) best.emplace_back(explained, i);
    }
    std::stable_sort(best.begin(), best.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    // Behaviour decides among those that explain most; of the rest a few are told.
    constexpr std::size_t kMostRest = 16;
    DefectFound found;
    for (const auto& [explained, i] : best) {
      if (explained != best[0].first && found.suspects.size() >= kMostRest) break;
      found.suspects.push_back(suspect(lines[i], effects_[i], open, explained));
    }
    std::stable_sort(found.suspects.begin(), found.suspects.end(), ranks_before);
    return found;
  }

  // Failing patterns that the line explains and a behaviour doesn't, and passing ones in which it would show.
  template <class IsWrong>
  std::pair<std::size_t, std::size_t> misfit(const Effect& effect, const std::vector<Word>& open,
                                             const IsWrong& is_wrong) const {
    std::size_t missed = 0, too_many = 0;
    for (std::size_t b = 0; b < open.size(); ++b) {
      const Lanes wrong = is_wrong(b);
      missed += count(lanes(effect.explained[b]) & lanes(open[b]) & ~wrong);
      too_many += count(lanes(effect.visible[b]) & wrong);
    }
    return {missed, too_many};
  }

  Suspect suspect(std::size_t line, const Effect& effect, const std::vector<Word>& open,
                  std::size_t explained) const {
    const Node source = source_of(circuit_, d_.lines_[line]);
    Suspect result{.line = d_.lines_[line], .explained = explained};
    const auto level = [&](std::size_t b) -> const Lanes& { return lanes(d_.good_[b][source]); };
    const auto before = [&](std::size_t b) -> const Lanes& { return lanes(d_.before_[b][source]); };
    const auto at_1 = misfit(effect, open, [&](std::size_t b) { return level(b); });
    const auto at_0 = misfit(effect, open, [&](std::size_t b) { return ~level(b); });
    const auto rising = misfit(effect, open, [&](std::size_t b) { return level(b) & ~before(b); });
    const auto falling = misfit(effect, open, [&](std::size_t b) { return ~level(b) & before(b); });
    const auto is = [&](Behaviour behaviour, std::size_t contradicted) {
      result.behaviour = behaviour;
      result.contradicted = contradicted;
    };
    constexpr std::pair<std::size_t, std::size_t> kFits(0, 0);
    if (at_1 == kFits)
      is(Behaviour::stuck_at_0, 0);
    else if (at_0 == kFits)
      is(Behaviour::stuck_at_1, 0);
    else if (rising == kFits)
      is(Behaviour::slow_to_rise, 0);
    else if (falling == kFits)
      is(Behaviour::slow_to_fall, 0);
    else if (finds_bridge(result, source, effect, open))
      return result;
    else if (follows_from_inputs(line, effect, open))
      is(Behaviour::cell_internal, 0);
    else if (at_1.first == 0)
      is(Behaviour::falls_to_0, at_1.second);
    else if (at_0.first == 0)
      is(Behaviour::rises_to_1, at_0.second);
    else
      is(Behaviour::unsteady, at_1.second + at_0.second);
    return result;
  }

  // Another line whose level tells in every pattern whether this one is wrong.
  bool finds_bridge(Suspect& suspect, Node source, const Effect& effect,
                    const std::vector<Word>& open) const {
    const std::vector<bool> before = cone_of(circuit_, source), behind = reached_from(circuit_, source);
    for (const Behaviour kind : {Behaviour::dominated_by, Behaviour::wired_and, Behaviour::wired_or}) {
      for (const Node other : d_.neighbours_.empty() ? d_.nets_ : d_.neighbours_[source]) {
        if (before[other] || behind[other]) continue;
        const auto [missed, too_many] = misfit(effect, open, [&](std::size_t b) -> Lanes {
          const Lanes& own = lanes(d_.good_[b][source]);
          const Lanes& its = lanes(d_.good_[b][other]);
          if (kind == Behaviour::wired_and) return own & ~its;
          if (kind == Behaviour::wired_or) return ~own & its;
          return own ^ its;
        });
        if (missed + too_many != 0) continue;
        suspect.behaviour = kind;
        suspect.others.push_back(other);
        if (suspect.others.size() == kMostOthers) return true;
      }
      if (!suspect.others.empty()) return true;
    }
    return false;
  }

  // No levels at the inputs of the line's cell both fail and pass.
  bool follows_from_inputs(std::size_t line, const Effect& effect, const std::vector<Word>& open) const {
    const std::vector<Node>& inputs = d_.cell_inputs_[line];
    if (inputs.empty() || inputs.size() > 16) return false;
    std::set<std::uint32_t> fails, passes;
    for (std::size_t b = 0; b < open.size(); ++b) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const bool failed = effect.explained[b].bit(lane) && open[b].bit(lane);
        if (!failed && !effect.visible[b].bit(lane)) continue;
        std::uint32_t levels = 0;
        for (const Node input : inputs) levels = 2 * levels + (d_.good_[b][input].bit(lane) ? 1 : 0);
        (failed ? fails : passes).insert(levels);
      }
    }
    return std::none_of(fails.begin(), fails.end(), [&](std::uint32_t l) { return passes.count(l) != 0; });
  }

  const Diagnoser& d_;
  const Circuit& circuit_;
  Flips flips_;
  std::vector<Word> used_, failing_;                    // by block
  std::vector<std::map<std::uint32_t, Word>> failed_;   // by block, by output
  std::vector<std::map<std::uint32_t, Word>> unknown_;  // likewise where the log tells nothing
  std::vector<Effect> effects_;
  Diagnosis result_;
};

Diagnosis Diagnoser::diagnose(const FailLog& log) const { return Case(*this, log).run(); }

}  // namespace meltstage::dft
