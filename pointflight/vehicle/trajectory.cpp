#include "pointflight/vehicle/trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/csv_table.hpp"

namespace pointflight {
namespace {

constexpr double kLongest = 1e6;             // s
constexpr double kLargestCoefficient = 1e9;  // of any coefficient or coordinate

/// Value and first three derivatives of a polynomial.
std::array<double, 4> derivatives_at(const std::vector<double>& coefficients, double t) {
  std::array<double, 4> value{};
  for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c) {
    for (std::size_t k = 3; k > 0; --k) {
      value[k] = value[k] * t + static_cast<double>(k) * value[k - 1];
    }
    value[0] = value[0] * t + *c;
  }
  return value;
}

}  // namespace

PolynomialTrajectory::PolynomialTrajectory(std::vector<Piece> pieces) : pieces_(std::move(pieces)) {
  if (pieces_.empty()) throw InputError("a polynomial trajectory needs at least one piece");
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const Piece& piece = pieces_[i];
    if (!(piece.duration > 0.0) || !(piece.duration <= kLongest)) {
      throw InputError(
          fmt::format("piece {} of the trajectory lasts {} s; a positive time", i, piece.duration));
    }
    for (const auto& axis : piece.coefficients) {
      for (const double c : axis) {
        if (!(std::abs(c) <= kLargestCoefficient)) {
          throw InputError(fmt::format("piece {} of the trajectory: {} is not a number up to {:g}",
                                       i,
                                       c,
                                       kLargestCoefficient));
        }
      }
    }
    duration_ += piece.duration;
  }
}

std::shared_ptr<const PolynomialTrajectory> PolynomialTrajectory::read(const std::string& path) {
  const MappedFile file(path);
  return parse(as_text(file.bytes()), path);
}

std::shared_ptr<const PolynomialTrajectory> PolynomialTrajectory::parse(std::string_view text,
                                                                        const std::string& name) {
  const CsvTable table(text, name);
  constexpr std::array<const char*, 4> kAxes = {"x^", "y^", "z^", "yaw^"};
  const int duration = table.require("duration");
  std::vector<Piece> pieces;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    Piece piece;
    piece.duration = table.at(row, duration);
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
      for (int power = 0;; ++power) {
        const int column = table.find(fmt::format("{}{}", kAxes[axis], power));
        if (column < 0) break;
        piece.coefficients[axis].push_back(table.at(row, column));
      }
      if (axis < 3 && piece.coefficients[axis].empty()) {
        static_cast<void>(table.require(kAxes[axis]));  // throws: it is not there
      }
    }
    try {
      PolynomialTrajectory check({piece});
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", table.location(row), error.what()));
    }
    pieces.push_back(std::move(piece));
  }
  return std::make_shared<PolynomialTrajectory>(std::move(pieces));
}

PositionCommand PolynomialTrajectory::at(double t) const {
  const bool moving = t >= 0.0 && t <= duration_;
  double within = std::clamp(t, 0.0, duration_);
  std::size_t i = 0;
  while (i + 1 < pieces_.size() && within > pieces_[i].duration) within -= pieces_[i++].duration;
  within = std::min(within, pieces_[i].duration);
  const auto x = derivatives_at(pieces_[i].coefficients[0], within);
  const auto y = derivatives_at(pieces_[i].coefficients[1], within);
  const auto z = derivatives_at(pieces_[i].coefficients[2], within);
  const auto yaw = derivatives_at(pieces_[i].coefficients[3], within);
  PositionCommand command;
  command.p_world = {x[0], y[0], z[0]};
  command.yaw = yaw[0];
  if (!moving) return command;
  command.v_world = {x[1], y[1], z[1]};
  command.a_world = {x[2], y[2], z[2]};
  command.jerk_world = {x[3], y[3], z[3]};
  command.yaw_rate = yaw[1];
  return command;
}

BSplineTrajectory::BSplineTrajectory(std::vector<Eigen::Vector4d> points,
                                     int degree,
                                     std::vector<double> knots) {
  if (degree < 1 || degree > 7) {
    throw InputError(fmt::format("a B-spline of degree {}; from 1 to 7", degree));
  }
  const auto p = static_cast<std::size_t>(degree);
  if (points.size() < p + 1 || knots.size() != points.size() + p + 1) {
    throw InputError(
        fmt::format("a B-spline of degree {} with {} points and {} knots; it needs {} "
                    "points or more, and as many knots and {} more",
                    degree,
                    points.size(),
                    knots.size(),
                    p + 1,
                    p + 1));
  }
  for (const auto& point : points) {
    if (!(point.cwiseAbs().maxCoeff() <= kLargestCoefficient)) {
      throw InputError(fmt::format("a point of the B-spline has a number beyond {:g}, or none",
                                   kLargestCoefficient));
    }
  }
  for (std::size_t i = 0; i < knots.size(); ++i) {
    if (!std::isfinite(knots[i]) || (i > 0 && knots[i] < knots[i - 1])) {
      throw InputError(fmt::format("knot {} of the B-spline lies before the one before it", i));
    }
  }
  begin_ = knots[p];
  end_ = knots[points.size()];
  if (!(end_ > begin_) || end_ - begin_ > kLongest) {
    throw InputError(fmt::format("the B-spline lasts {} s; a positive time", end_ - begin_));
  }
  derivatives_[0] = {std::move(points), std::move(knots), degree};
  for (std::size_t k = 1; k < 4; ++k) derivatives_[k] = derivatives_[k - 1].derivative();
}

std::shared_ptr<const BSplineTrajectory> BSplineTrajectory::uniform(
    std::vector<Eigen::Vector4d> points, int degree, double interval) {
  std::vector<double> knots;
  for (std::size_t i = 0; i < points.size() + static_cast<std::size_t>(degree) + 1; ++i) {
    knots.push_back(interval * (static_cast<double>(i) - degree));
  }
  return std::make_shared<BSplineTrajectory>(std::move(points), degree, std::move(knots));
}

std::shared_ptr<const BSplineTrajectory> BSplineTrajectory::read(const std::string& path,
                                                                 int degree,
                                                                 double interval) {
  const CsvTable table(path);
  const int columns[3] = {table.require("x"), table.require("y"), table.require("z")};
  const int yaw = table.find("yaw_deg");
  std::vector<Eigen::Vector4d> points;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Eigen::Vector4d point(table.at(row, columns[0]),
                                table.at(row, columns[1]),
                                table.at(row, columns[2]),
                                yaw < 0 ? 0.0 : kDegree * table.at(row, yaw));
    if (!(point.cwiseAbs().maxCoeff() <= kLargestCoefficient)) {
      throw InputError(fmt::format(
          "{}: a number is missing or beyond {:g}", table.location(row), kLargestCoefficient));
    }
    points.push_back(point);
  }
  try {
    return uniform(std::move(points), degree, interval);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path, error.what()));
  }
}

/// De Boor's algorithm.
Eigen::Vector4d BSplineTrajectory::Spline::at(double t) const {
  if (degree < 0 || points.empty()) return Eigen::Vector4d::Zero();
  const auto p = static_cast<std::size_t>(degree);
  // the span [knot k, knot k + 1) of t among those that are flown
  std::size_t k = p;
  while (k + 1 < points.size() && t >= knots[k + 1]) ++k;
  std::array<Eigen::Vector4d, 8> d;
  for (std::size_t j = 0; j <= p; ++j) d[j] = points[j + k - p];
  for (std::size_t r = 1; r <= p; ++r) {
    for (std::size_t j = p; j >= r; --j) {
      const double low = knots[j + k - p];
      const double high = knots[j + 1 + k - r];
      const double share = high > low ? (t - low) / (high - low) : 0.0;
      d[j] = (1.0 - share) * d[j - 1] + share * d[j];
    }
  }
  return d[p];
}

BSplineTrajectory::Spline BSplineTrajectory::Spline::derivative() const {
  Spline s;
  s.degree = degree - 1;
  if (s.degree < 0 || points.empty()) return {{}, {}, -1};
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const double span = knots[i + static_cast<std::size_t>(degree) + 1] - knots[i + 1];
    s.points.push_back(span > 0.0 ? Eigen::Vector4d(degree / span * (points[i + 1] - points[i]))
                                  : Eigen::Vector4d::Zero());
  }
  s.knots.assign(knots.begin() + 1, knots.end() - 1);
  return s;
}

PositionCommand BSplineTrajectory::at(double t) const {
  const bool moving = t >= 0.0 && t <= duration();
  const double u = begin_ + std::clamp(t, 0.0, duration());
  const Eigen::Vector4d p = derivatives_[0].at(u);
  PositionCommand command;
  command.p_world = p.head<3>();
  command.yaw = p[3];
  if (!moving) return command;
  const Eigen::Vector4d v = derivatives_[1].at(u);
  command.v_world = v.head<3>();
  command.yaw_rate = v[3];
  command.a_world = derivatives_[2].at(u).head<3>();
  command.jerk_world = derivatives_[3].at(u).head<3>();
  return command;
}

}  // namespace pointflight
