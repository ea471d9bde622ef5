#pragma once

#include <Eigen/Core>

namespace pointflight {

/// The x that minimises |A x - b|^2 with low <= x <= high, by an active set (Härkegård, Efficient
/// active set algorithms for solving constrained least squares problems in aircraft control
/// allocation, CDC 2002). A has full column rank. For a handful of unknowns.
Eigen::VectorXd bounded_least_squares(const Eigen::MatrixXd& A,
                                      const Eigen::VectorXd& b,
                                      const Eigen::VectorXd& low,
                                      const Eigen::VectorXd& high);

}  // namespace pointflight
