// What flights are made of, as Python holds it.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <vector>

#include "pointflight/lidar/scan.hpp"
#include "pointflight/sim/samples.hpp"

namespace pointflight::python {

/// A scan's rows, names, kinds and sizes of their fields, and how many beams were fired.
pybind11::tuple rows_of_scan(const Scan& scan);

/// A sample as an object of its class; what it holds is moved out.
pybind11::object object_of(Sample&& sample);

void add_settings(pybind11::module_& module);
void add_commands(pybind11::module_& module);
void add_samples(pybind11::module_& module);
void add_simulation(pybind11::module_& module);
void add_parts(pybind11::module_& module);
void add_flights(pybind11::module_& module);
void add_fidelity(pybind11::module_& module);

}  // namespace pointflight::python
