#include "pointflight/flight_log/vehicle_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/flight_log/internal/flight_model.hpp"

namespace pointflight {
namespace {

namespace fl = flight_log;
using fl::Unknowns;
using Covariance = Eigen::Matrix<double, fl::kUnknowns, fl::kUnknowns>;

constexpr double kLeastFlight = 10.0;  // s
constexpr double kLeastRate = 40.0;    // Hz, to tell lag and inertia by
constexpr int kMostSteps = 20;
constexpr double kLargestStep = 0.5;  // of a logarithm
constexpr double kAccelBias = 0.02;   // m/s^2, of a calibrated accelerometer; assumed

/// Which unknowns are looked for; the others stay.
using Free = std::array<bool, fl::kUnknowns>;

/// What is held to be likely before the log is seen: wide, so that nothing is divided by zero.
Unknowns prior_deviations(const VehicleSettings& like) {
  Unknowns s;
  s.setConstant(1.0);                         // logarithms
  s.segment<2>(fl::kWindX).setConstant(3.0);  // m/s
  s[fl::kIdle] = 1.0;
  s[fl::kRotorDrag] = 1.0;
  s[fl::kDragAcross] = s[fl::kDragAlong] = 1.0;
  s.segment<3>(fl::kBiasX)
      .setConstant(std::hypot(kAccelBias, like.imu.in_use().accel.turn_on_bias));
  s.segment<3>(fl::kTorqueX).setConstant(10.0);
  return s;
}

/// Least squares over the rows of a model.
struct Estimate {
  Unknowns values = Unknowns::Zero();
  Covariance covariance = Covariance::Zero();
};

/// Residuals at some values, and what they come to when these change.
struct Linearization {
  Eigen::MatrixXd residuals;                 ///< Six columns.
  Eigen::RowVectorXd weights;                ///< Of the columns, by how large their residuals are.
  std::vector<Eigen::MatrixXd> derivatives;  ///< Of the model by each unknown; empty: it stays.
  Unknowns gradient = Unknowns::Zero();
  Covariance inverse = Covariance::Zero();  ///< Of the information; 0 for what stays.

  [[nodiscard]] double weighed(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) const {
    return a.cwiseProduct(b).colwise().sum().cwiseProduct(weights).sum();
  }
};

class LogFit {
 public:
  LogFit(const fl::FlightModel& model, const VehicleSettings& like, const Executor& executor)
      : model_(model),
        executor_(executor),
        start_(fl::unknowns_of(like)),
        prior_(prior_deviations(like).cwiseAbs2().cwiseInverse()) {}

  [[nodiscard]] Estimate solve(const Free& free, Unknowns values, const Progress& progress) const {
    Linearization at = linearize(free, values);
    for (int step = 0; step < kMostSteps; ++step) {
      report(progress, "fitting", static_cast<double>(step) / kMostSteps);
      Unknowns change = at.inverse * at.gradient;
      const double largest = change.head<fl::kWindX>().cwiseAbs().maxCoeff();
      if (largest > kLargestStep) change *= kLargestStep / largest;
      // what the model bends away from a straight line is no step to take whole
      const double before = cost(at, at.residuals, values);
      for (int halvings = 0; halvings < 5; ++halvings) {
        if (cost(at, model_.residuals(values + change), values + change) <= before) break;
        change *= 0.5;
      }
      values += change;
      at = linearize(free, values);
      const Unknowns deviations = at.inverse.diagonal().cwiseMax(0.0).cwiseSqrt();
      if ((change.cwiseAbs().array() <= 0.01 * deviations.array() + 1e-9).all()) break;
    }
    return {values, covariance(at)};
  }

 private:
  [[nodiscard]] Linearization linearize(const Free& free, const Unknowns& values) const {
    Linearization at;
    at.residuals = model_.residuals(values);
    at.weights = (at.residuals.colwise().squaredNorm() / static_cast<double>(model_.rows()))
                     .cwiseMax(1e-18)
                     .cwiseInverse();
    at.derivatives.resize(fl::kUnknowns);
    executor_.parallel_for(fl::kUnknowns, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j) {
        if (!free[j]) continue;
        constexpr double kStep = 1e-3;
        Unknowns moved = values;
        moved[j] += kStep;
        at.derivatives[j] = (at.residuals - model_.residuals(moved)) / kStep;
      }
    });
    Covariance information = Covariance::Identity();
    for (std::size_t i = 0; i < fl::kUnknowns; ++i) {
      if (!free[i]) continue;
      at.gradient[i] =
          at.weighed(at.derivatives[i], at.residuals) - prior_[i] * (values[i] - start_[i]);
      for (std::size_t j = 0; j <= i; ++j) {
        if (!free[j]) continue;
        const double product = at.weighed(at.derivatives[i], at.derivatives[j]);
        information(i, j) = information(j, i) = product;
      }
      information(i, i) += prior_[i];
    }
    at.inverse = information.ldlt().solve(Covariance::Identity());
    for (std::size_t i = 0; i < fl::kUnknowns; ++i) {
      if (!free[i]) at.inverse(i, i) = 0.0;
    }
    return at;
  }

  [[nodiscard]] double cost(const Linearization& at,
                            const Eigen::MatrixXd& residuals,
                            const Unknowns& values) const {
    return at.weighed(residuals, residuals) + (values - start_).cwiseAbs2().dot(prior_);
  }

  /// By clusters, and not below what independent noise would leave.
  [[nodiscard]] Covariance covariance(const Linearization& at) const {
    const std::vector<std::size_t>& clusters = model_.clusters();
    Covariance scatter = Covariance::Zero();
    double count = 0.0;
    for (std::size_t row = 0; row < clusters.size();) {
      Unknowns score = Unknowns::Zero();
      const std::size_t cluster = clusters[row];
      for (; row < clusters.size() && clusters[row] == cluster; ++row) {
        const auto index = static_cast<Eigen::Index>(row);
        const Eigen::RowVectorXd weighed = at.residuals.row(index).cwiseProduct(at.weights);
        for (std::size_t j = 0; j < fl::kUnknowns; ++j) {
          if (at.derivatives[j].size() > 0) score[j] += at.derivatives[j].row(index).dot(weighed);
        }
      }
      scatter += score * score.transpose();
      count += 1.0;
    }
    Covariance result = at.inverse * scatter * at.inverse * (count / std::max(1.0, count - 1.0));
    for (std::size_t j = 0; j < fl::kUnknowns; ++j) {
      result(j, j) = std::max(result(j, j), at.inverse(j, j));
    }
    return result;
  }

  const fl::FlightModel& model_;
  const Executor& executor_;
  Unknowns start_;
  Unknowns prior_;  ///< Inverse variances.
};

/// How an unknown is told to users.
struct FigureRow {
  fl::Unknown unknown;
  const char* key;
  const char* unit;
  double (*of)(const VehicleSettings&);
  double (*spread)(const VehicleSettings&);  ///< Of the figure for one of the unknown.
  double (*scale_error)(const ImuErrors&);   ///< Of the IMU, that it cannot be told from.
  double (*drift)(const VehicleSettings&);   ///< Deviation by what is no noise, see below.
};

double accel_scale(const ImuErrors& errors) {
  return errors.accel.scale_error;
}
double gyro_scale(const ImuErrors& errors) {
  return errors.gyro.scale_error;
}
double no_scale(const ImuErrors&) {
  return 0.0;
}

// What flicker, leaning axes, and attitudes held between samples leave is the same over a flight,
// so that stretches do not differ by it: as found over flights whose truth is known
// (docs/autopilots.md).
using V = const VehicleSettings&;
constexpr double kDrift = 0.005;
constexpr double kIdleDrift = 0.005;  // of the greatest speed
constexpr double kDragDrift = 0.02;
constexpr double kDragAlongDrift = 0.06;  // climbs are slow, and the thrust lies on the same axis

/// In the order of `fl::Unknown`.
constexpr std::array<FigureRow, 9> kFigures = {{
    {fl::kThrust,
     "rotor.thrust_coefficient",
     "N s^2",
     [](V v) { return v.rotor.thrust_coefficient; },
     [](V v) { return v.rotor.thrust_coefficient; },
     accel_scale,
     [](V v) { return kDrift * v.rotor.thrust_coefficient; }},
    {fl::kIdle,
     "rotor.speed_min",
     "rad/s",
     [](V v) { return v.rotor.speed_min; },
     [](V v) { return v.rotor.speed_max; },
     no_scale,
     [](V v) { return kIdleDrift * v.rotor.speed_max; }},
    {fl::kLag,
     "rotor.natural_frequency",
     "rad/s",
     [](V v) { return v.rotor.natural_frequency; },
     [](V v) { return v.rotor.natural_frequency; },
     no_scale,
     [](V v) { return kDrift * v.rotor.natural_frequency; }},
    {fl::kRotorDrag,
     "rotor.drag_coefficient",
     "N s^2/m",
     [](V v) { return v.rotor.drag_coefficient; },
     [](V v) { return v.mass / v.rotor.speed_max; },
     accel_scale,
     [](V v) { return kDragDrift * v.rotor.drag_coefficient; }},
    {fl::kDragAcross,
     "drag_area x, y",
     "m^2",
     [](V v) { return v.drag_area.x(); },
     [](V v) { return v.mass; },
     accel_scale,
     [](V v) { return kDragDrift * v.drag_area.x(); }},
    {fl::kDragAlong,
     "drag_area z",
     "m^2",
     [](V v) { return v.drag_area.z(); },
     [](V v) { return v.mass; },
     accel_scale,
     [](V v) { return kDragAlongDrift * v.drag_area.z(); }},
    {fl::kInertiaX,
     "inertia_diagonal x",
     "kg m^2",
     [](V v) { return v.inertia_diagonal.x(); },
     [](V v) { return v.inertia_diagonal.x(); },
     gyro_scale,
     [](V v) { return kDrift * v.inertia_diagonal.x(); }},
    {fl::kInertiaY,
     "inertia_diagonal y",
     "kg m^2",
     [](V v) { return v.inertia_diagonal.y(); },
     [](V v) { return v.inertia_diagonal.y(); },
     gyro_scale,
     [](V v) { return kDrift * v.inertia_diagonal.y(); }},
    {fl::kInertiaZ,
     "inertia_diagonal z",
     "kg m^2",
     [](V v) { return v.inertia_diagonal.z(); },
     [](V v) { return v.inertia_diagonal.z(); },
     gyro_scale,
     [](V v) { return kDrift * v.inertia_diagonal.z(); }},
}};

FittedFigure figure_of(const FigureRow& row,
                       const VehicleSettings& like,
                       const Estimate& estimate) {
  const VehicleSettings fitted = fl::vehicle_with(like, estimate.values);
  FittedFigure figure{row.key, row.unit, row.of(like), row.of(fitted), 0.0, true, {}};
  const double noise =
      row.spread(fitted) * std::sqrt(std::max(0.0, estimate.covariance(row.unknown, row.unknown)));
  figure.sigma =
      std::hypot(noise, figure.value * row.scale_error(like.imu.in_use()), row.drift(fitted));
  return figure;
}

bool is_drag(fl::Unknown unknown) {
  return unknown == fl::kRotorDrag || unknown == fl::kDragAcross || unknown == fl::kDragAlong;
}

/// True if the deviation is small enough beside the figure for it to be of use.
bool is_told(const FigureRow& row, const FittedFigure& figure, const VehicleSettings& like) {
  constexpr double kMost = 0.25;
  double size = figure.value;
  if (row.unknown == fl::kIdle) size = 0.3 * like.rotor.speed_max;
  if (is_drag(row.unknown)) size = std::max(figure.value, figure.before);
  return figure.sigma <= kMost * size;
}

/// Leaves a figure as it was.
void leave(FittedFigure& figure, std::string why) {
  figure.value = figure.before;
  figure.is_told = false;
  figure.remark = std::move(why);
}

/// What goes with the figures that are left as they were: the weight is carried as before, and
/// nothing turns by itself.
void settle(const LogFit& fit,
            const VehicleSettings& like,
            Estimate& estimate,
            const Progress& progress,
            std::vector<FittedFigure>& figures) {
  const bool is_all_told =
      std::all_of(figures.begin(), figures.end(), [](const FittedFigure& f) { return f.is_told; });
  if (is_all_told) return;
  const double bias = std::sqrt(estimate.covariance(fl::kBiasZ, fl::kBiasZ));
  const bool knows_curve = figures[fl::kIdle].is_told;
  Free free{};
  free[fl::kThrust] = !knows_curve;
  free[fl::kTorqueX] = free[fl::kTorqueY] = free[fl::kTorqueZ] = true;
  estimate = fit.solve(free, estimate.values, progress);
  if (knows_curve) return;
  FittedFigure& thrust = figures[fl::kThrust];
  thrust = figure_of(kFigures[fl::kThrust], like, estimate);
  thrust.sigma = std::hypot(thrust.sigma, thrust.value * bias / kGravity);
  thrust.remark = "with the file's speed_min";
}

LogResiduals rms_of(const Eigen::MatrixXd& residuals) {
  const Eigen::RowVectorXd rms =
      (residuals.colwise().squaredNorm() / static_cast<double>(residuals.rows())).cwiseSqrt();
  return {rms.head<3>().transpose(), rms.tail<3>().transpose()};
}

void require_flight(const FlightLog& log, double flown) {
  if (flown >= kLeastFlight) return;
  throw InputError(fmt::format(
      "{}: {:.1f} s of flight, half a metre above the ground at least: {:.0f} s are needed",
      log.path,
      flown,
      kLeastFlight));
}

}  // namespace

VehicleFit fit_vehicle(const FlightLog& log,
                       const VehicleSettings& like,
                       const Executor& executor,
                       const VehicleFitOptions& options) {
  fl::require_outputs(log, like);
  const fl::FlightModel model(like, fl::flown_samples(log, like, options.from, options.until));
  require_flight(log, model.duration());
  Free free;
  free.fill(true);
  const bool is_slow = std::min(rate_of(log.outputs), rate_of(log.imu)) < kLeastRate;
  if (is_slow || like.rotor.natural_frequency <= 0.0) free[fl::kLag] = false;
  if (is_slow) {
    for (const auto unknown : {fl::kIdle, fl::kInertiaX, fl::kInertiaY, fl::kInertiaZ}) {
      free[unknown] = false;
    }
  }
  const LogFit fit(model, like, executor);
  const Unknowns start = fl::unknowns_of(like);
  Estimate estimate = fit.solve(free, start, options.progress);

  VehicleFit result;
  result.flown = model.duration();
  for (const FigureRow& row : kFigures) {
    FittedFigure& figure = result.figures.emplace_back(figure_of(row, like, estimate));
    if (!free[row.unknown]) {
      leave(figure,
            is_slow ? fmt::format("{} at {:.0f} Hz, IMU at {:.0f} Hz: {:.0f} Hz are needed",
                                  log.outputs_from,
                                  rate_of(log.outputs),
                                  rate_of(log.imu),
                                  kLeastRate)
                    : "the file's motors have no lag");
      continue;
    }
    // what is measured against a velocity that is off itself comes out too small
    if (is_drag(row.unknown)) {
      const double vague = model.velocity_vagueness();
      figure.sigma = std::isfinite(vague) ? std::hypot(figure.sigma, figure.value * vague) : vague;
    }
    if (row.unknown == fl::kThrust || is_told(row, figure, like)) continue;
    leave(figure, "the flight does not excite it enough");
    estimate.values[row.unknown] = start[row.unknown];
  }
  settle(fit, like, estimate, options.progress, result.figures);
  result.vehicle = fl::vehicle_with(like, estimate.values);
  result.before = rms_of(model.residuals(start));
  result.after = rms_of(model.residuals(estimate.values));
  report(options.progress, "fitting", 1.0);
  return result;
}

}  // namespace pointflight
