#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <utility>

#include "pointflight/map/surfel_map.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight::python {

/// A map as Python holds it, with the renderer of single rays in it.
struct MapObject {
  explicit MapObject(std::shared_ptr<const SurfelMap> opened)
      : map(std::move(opened)), beams(make_renderer("beam", Scene{map})) {}

  std::shared_ptr<const SurfelMap> map;
  std::unique_ptr<const Renderer> beams;
};

void add_map(pybind11::module_& module);
void add_rays(pybind11::module_& module);
void add_lidar(pybind11::module_& module);

}  // namespace pointflight::python
