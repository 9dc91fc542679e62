// SPDX-License-Identifier: Apache-2.0
// The pattern of a STIL file expanded into cycles.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>
#include <set>

#include "asic/dft/files/stil.hpp"
#include "asic/dft/files/stil_file.hpp"
#include "base/file.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

namespace {

using namespace stil;

constexpr std::size_t kMostUnrolled = 100'000'000;  // characters of one assignment
constexpr std::size_t kMaxDepth = 16;               // calls within calls

class Expander {
 public:
  Expander(const File& file, std::size_t most_cycles) : file_(file), most_cycles_(most_cycles) {
    stream_.title = file.title;
    stream_.signals = file.signals;
    stream_.chains = file.chains;
  }

  CycleStream run() {
    if (file_.executed.empty()) file_.fail(file_.text.size(), "no PatternExec with a PatternBurst", "one");
    states_.assign(stream_.signals.size(), '\0');
    fixed_.assign(stream_.signals.size(), '\0');
    characters_of_.assign(stream_.signals.size(), '\0');
    stale_ = doubtful_ = std::vector<bool>(stream_.signals.size(), false);
    for (const Assignment& exec : file_.executed) {
      const auto burst = file_.bursts.find(exec.signals);
      if (burst == file_.bursts.end())
        file_.fail(exec.where, fmt::format("PatternBurst \"{}\"", shown(exec.signals)),
                   "one that is defined");
      for (const BurstEntry& entry : burst->second.entries) {
        const auto pattern = file_.patterns.find(entry.pattern);
        if (pattern == file_.patterns.end())
          file_.fail(
              entry.where,
              fmt::format("{} \"{}\"", file_.bursts.contains(entry.pattern) ? "PatternBurst" : "pattern",
                          shown(entry.pattern)),
              "a pattern that is defined; bursts in bursts are not read");
        if (stopped_at_)
          file_.fail(*stopped_at_,
                     fmt::format("a Stop with pattern \"{}\" still to come", shown(entry.pattern)),
                     "Stop in the last pattern");
        procedures_ = {&file_.procedures,
                       {&entry.choice.procedures, &burst->second.choice.procedures},
                       "procedure",
                       "Procedures"};
        macros_ = {&file_.macros, {&entry.choice.macros, &burst->second.choice.macros}, "macro", "MacroDefs"};
        require_defined(procedures_);
        require_defined(macros_);
        Parameters none;
        run_block(pattern->second, none, 0);
      }
    }
    set_timing();
    return std::move(stream_);
  }

 private:
  // The named blocks of one kind, and what is chosen among them: an entry's choice goes before its burst's.
  struct Library {
    const std::map<std::string, Routines>* blocks = nullptr;
    std::array<const std::vector<Assignment>*, 2> chosen{};
    std::string_view kind, block_word;
  };
  void require_defined(const Library& library) const {
    for (const std::vector<Assignment>* list : library.chosen) {
      for (const Assignment& choice : *list) {
        if (!library.blocks->contains(choice.signals))
          file_.fail(choice.where, fmt::format("{} \"{}\"", library.block_word, shown(choice.signals)),
                     "a block that is defined");
      }
    }
  }
  // A procedure or macro: of a chosen block, of those without a name, or the only one of that name.
  const std::vector<Statement>& routine(const Library& library, const Statement& call) const {
    const auto in_block = [&](const std::string& block) -> const std::vector<Statement>* {
      const auto routines = library.blocks->find(block);
      if (routines == library.blocks->end()) return nullptr;
      const auto found = routines->second.find(call.name);
      return found == routines->second.end() ? nullptr : &found->second;
    };
    for (const std::vector<Assignment>* list : library.chosen) {
      for (const Assignment& choice : *list) {
        if (const auto* found = in_block(choice.signals)) return *found;
      }
    }
    if (const auto* found = in_block("")) return *found;
    const std::vector<Statement>* only = nullptr;
    for (const auto& [name, routines] : *library.blocks) {
      const auto* found = in_block(name);
      if (found != nullptr && only != nullptr)
        file_.fail(call.where,
                   fmt::format("{} \"{}\" in more than one named block", library.kind, shown(call.name)),
                   "one that the PatternBurst chooses");
      if (found != nullptr) only = found;
    }
    if (only == nullptr)
      file_.fail(call.where, fmt::format("{} \"{}\"", library.kind, shown(call.name)), "one that is defined");
    return *only;
  }

  void use(const WaveformTable& table) {
    if (used_table_ == &table) return;
    used_table_ = &table;
    used_tables_.insert(&table);
    state_of_.assign(table.waveforms.size(), {'\0', '\0'});
    stale_.assign(stale_.size(), true);
  }
  // What a signal's character means in the present table.
  void resolve(std::size_t signal, std::size_t where) {
    const char c = characters_of_[signal];
    const auto waveform = used_table_->of_signal[signal].find(c);
    if (waveform == used_table_->of_signal[signal].end())
      file_.fail(where, fmt::format("waveform character {} for \"{}\"", c, stream_.signals[signal].name),
                 "one that its WaveformTable defines");
    const bool is_input = stream_.signals[signal].is_input;
    const char state = state_of(signal, used_table_->waveforms[waveform->second],
                                state_of_[waveform->second][is_input ? 0 : 1]);
    if (fixed_[signal] != '\0' && c != fixed_[signal])
      file_.fail(where, fmt::format("waveform character {} for \"{}\"", c, stream_.signals[signal].name),
                 fmt::format("the {} that an F statement keeps", fixed_[signal]));
    states_[signal] = state;
    stale_[signal] = doubtful_[signal] = false;
  }
  // The cycle's character for what this one does to the signal.
  char state_of(std::size_t signal, const Waveform& waveform, char& state) {
    if (state != '\0') return state;
    const TestSignal& pin = stream_.signals[signal];
    state = waveforms_
                .add(waveform.character, fmt::format("waveform {} of \"{}\"", waveform.character, pin.name),
                     waveform.where, waveform.events, pin.is_input, used_table_->period_ns, used_table_)
                .value_or(waveform.character);
    return state;
  }

  // "\r5 0 1" to "000001".
  std::string unrolled(const Assignment& assignment) {
    std::string result;
    const std::string& text = assignment.data;
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (std::isspace(static_cast<unsigned char>(text[i])) != 0) continue;
      if (text[i] != '\\') {
        result += text[i];
        continue;
      }
      std::size_t end = i + 2;
      while (end < text.size() && std::isdigit(static_cast<unsigned char>(text[end])) != 0) ++end;
      if (i + 1 >= text.size() || text[i + 1] != 'r' || end == i + 2)
        file_.fail(assignment.where, fmt::format("\"{}\"", shown(text.substr(i, 8))), "\\rN and a character");
      const std::size_t count = number_in<std::size_t>(text.substr(i + 2, end - i - 2), 0, kMostUnrolled)
                                    .value_or(kMostUnrolled + 1);
      while (end < text.size() && std::isspace(static_cast<unsigned char>(text[end])) != 0) ++end;
      if (end >= text.size()) file_.fail(assignment.where, "\\r without a character", "\\rN and a character");
      if ((characters_ += count) > kMostStates || result.size() + count > kMostUnrolled)
        file_.fail(assignment.where, "more characters behind \\r than this program takes",
                   fmt::format("at most {}, {} in all", kMostUnrolled, kMostStates));
      result.append(count, text[end]);
      i = end;
    }
    return result;
  }

  struct Parameter {
    std::string data;
    std::size_t used = 0;  // characters that "#" has taken
    std::size_t seen = 0;  // characters that "#" or "%" has shown
    std::size_t where = 0;
  };
  using Parameters = std::map<std::size_t, Parameter>;  // by signal

  void set_timing() {
    if (used_table_ == nullptr) return;
    stream_.timing.period_ns = used_table_->period_ns;
    UsedWaveforms defined;  // say the times of what no cycle has
    for (const WaveformTable* table : used_tables_) {
      for (std::size_t s = 0; s < stream_.signals.size(); ++s) {
        for (const auto& [character, waveform] : table->of_signal[s])
          defined.add('\0', "", 0, table->waveforms[waveform].events, stream_.signals[s].is_input,
                      table->period_ns);
      }
    }
    defined.set(stream_.timing);
    waveforms_.set(stream_.timing);
    for (const UsedWaveforms::Defect& defect : waveforms_.defects())
      stream_.timing_defects.push_back(file_.defect(defect.where, defect.found, defect.expected));
  }

  // A pattern, procedure or macro: what it fixes is fixed to its end.
  void run_block(const std::vector<Statement>& list, Parameters& parameters, std::size_t depth) {
    const std::string fixed = fixed_;
    run(list, parameters, depth);
    fixed_ = fixed;
  }
  void run(const std::vector<Statement>& list, Parameters& parameters, std::size_t depth) {
    for (const Statement& statement : list) {
      if (stopped_at_) return;
      if (++steps_ > 4 * most_cycles_)
        file_.fail(statement.where, "more statements and loops than this program runs",
                   fmt::format("at most {}", 4 * most_cycles_));
      switch (statement.kind) {
        case Statement::Kind::table: {
          const auto found = file_.tables.find(statement.name);
          if (found == file_.tables.end())
            file_.fail(statement.where, fmt::format("WaveformTable \"{}\"", shown(statement.name)),
                       "one that is defined");
          if (used_table_ != nullptr && used_table_->period_ns != found->second.period_ns)
            file_.fail(statement.where,
                       fmt::format("WaveformTable \"{}\" with a period of {} ns", shown(statement.name),
                                   found->second.period_ns),
                       fmt::format("the {} ns of the one before", used_table_->period_ns));
          use(found->second);
          table_is_doubtful_ = false;
          break;
        }
        case Statement::Kind::condition:
          assign(statement, parameters);
          break;
        case Statement::Kind::fixed:
          assign(statement, parameters);
          for (const Assignment& assignment : statement.assignments) {
            for (const std::size_t s : file_.members(assignment.signals, assignment.where))
              fixed_[s] = characters_of_[s];
          }
          break;
        case Statement::Kind::vector:
          assign(statement, parameters);
          emit(statement);
          break;
        case Statement::Kind::call:
        case Statement::Kind::macro:
          call(statement, depth);
          break;
        case Statement::Kind::shift:
          shift(statement, parameters, depth);
          break;
        case Statement::Kind::loop:
          if (!statement.label.empty()) pending_label_ = statement.label;
          if (statement.body.size() == 1 && statement.body[0].kind == Statement::Kind::vector && depth == 0) {
            if (statement.count == 0) break;
            assign(statement.body[0], parameters);
            emit(statement.body[0], statement.count);
            break;
          }
          if (statement.body.empty()) break;
          for (std::size_t i = 0; i < statement.count && !stopped_at_; ++i, ++steps_)
            run(statement.body, parameters, depth);
          break;
        case Statement::Kind::stop:
          stopped_at_ = statement.where;
          return;
        case Statement::Kind::note:
          break;
      }
    }
  }
  void call(const Statement& statement, std::size_t depth) {
    const bool macro = statement.kind == Statement::Kind::macro;
    const std::vector<Statement>& body = routine(macro ? macros_ : procedures_, statement);
    if (depth >= kMaxDepth)
      file_.fail(statement.where, fmt::format("calls {} deep", depth + 1),
                 fmt::format("at most {}", kMaxDepth));
    Parameters parameters;
    for (const Assignment& assignment : statement.assignments) {
      const std::vector<std::size_t>& signals = file_.members(assignment.signals, assignment.where);
      const std::string data = unrolled(assignment);
      if (signals.size() == 1) {
        parameters[signals[0]] = {data, 0, 0, assignment.where};
      } else {
        if (data.empty() || data.size() % signals.size() != 0)
          file_.fail(assignment.where,
                     fmt::format("{} characters for \"{}\"", data.size(), shown(assignment.signals)),
                     fmt::format("{}, or as many for each vector that takes them", signals.size()));
        for (const std::size_t s : signals) parameters[s] = {"", 0, 0, assignment.where};
        for (std::size_t i = 0; i < data.size(); ++i) parameters[signals[i % signals.size()]].data += data[i];
      }
    }
    if (!statement.label.empty())
      pending_label_ = statement.label;
    else if (macro && depth == 0)
      pending_label_ = statement.name;
    const std::string characters_before = characters_of_;
    const WaveformTable* const table_before = used_table_;
    run_block(body, parameters, depth + 1);
    if (stopped_at_) return;
    if (!macro) doubt(characters_before, table_before);
    for (const auto& [signal, parameter] : parameters) {
      if (parameter.seen != parameter.data.size())
        file_.fail(
            parameter.where,
            fmt::format("{} characters for \"{}\"", parameter.data.size(), stream_.signals[signal].name),
            fmt::format("the {} that \"{}\" takes", parameter.seen, shown(statement.name)));
    }
  }
  // Tools do not agree on what stands behind a Call, the caller's last values and table or the procedure's:
  // where it matters, it has to be said.
  void doubt(const std::string& characters_before, const WaveformTable* table_before) {
    table_is_doubtful_ = table_before != nullptr && used_table_ != table_before;
    for (std::size_t s = 0; s < characters_before.size(); ++s)
      if (characters_before[s] != '\0' && characters_of_[s] != characters_before[s]) doubtful_[s] = true;
  }
  void refuse_doubtful_table(std::size_t where) const {
    if (table_is_doubtful_)
      file_.fail(where, "data behind a Call that changes the WaveformTable", "a W statement first");
  }
  // As many times as the longest data of a signal that the body shifts. Without data the standard gives its
  // vectors no number.
  void shift(const Statement& statement, Parameters& parameters, std::size_t depth) {
    std::size_t count = 0;
    for (const Statement& inner : statement.body) {
      for (const Assignment& assignment : inner.assignments) {
        if (assignment.data.find('#') == std::string::npos) continue;
        for (const std::size_t s : file_.members(assignment.signals, assignment.where)) {
          const auto found = parameters.find(s);
          if (found != parameters.end())
            count = std::max(count, found->second.data.size() - found->second.used);
        }
      }
    }
    if (count == 0)
      file_.fail(statement.where, "a Shift without data",
                 "a call with data for a signal that has \"#\" in it, or the vectors without Shift");
    if (file_.longest_chain != 0 && count != file_.longest_chain) {
      std::size_t where = statement.where;
      for (const auto& [s, parameter] : parameters) {
        if (parameter.data.size() == count) where = parameter.where;
      }
      file_.fail(where, fmt::format("scan data of {} bits", count),
                 fmt::format("{}, the longest ScanLength", file_.longest_chain));
    }
    for (std::size_t i = 0; i < count; ++i) run(statement.body, parameters, depth);
  }
  void assign(const Statement& statement, Parameters& parameters) {
    if (!statement.assignments.empty()) refuse_doubtful_table(statement.where);
    for (const Assignment& assignment : statement.assignments) {
      const std::vector<std::size_t>& signals = file_.members(assignment.signals, assignment.where);
      const std::string data = unrolled(assignment);
      if (data.size() != signals.size())
        file_.fail(assignment.where,
                   fmt::format("{} characters for \"{}\"", data.size(), shown(assignment.signals)),
                   fmt::format("{}", signals.size()));
      for (std::size_t i = 0; i < signals.size(); ++i) {
        char c = data[i];
        std::size_t where = assignment.where;
        if (c == '#' || c == '%') {
          const auto found = parameters.find(signals[i]);
          if (found == parameters.end()) continue;  // keeps its value
          Parameter& parameter = found->second;
          where = parameter.where;
          if (parameter.used >= parameter.data.size())
            file_.fail(where,
                       fmt::format("{} characters for \"{}\"", parameter.data.size(),
                                   stream_.signals[signals[i]].name),
                       "as many as the other signals have");
          const std::size_t at = parameter.used;
          if (c == '#') ++parameter.used;
          parameter.seen = at + 1;
          c = parameter.data[at];
        }
        if (used_table_ == nullptr) file_.fail(where, "data before a W statement", "a WaveformTable first");
        characters_of_[signals[i]] = c;
        resolve(signals[i], where);
      }
    }
  }
  void emit(const Statement& statement, std::uint64_t count = 1) {
    refuse_doubtful_table(statement.where);
    for (std::size_t s = 0; s < states_.size(); ++s) {
      if (characters_of_[s] == '\0')
        file_.fail(statement.where, fmt::format("no value of \"{}\" so far", stream_.signals[s].name),
                   "one before the first V");
      if (doubtful_[s])
        file_.fail(statement.where,
                   fmt::format("no value of \"{}\" since a Call that changes it", stream_.signals[s].name),
                   "one: tools do not agree on which one stays");
      if (stale_[s]) resolve(s, statement.where);
    }
    counted_ += count;
    if (stream_.cycles.size() >= most_cycles_ || stream_.cycles.size() * states_.size() >= kMostStates ||
        counted_ > kMostCounted)
      file_.fail(statement.where, "more cycles than this program takes",
                 fmt::format("at most {}, {} with loops of one, {} states", most_cycles_, kMostCounted,
                             kMostStates));
    std::string label = !statement.label.empty() && pending_label_.empty() ? statement.label : pending_label_;
    stream_.cycles.push_back({states_, std::move(label), count});
    pending_label_.clear();
  }

  const File& file_;
  CycleStream stream_;
  Library procedures_, macros_;
  std::optional<std::size_t> stopped_at_;  // the place of a Stop
  const WaveformTable* used_table_ = nullptr;
  std::set<const WaveformTable*> used_tables_;
  UsedWaveforms waveforms_;
  std::vector<std::array<char, 2>> state_of_;  // by waveform, for inputs and outputs; 0: not used so far
  std::string states_;
  std::string characters_of_;   // of each signal, as its data has them; 0: none so far
  std::string fixed_;           // the character that an F statement keeps; 0: none
  std::vector<bool> stale_;     // its state is that of a table before
  std::vector<bool> doubtful_;  // a Call has changed its character
  bool table_is_doubtful_ = false;
  std::string pending_label_;
  const std::size_t most_cycles_;
  std::uint64_t counted_ = 0;
  std::size_t steps_ = 0;
  std::size_t characters_ = 0;  // behind \r
};

}  // namespace

CycleStream parse_stil(std::string_view text, const std::string& name, std::size_t most_cycles) {
  const File file = stil::parse(text, name, {});
  return Expander(file, most_cycles).run();
}

CycleStream read_stil(const std::filesystem::path& path) {
  const auto read = [](const std::filesystem::path& file) { return read_file(file, "a STIL file"); };
  const File file = stil::parse(read(path), path.string(), read);
  return Expander(file, kMostCycles).run();
}

}  // namespace meltstage::dft
