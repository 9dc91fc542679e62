// SPDX-License-Identifier: Apache-2.0
// Recordings of pins, and their replay on the model.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings/python/parts.hpp"
#include "bindings/python/without_gil.hpp"
#include "recording/stream.hpp"
#include "recording/text.hpp"
#include "tb/pins/model_replay.hpp"

namespace meltstage::python {

namespace py = pybind11;
using recording::Change;
using recording::Header;
using recording::Stream;

namespace {

constexpr std::uint64_t kChangesOfSlice = 1 << 16;
constexpr std::uint64_t kClocksOfSlice = 1'200'000;

// A stream that is filled without the GIL, and looks at signals now and then.
class WatchedStream final : public recording::Sink {
 public:
  explicit WatchedStream(Stream& stream) : stream_(stream) {}
  void begin(const Header& header) override { stream_.begin(header); }
  void change(const Change& change) override {
    stream_.change(change);
    if (stream_.change_count() % kChangesOfSlice == 0) look_at_signals_from_outside();
  }
  void end(std::uint64_t final_cycle) override { stream_.end(final_cycle); }

 private:
  Stream& stream_;
};

std::unique_ptr<Stream> read(const std::string& path) {
  auto stream = std::make_unique<Stream>();
  WatchedStream watched(*stream);
  const Released released;
  recording::read_text_into(path, watched);
  return stream;
}

// Text of a file, which may hold bytes that are no UTF-8.
py::str text(const std::string& bytes) {
  PyObject* decoded =
      PyUnicode_DecodeUTF8(bytes.data(), static_cast<py::ssize_t>(bytes.size()), "backslashreplace");
  if (decoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(decoded);
}

py::dict meta(const Stream& stream) {
  py::dict made;
  for (const auto& [key, value] : stream.header().meta) made[py::str(key)] = text(value);
  return made;
}

// Name, direction, width and owner of each pin.
py::list signals(const Stream& stream) {
  py::list list;
  for (const recording::Pin& pin : stream.header().pins)
    list.append(py::make_tuple(pin.name, recording::to_string(pin.direction), pin.width, pin.owner));
  return list;
}

// Cycles and values of each pin's changes.
std::vector<std::pair<py::array_t<std::uint64_t>, py::array_t<std::uint64_t>>> changes(const Stream& stream) {
  const std::size_t pins = stream.header().pins.size();
  std::vector<std::vector<std::uint64_t>> cycles(pins), values(pins);
  recording::ChangeReader reader(stream);
  without_gil([&] {
    for (std::uint64_t i = 0; i < kChangesOfSlice; ++i) {
      Change change;
      if (!reader.next(change)) return false;
      cycles[change.pin].push_back(change.cycle);
      values[change.pin].push_back(change.value);
    }
    return true;
  });
  const auto array = [](const std::vector<std::uint64_t>& from) {
    return py::array_t<std::uint64_t>(static_cast<py::ssize_t>(from.size()), from.data());
  };
  std::vector<std::pair<py::array_t<std::uint64_t>, py::array_t<std::uint64_t>>> arrays;
  for (std::size_t pin = 0; pin < pins; ++pin) arrays.emplace_back(array(cycles[pin]), array(values[pin]));
  return arrays;
}

// Clocks that were compared, and cycle, pin, recorded and model's level of the first mismatch.
py::tuple replay(const Stream& stream, const std::string& name) {
  tb::ModelReplay replay(stream, name);
  without_gil([&] { return replay.run(kClocksOfSlice); });
  if (const auto& found = replay.mismatch())
    return py::make_tuple(found->cycle,
                          py::make_tuple(found->cycle, found->pin, found->recorded, found->chip));
  return py::make_tuple(replay.cycle(), py::none());
}

}  // namespace

void bind_recording(py::module_& module) {
  py::class_<Stream>(module, "Recording")
      .def(py::init(&read), py::arg("path"))
      .def("signals", signals)
      .def("changes", changes)
      .def("replay", replay, py::arg("name"))
      .def_property_readonly("clock_hz", [](const Stream& stream) { return stream.header().clock_hz; })
      .def_property_readonly("origin", [](const Stream& stream) { return text(stream.header().origin); })
      .def_property_readonly("meta", meta)
      .def_property_readonly("first_cycle", &Stream::first_cycle)
      .def_property_readonly("final_cycle", &Stream::final_cycle);
}

}  // namespace meltstage::python
