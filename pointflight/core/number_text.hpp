#pragma once

#include <Eigen/Core>
#include <string>

namespace pointflight {

/// A number for people, with `decimals` digits behind the point; what rounds to zero has no minus
/// sign: 0.00, not -0.00.
std::string fixed_text(double value, int decimals);

/// A number for people, with as few digits as say it to nine: 0.036, where 0.036000000000000004
/// comes of arithmetic; 0, not -0. Files that are read again keep all digits.
std::string plain_text(double value);

/// A position for people: "(1.00, -2.50, 0.00)".
std::string point_text(const Eigen::Vector3d& point, int decimals = 2);

}  // namespace pointflight
