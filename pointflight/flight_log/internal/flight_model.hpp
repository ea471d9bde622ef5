// The simulator's own equations beside a log: what they say an IMU should have measured.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "pointflight/flight_log/internal/flown_samples.hpp"

namespace pointflight::flight_log {

/// What is looked for. Those that are scales count as logarithms, so that they stay positive.
enum Unknown : std::size_t {
  kThrust,      ///< Of the thrust coefficient, torque with it; logarithm.
  kIdle,        ///< Least speed of the rotors by the greatest.
  kLag,         ///< Of the rotors' natural frequency; logarithm, downwards.
  kRotorDrag,   ///< `RotorModel::drag_coefficient` by mass and greatest speed, 1/s by a rotor.
  kDragAcross,  ///< Drag area along x and y by mass, m^2/kg.
  kDragAlong,   ///< The same along z.
  kInertiaX,    ///< Logarithm of the scale, as the next two.
  kInertiaY,
  kInertiaZ,
  kWindX,  ///< m/s, as the next.
  kWindY,
  kBiasX,  ///< Of the accelerometer, m/s^2, as the next two.
  kBiasY,
  kBiasZ,
  kTorqueX,  ///< Angular acceleration that is always there, rad/s^2, as the next two.
  kTorqueY,
  kTorqueZ,
  kUnknowns,
};
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

/// Their values in a vehicle file; 0 for those that are not in it.
Unknowns unknowns_of(const VehicleSettings& vehicle);
/// The vehicle file with other values, cut to what such a file may say.
VehicleSettings vehicle_with(const VehicleSettings& like, const Unknowns& values);

/// Runs a vehicle beside the samples of a log.
class FlightModel {
 public:
  /// At most so many rows are kept of all, evenly.
  static constexpr std::size_t kMostRows = 30'000;
  /// Rates are compared within blocks of so long, s.
  static constexpr double kBlock = 0.5;

  /// Both are copied.
  FlightModel(const VehicleSettings& like, std::vector<FlownSample> samples);

  /// Rows that are kept.
  [[nodiscard]] std::size_t rows() const { return kept_.size(); }
  /// Of each row: rows of one depend on each other. Ascending from 0.
  [[nodiscard]] const std::vector<std::size_t>& clusters() const { return clusters_; }
  /// s of flight in all rows.
  [[nodiscard]] double duration() const { return duration_; }

  /// How much of the variance of the logged velocity may be error, by what is left: the share by
  /// which figures measured against it may be too small.
  [[nodiscard]] double velocity_vagueness() const;

  /// Measured less modelled: six columns, specific force (m/s^2) and rates without each block's
  /// mean (rad/s). Callable from several threads.
  [[nodiscard]] Eigen::MatrixXd residuals(const Unknowns& values) const;

 private:
  struct Row {
    std::size_t sample;
    std::size_t block;
  };

  VehicleSettings like_;
  std::vector<FlownSample> samples_;
  std::vector<Row> rows_;          ///< Samples that are not settling.
  std::vector<std::size_t> kept_;  ///< Indices in `rows_`.
  std::vector<std::size_t> clusters_;
  std::size_t blocks_ = 0;
  double duration_ = 0.0;
};

}  // namespace pointflight::flight_log
