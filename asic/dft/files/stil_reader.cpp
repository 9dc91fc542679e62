// SPDX-License-Identifier: Apache-2.0
// The pattern of a STIL file expanded into cycles.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

#include "asic/dft/files/stil.hpp"
#include "asic/dft/files/stil_file.hpp"
#include "base/file.hpp"
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
    for (const Assignment& exec : file_.executed) {
      const auto burst = file_.bursts.find(exec.signals);
      if (burst == file_.bursts.end())
        file_.fail(exec.where, fmt::format("PatternBurst \"{}\"", shown(exec.signals)),
                   "one that is defined");
      for (const Assignment& entry : burst->second) {
        const auto pattern = file_.patterns.find(entry.signals);
        if (pattern == file_.patterns.end())
          file_.fail(entry.where, fmt::format("pattern \"{}\"", shown(entry.signals)), "one that is defined");
        Parameters none;
        run(pattern->second, none, 0);
      }
    }
    set_timing();
    return std::move(stream_);
  }

 private:
  void use(const WaveformTable& table) {
    if (used_table_ == &table) return;
    used_table_ = &table;
    state_of_.assign(table.waveforms.size(), {'\0', '\0'});
  }
  // The cycle's character for what this one does to the signal.
  char state_of(std::size_t signal, const Waveform& waveform, char& state) {
    if (state != '\0') return state;
    const TestSignal& pin = stream_.signals[signal];
    state = waveforms_
                .add(waveform.character, fmt::format("waveform {} of \"{}\"", waveform.character, pin.name),
                     waveform.where, waveform.events, pin.is_input, used_table_->period_ns)
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
      if (i + 1 >= text.size() || text[i + 1] != 'r' || end == i + 2 || end - i > 9)
        file_.fail(assignment.where, fmt::format("\"{}\"", shown(text.substr(i, 8))), "\\rN and a character");
      const std::size_t count = static_cast<std::size_t>(std::stoul(text.substr(i + 2, end - i - 2)));
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
    std::size_t used = 0;
    std::size_t where = 0;
  };
  using Parameters = std::map<std::size_t, Parameter>;  // by signal

  void set_timing() {
    if (used_table_ == nullptr) return;
    stream_.timing.period_ns = used_table_->period_ns;
    UsedWaveforms defined;  // say the times of what no cycle has
    for (std::size_t s = 0; s < stream_.signals.size(); ++s) {
      for (const auto& [character, waveform] : used_table_->of_signal[s])
        defined.add('\0', "", 0, used_table_->waveforms[waveform].events, stream_.signals[s].is_input,
                    used_table_->period_ns);
    }
    defined.set(stream_.timing);
    waveforms_.set(stream_.timing);
    for (const UsedWaveforms::Defect& defect : waveforms_.defects())
      stream_.timing_defects.push_back(
          defect_at(file_.name, place_of(file_.text, defect.where), defect.found, defect.expected));
  }

  void run(const std::vector<Statement>& list, Parameters& parameters, std::size_t depth) {
    for (const Statement& statement : list) {
      if (++steps_ > 4 * most_cycles_)
        file_.fail(statement.where, "more statements and loops than this program runs",
                   fmt::format("at most {}", 4 * most_cycles_));
      switch (statement.kind) {
        case Statement::Kind::table: {
          const auto found = file_.tables.find(statement.name);
          if (found == file_.tables.end())
            file_.fail(statement.where, fmt::format("WaveformTable \"{}\"", shown(statement.name)),
                       "one that is defined");
          if (used_table_ != nullptr && used_table_ != &found->second)
            file_.fail(statement.where, fmt::format("a second WaveformTable \"{}\"", shown(statement.name)),
                       "one for the whole pattern");
          use(found->second);
          break;
        }
        case Statement::Kind::condition:
        case Statement::Kind::fixed:
          assign(statement, parameters);
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
          for (std::size_t i = 0; i < statement.count; ++i, ++steps_) run(statement.body, parameters, depth);
          break;
        case Statement::Kind::stop:
          break;
      }
    }
  }
  void call(const Statement& statement, std::size_t depth) {
    const bool macro = statement.kind == Statement::Kind::macro;
    const auto& defined = macro ? file_.macros : file_.procedures;
    const auto found = defined.find(statement.name);
    if (found == defined.end())
      file_.fail(statement.where,
                 fmt::format("{} \"{}\"", macro ? "macro" : "procedure", shown(statement.name)),
                 "one that is defined");
    if (depth >= kMaxDepth)
      file_.fail(statement.where, fmt::format("calls {} deep", depth), fmt::format("at most {}", kMaxDepth));
    Parameters parameters;
    for (const Assignment& assignment : statement.assignments) {
      const std::vector<std::size_t>& signals = file_.members(assignment.signals, assignment.where);
      const std::string data = unrolled(assignment);
      if (signals.size() == 1) {
        parameters[signals[0]] = {data, 0, assignment.where};
      } else {
        if (data.size() != signals.size())
          file_.fail(assignment.where,
                     fmt::format("{} characters for \"{}\"", data.size(), shown(assignment.signals)),
                     fmt::format("{}", signals.size()));
        for (std::size_t i = 0; i < signals.size(); ++i)
          parameters[signals[i]] = {std::string(1, data[i]), 0, assignment.where};
      }
    }
    if (!statement.label.empty())
      pending_label_ = statement.label;
    else if (macro && depth == 0)
      pending_label_ = statement.name;
    run(found->second, parameters, depth + 1);
    for (const auto& [signal, parameter] : parameters) {
      if (parameter.used != parameter.data.size())
        file_.fail(
            parameter.where,
            fmt::format("{} characters for \"{}\"", parameter.data.size(), stream_.signals[signal].name),
            fmt::format("the {} that \"{}\" takes", parameter.used, shown(statement.name)));
    }
  }
  // As many times as the longest data of a signal that the body shifts.
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
    if (file_.longest_chain != 0 && count != 0 && count != file_.longest_chain) {
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
          c = parameter.data[at];
        }
        if (used_table_ == nullptr) file_.fail(where, "data before a W statement", "a WaveformTable first");
        const auto waveform = used_table_->of_signal[signals[i]].find(c);
        if (waveform == used_table_->of_signal[signals[i]].end())
          file_.fail(where,
                     fmt::format("waveform character {} for \"{}\"", c, stream_.signals[signals[i]].name),
                     "one that its WaveformTable defines");
        const bool is_input = stream_.signals[signals[i]].is_input;
        states_[signals[i]] = state_of(signals[i], used_table_->waveforms[waveform->second],
                                       state_of_[waveform->second][is_input ? 0 : 1]);
      }
    }
  }
  void emit(const Statement& statement, std::uint64_t count = 1) {
    for (std::size_t s = 0; s < states_.size(); ++s) {
      if (states_[s] == '\0')
        file_.fail(statement.where, fmt::format("no value of \"{}\" so far", stream_.signals[s].name),
                   "one before the first V");
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
  const WaveformTable* used_table_ = nullptr;
  UsedWaveforms waveforms_;
  std::vector<std::array<char, 2>> state_of_;  // by waveform, for inputs and outputs; 0: not used so far
  std::string states_;
  std::string pending_label_;
  const std::size_t most_cycles_;
  std::uint64_t counted_ = 0;
  std::size_t steps_ = 0;
  std::size_t characters_ = 0;  // behind \r
};

}  // namespace

CycleStream parse_stil(std::string_view text, const std::string& name, std::size_t most_cycles) {
  const File file = stil::parse(text, name);
  return Expander(file, most_cycles).run();
}

CycleStream read_stil(const std::filesystem::path& path) {
  return parse_stil(read_file(path, "a STIL file"), path.string());
}

}  // namespace meltstage::dft
