#include "python/bindings/link.hpp"

#include <pybind11/stl.h>

#include <utility>

#include "python/bindings/run_objects.hpp"

namespace pointflight::python {
namespace py = pybind11;

namespace {

bool has(std::uint32_t kinds, const Sample& sample) {
  return (kinds >> sample.index() & 1u) != 0;
}

}  // namespace

PythonLink::PythonLink(py::object link, std::uint32_t kinds, std::uint32_t asked)
    : link_(std::move(link)), kinds_(kinds), asked_(asked) {}

PythonLink::~PythonLink() {
  const py::gil_scoped_acquire lock;
  link_ = py::object();
}

void PythonLink::open(const RunDescription& /*run*/) {
  const py::gil_scoped_acquire lock;
  link_.attr("open")();
}

void PythonLink::on_sample(const Sample& sample) {
  if (!has(kinds_, sample)) return;
  const py::gil_scoped_acquire lock;
  link_.attr("on_sample")(object_of(Sample(sample)));
}

void PythonLink::on_step(const StepDone& step) {
  const py::gil_scoped_acquire lock;
  const py::object given = link_.attr("take_orders")(step.time.time_since_epoch().count());
  if (given.is_none()) return;
  for (const py::handle one : given) {
    auto [vehicle, command] = one.cast<std::pair<std::size_t, Command>>();
    orders_.emplace_back(VehicleOrder{vehicle, std::move(command), true});
  }
}

bool PythonLink::wants_answer(const Sample& sample) const {
  return has(asked_, sample);
}

std::vector<Order> PythonLink::take_orders() {
  return std::exchange(orders_, {});
}

void PythonLink::close() {
  const py::gil_scoped_acquire lock;
  link_.attr("close")();
}

}  // namespace pointflight::python
