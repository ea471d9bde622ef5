#include "python/bindings/arrays.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace pointflight::python {
namespace {

constexpr double kRigid = 1e-6;  // of a rotation's products and determinant

std::vector<py::ssize_t> shape_of(const py::array& array) {
  return {array.shape(), array.shape() + array.ndim()};
}

Pose rigid_pose(const double* rows, const char* name) {
  Matrix3d rotation;
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) rotation(i, k) = rows[4 * i + k];
    pose.translation[i] = rows[4 * i + 3];
  }
  const Matrix3d product = rotation * rotation.transpose();
  const bool is_rigid = (product - Matrix3d::Identity()).cwiseAbs().maxCoeff() <= kRigid &&
                        rotation.determinant() > 0.0 && pose.translation.allFinite() &&
                        rows[12] == 0.0 && rows[13] == 0.0 && rows[14] == 0.0 && rows[15] == 1.0;
  if (!is_rigid) {
    throw py::value_error(fmt::format(
        "{}: not a rigid transform (rotation and translation above a row 0 0 0 1)", name));
  }
  pose.rotation = Quaterniond(rotation).normalized();
  return pose;
}

}  // namespace

std::string shape_text(const std::vector<py::ssize_t>& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i) {
    text += i > 0 ? ", " : "";
    text += shape[i] < 0 ? "n" : std::to_string(shape[i]);
  }
  return text + (shape.size() == 1 ? ",)" : ")");
}

void require_shape(const py::array& array,
                   const char* name,
                   const std::vector<py::ssize_t>& shape) {
  const std::vector<py::ssize_t> found = shape_of(array);
  bool fits = found.size() == shape.size();
  for (std::size_t i = 0; fits && i < shape.size(); ++i) {
    fits = shape[i] < 0 || shape[i] == found[i];
  }
  if (fits) return;
  throw py::value_error(
      fmt::format("{}: shape {} is wanted, not {}", name, shape_text(shape), shape_text(found)));
}

Array<double> rows_of_three(const Array<double>& array, const char* name) {
  if (array.ndim() == 1 && array.shape(0) == 3) return Array<double>(array).reshape({1, 3});
  require_shape(array, name, {-1, 3});
  return array;
}

Vector3d vector_from(const Array<double>& array, const char* name) {
  require_shape(array, name, {3});
  return {array.at(0), array.at(1), array.at(2)};
}

py::array_t<double> array_of(const Vector3d& vector) {
  py::array_t<double> array(3);
  for (int k = 0; k < 3; ++k) array.mutable_at(k) = vector[k];
  return array;
}

py::array_t<double> array_of(const Quaterniond& rotation) {
  py::array_t<double> array(4);
  for (int k = 0; k < 4; ++k) array.mutable_at(k) = rotation.coeffs()[k];
  return array;
}

py::array_t<double> array_of(const Pose& pose) {
  py::array_t<double> array({4, 4});
  const Matrix3d rotation = pose.rotation.toRotationMatrix();
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 3; ++k) array.mutable_at(i, k) = i < 3 ? rotation(i, k) : 0.0;
    array.mutable_at(i, 3) = i < 3 ? pose.translation[i] : 1.0;
  }
  return array;
}

std::vector<Pose> poses_from(const Array<double>& matrices, const char* name) {
  if (matrices.ndim() == 2) return {pose_from(matrices, name)};
  require_shape(matrices, name, {-1, 4, 4});
  std::vector<Pose> poses;
  for (py::ssize_t i = 0; i < matrices.shape(0); ++i) {
    poses.push_back(rigid_pose(matrices.data() + 16 * i, name));
  }
  return poses;
}

Pose pose_from(const Array<double>& matrix, const char* name) {
  require_shape(matrix, name, {4, 4});
  return rigid_pose(matrix.data(), name);
}

float range_limit(double range_max) {
  if (!(range_max > 0.0)) throw py::value_error("range_max: above 0 m is wanted");
  return static_cast<float>(std::min(range_max, 1e9));
}

Vector3f direction_from(const double* at, const char* name) {
  const Vector3d direction(at[0], at[1], at[2]);
  const double length = direction.norm();
  if (!(length > 0.0) || !std::isfinite(length)) {
    throw py::value_error(std::string(name) + ": a direction is zero or not finite");
  }
  return (direction / length).cast<float>();
}

std::vector<Ray> rays_from(const Array<double>& origins,
                           const Array<double>& directions,
                           float range_max) {
  const auto starts = static_cast<std::size_t>(origins.shape(0));
  const auto ways = static_cast<std::size_t>(directions.shape(0));
  if (starts != ways && starts != 1 && ways != 1) {
    throw py::value_error(
        "origins, directions: as many of one as of the other are wanted, or one: not " +
        std::to_string(starts) + " and " + std::to_string(ways));
  }
  const std::size_t count = starts == 0 || ways == 0 ? 0 : std::max(starts, ways);
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double* from = origins.data() + (starts == 1 ? 0 : 3 * i);
    rays[i].origin_world = {from[0], from[1], from[2]};
    if (!rays[i].origin_world.allFinite()) throw py::value_error("origins: one is not finite");
    rays[i].direction_world =
        direction_from(directions.data() + (ways == 1 ? 0 : 3 * i), "directions");
    rays[i].range_max = range_max;
  }
  return rays;
}

}  // namespace pointflight::python
