// Parties to a run that are written in Python.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <vector>

#include "pointflight/run/link.hpp"

namespace pointflight::python {

/// An object with on_sample, take_orders and so on (`pointflight.Link`). All calls take the
/// interpreter's lock.
class PythonLink : public Link {
 public:
  /// `kinds`: bits of the samples that it wants, by their number in `Sample`; `asked`: those that
  /// lockstep waits for an answer to, too.
  PythonLink(pybind11::object link, std::uint32_t kinds, std::uint32_t asked);
  PythonLink(const PythonLink&) = delete;
  PythonLink& operator=(const PythonLink&) = delete;
  /// Holds the lock while it lets go of the object.
  ~PythonLink() override;

  void open(const RunDescription& run) override;
  void on_sample(const Sample& sample) override;
  void on_step(const StepDone& step) override;
  [[nodiscard]] bool wants_answer(const Sample& sample) const override;
  std::vector<Order> take_orders() override;
  void close() override;

 private:
  pybind11::object link_;
  std::uint32_t kinds_;
  std::uint32_t asked_;
  std::vector<Order> orders_;
};

}  // namespace pointflight::python
