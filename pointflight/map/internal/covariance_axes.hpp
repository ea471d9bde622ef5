#pragma once

#include <Eigen/Eigenvalues>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Principal axes of a covariance: variances ascending, their directions as columns.
struct CovarianceAxes {
  Vector3d lambda = Vector3d::Zero();
  Matrix3d vectors = Matrix3d::Identity();
};

/// The same bits on every machine: Eigen's iterative solver needs only sqrt (computeDirect calls
/// libm's atan2, cos and sin).
inline CovarianceAxes covariance_axes(const Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(covariance);
  return {solver.eigenvalues().cwiseMax(0.0), solver.eigenvectors()};
}

}  // namespace pointflight
