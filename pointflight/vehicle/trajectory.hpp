#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// Where to be and how to move there (the fields of the planners' PositionCommand messages);
/// derivatives are feed-forward and may stay zero.
struct PositionCommand {
  static constexpr std::string_view kName = "position";  ///< `name_of`
  Vector3d p_world = Vector3d::Zero();                   ///< m
  Vector3d v_world = Vector3d::Zero();                   ///< m/s
  Vector3d a_world = Vector3d::Zero();                   ///< m/s^2
  Vector3d jerk_world = Vector3d::Zero();                ///< m/s^3
  double yaw = 0.0;                                      ///< rad, from world x towards y
  double yaw_rate = 0.0;                                 ///< rad/s
};

/// A path in time. Immutable: shared by whoever follows it.
///
/// To add one: derive, with a test of its derivatives against differences of its positions.
class Trajectory {
 public:
  virtual ~Trajectory() = default;

  /// `t` seconds after its start; at rest if it begins before, if it ends after.
  [[nodiscard]] virtual PositionCommand at(double t) const = 0;

  /// Seconds.
  [[nodiscard]] virtual double duration() const = 0;
};

/// Pieces of polynomials in time, as minimum-snap and similar planners give them.
class PolynomialTrajectory : public Trajectory {
 public:
  /// Coefficients by rising power of the time since the piece's start: x, y, z (m), yaw (rad).
  struct Piece {
    double duration = 0.0;  ///< s, positive.
    /// For each of the four, any number of coefficients: an empty one is zero.
    std::array<std::vector<double>, 4> coefficients;
  };

  /// Throws InputError if a piece has no duration or a coefficient is not finite.
  explicit PolynomialTrajectory(std::vector<Piece> pieces);

  /// CSV as uav_trajectories and Crazyswarm write it: a row a piece with the columns duration, x^0
  /// to x^7, y^0 to y^7, z^0 to z^7, yaw^0 to yaw^7. Throws InputError with file and line.
  static std::shared_ptr<const PolynomialTrajectory> read(const std::string& path);
  /// The same from text; `name` stands for the path in messages.
  static std::shared_ptr<const PolynomialTrajectory> parse(std::string_view text,
                                                           const std::string& name);

  [[nodiscard]] PositionCommand at(double t) const override;
  [[nodiscard]] double duration() const override { return duration_; }
  /// As given.
  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }

 private:
  std::vector<Piece> pieces_;
  double duration_ = 0.0;
};

/// B-spline with knots at equal intervals (EGO-Planner, Fast-Planner), or given ones.
class BSplineTrajectory : public Trajectory {
 public:
  /// `points` x, y, z, yaw; at least degree + 1 of them. `knots`: points + degree + 1 times, none
  /// below the one before; it flies from knot `degree` to knot `points`. Throws InputError.
  BSplineTrajectory(std::vector<Eigen::Vector4d> points, int degree, std::vector<double> knots);

  /// Equal intervals of `interval` seconds.
  static std::shared_ptr<const BSplineTrajectory> uniform(std::vector<Eigen::Vector4d> points,
                                                          int degree,
                                                          double interval);

  /// Control points from CSV: x, y, z and yaw_deg, if there. Throws InputError with file and line.
  static std::shared_ptr<const BSplineTrajectory> read(const std::string& path,
                                                       int degree,
                                                       double interval);

  [[nodiscard]] PositionCommand at(double t) const override;
  [[nodiscard]] double duration() const override { return end_ - begin_; }
  /// Control points, as given.
  [[nodiscard]] const std::vector<Eigen::Vector4d>& points() const {
    return derivatives_[0].points;
  }
  /// As given.
  [[nodiscard]] int degree() const { return derivatives_[0].degree; }
  /// As given, or at equal intervals.
  [[nodiscard]] const std::vector<double>& knots() const { return derivatives_[0].knots; }

 private:
  /// A spline's points and knots; derivatives are splines of one degree less.
  struct Spline {
    std::vector<Eigen::Vector4d> points;
    std::vector<double> knots;
    int degree = 3;
    [[nodiscard]] Eigen::Vector4d at(double t) const;
    [[nodiscard]] Spline derivative() const;
  };
  std::array<Spline, 4> derivatives_;  ///< Itself, velocity, acceleration, jerk.
  double begin_ = 0.0;
  double end_ = 0.0;
};

}  // namespace pointflight
