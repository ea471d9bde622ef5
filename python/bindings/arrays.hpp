// Arrays that come from numpy and go back to it.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight::python {

namespace py = pybind11;

/// Whatever numpy makes numbers of; what is of this type and contiguous is not copied.
template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

/// "(n, 3)", with n for -1.
std::string shape_text(const std::vector<py::ssize_t>& shape);

/// Throws ValueError that names the argument unless it has this shape; -1: any length.
void require_shape(const py::array& array, const char* name, const std::vector<py::ssize_t>& shape);

/// An array of (n, 3), or of (3,) which counts as one row. Throws ValueError.
Array<double> rows_of_three(const Array<double>& array, const char* name);

/// A vector of an array (3,). Throws ValueError.
Vector3d vector_from(const Array<double>& array, const char* name);

/// An array (3,).
py::array_t<double> array_of(const Vector3d& vector);

/// An array (4,): x, y, z, w.
py::array_t<double> array_of(const Quaterniond& rotation);

/// An array (4, 4).
py::array_t<double> array_of(const Pose& pose);

/// Poses T_world_sensor from (4, 4) or (n, 4, 4). Throws ValueError if one is no rigid transform.
std::vector<Pose> poses_from(const Array<double>& matrices, const char* name);

/// One of (4, 4).
Pose pose_from(const Array<double>& matrix, const char* name);

/// A range in m as float. Throws ValueError unless it is above 0 and finite.
float range_limit(double range_max);

/// A unit vector of three numbers of any length. Throws ValueError.
Vector3f direction_from(const double* at, const char* name);

/// Rays (n, 3) each, of any length of their directions; one of either counts for all of the other.
/// Throws ValueError.
std::vector<Ray> rays_from(const Array<double>& origins,
                           const Array<double>& directions,
                           float range_max);

/// An array that owns the vector's memory: nothing is copied.
template <class T>
py::array_t<T> array_of(std::vector<T> values, std::vector<py::ssize_t> shape) {
  auto* owned = new std::vector<T>(std::move(values));
  const py::capsule owner(owned, [](void* at) { delete static_cast<std::vector<T>*>(at); });
  return py::array_t<T>(std::move(shape), owned->data(), owner);
}

/// A read-only view of memory that `owner` keeps.
template <class T>
py::array_t<T> view_of(std::span<const T> values, const py::handle& owner) {
  py::array_t<T> view({static_cast<py::ssize_t>(values.size())}, values.data(), owner);
  view.attr("flags").attr("writeable") = false;
  return view;
}

}  // namespace pointflight::python
