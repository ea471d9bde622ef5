#pragma once

#include <pybind11/pybind11.h>

#include <span>

#include "pointflight/map/body.hpp"
#include "pointflight/render/renderer.hpp"
#include "python/bindings/arrays.hpp"

namespace pointflight::python {

/// The fields of `Hits`, of rays in a map among bodies where they are at `time`.
pybind11::tuple hits_in(const SurfelMap& map,
                        const Renderer& beams,
                        const Array<double>& origins,
                        const Array<double>& directions,
                        double range_max,
                        std::span<const Body> bodies,
                        SimTime time);

}  // namespace pointflight::python
