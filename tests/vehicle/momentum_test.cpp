// The vehicle's dynamics against a formulation of its own: the body and its rotors as one system
// with linear and angular momentum in the world frame. No gyroscopic and no spin-up torque is
// written down there: both follow from the rotors' momentum.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/multirotor.hpp"

namespace pointflight {
namespace {

/// p, linear momentum, attitude as a matrix, angular momentum about the centre of mass (both
/// world), rotor speeds and their rates.
struct Momenta {
  Vector3d p, P, L;
  Matrix3d R;
  Eigen::VectorXd w, dw;

  Momenta operator+(const Momenta& o) const {
    return {p + o.p, P + o.P, L + o.L, R + o.R, w + o.w, dw + o.dw};
  }
  friend Momenta operator*(double h, const Momenta& m) {
    return {h * m.p, h * m.P, h * m.L, h * m.R, h * m.w, h * m.dw};
  }
};

class MomentumModel {
 public:
  MomentumModel(const VehicleSettings& v, std::vector<double> commands, const Vector3d& wind)
      : v_(v), commands_(std::move(commands)), wind_(wind) {}

  /// Spin of the rotors (body frame): a rotor whose reaction torque is +z turns in the -z sense.
  [[nodiscard]] Vector3d rotor_momentum(const Eigen::VectorXd& w) const {
    double h = 0.0;
    for (std::size_t i = 0; i < v_.rotors.size(); ++i) {
      h -= v_.rotors[i].yaw_sign * v_.rotor.inertia * w[static_cast<Eigen::Index>(i)];
    }
    return {0, 0, h};
  }

  [[nodiscard]] Vector3d omega(const Momenta& m) const {
    const Matrix3d J = v_.inertia_diagonal.asDiagonal();
    return J.inverse() * (m.R.inverse() * m.L - rotor_momentum(m.w));
  }

  /// External forces at their positions; the air is all there is beside gravity.
  [[nodiscard]] Momenta rate(const Momenta& m) const {
    const Vector3d om = omega(m);
    const Vector3d v = m.P / v_.mass;
    Vector3d force = -v_.mass * kGravity * Vector3d::UnitZ();
    Vector3d torque = Vector3d::Zero();
    for (std::size_t i = 0; i < v_.rotors.size(); ++i) {
      const double w = m.w[static_cast<Eigen::Index>(i)];
      const Vector3d arm = m.R * v_.rotors[i].position;
      const Vector3d through_air = v + (m.R * om).cross(arm) - wind_;
      const Vector3d axis = m.R.col(2);
      const Vector3d sideways = through_air - axis * axis.dot(through_air);
      const Vector3d f =
          v_.rotor.thrust_coefficient * w * w * axis - v_.rotor.drag_coefficient * w * sideways;
      force += f;
      torque += arm.cross(f) + v_.rotors[i].yaw_sign * v_.rotor.torque_coefficient * w * w * axis;
    }
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d e = m.R.col(axis);
      const double along = e.dot(v - wind_);
      force -= 0.5 * kAirDensity * v_.drag_area[axis] * std::abs(along) * along * e;
    }
    for (int axis = 0; axis < 3; ++axis) {
      torque -= v_.rotational_drag[axis] * om.norm() * om[axis] * m.R.col(axis);
    }
    Matrix3d cross;
    cross << 0, -om.z(), om.y(), om.z(), 0, -om.x(), -om.y(), om.x(), 0;
    const double wn = v_.rotor.natural_frequency;
    Eigen::VectorXd ddw(m.w.size());
    for (Eigen::Index i = 0; i < m.w.size(); ++i) {
      ddw[i] = wn * wn * (commands_[static_cast<std::size_t>(i)] - m.w[i]) -
               2 * v_.rotor.damping * wn * m.dw[i];
    }
    return {v, force, torque, m.R * cross, m.dw, ddw};
  }

  [[nodiscard]] Momenta advanced(Momenta m, double duration, int steps) const {
    const double h = duration / steps;
    for (int i = 0; i < steps; ++i) {
      const Momenta a = rate(m);
      const Momenta b = rate(m + 0.5 * h * a);
      const Momenta c = rate(m + 0.5 * h * b);
      const Momenta d = rate(m + h * c);
      m = m + (h / 6) * (a + 2.0 * b + 2.0 * c + d);
    }
    return m;
  }

 private:
  const VehicleSettings& v_;
  std::vector<double> commands_;
  Vector3d wind_;
};

/// A flight that tumbles at 4 to 7 rad/s with all rotors changing speed, in wind.
struct Tumble {
  VehicleSettings settings;
  std::vector<double> commands;
  Vector3d wind{2.0, -1.0, 0.5};
  VehicleState start;

  explicit Tumble(const char* name) : settings(load_vehicle(name)) {
    // kinks of a rotor's curve would hide the order of the integrator
    settings.rotor.advance_ratios.clear();
    const Multirotor vehicle(settings);
    start = vehicle.hover_at({1, 2, 30}, 0.4);
    start.body.v_world = {3, -2, 1};
    start.body.omega_body = {1.5, -1.0, 4.0};
    for (std::size_t i = 0; i < settings.rotors.size(); ++i) {
      // alternate rotors alike, so that it does not spin up for ever
      commands.push_back(settings.hover_speed() * (0.97 + 0.02 * static_cast<double>(i % 2)));
      start.rotors[i].speed *= 0.99;
    }
  }

  [[nodiscard]] Momenta momenta(const VehicleState& s, const MomentumModel& model) const {
    Momenta m;
    m.p = s.body.p_world;
    m.P = settings.mass * s.body.v_world;
    m.R = s.body.q_world_body.toRotationMatrix();
    m.w.resize(static_cast<Eigen::Index>(s.rotors.size()));
    m.dw.resize(m.w.size());
    for (std::size_t i = 0; i < s.rotors.size(); ++i) {
      m.w[static_cast<Eigen::Index>(i)] = s.rotors[i].speed;
      m.dw[static_cast<Eigen::Index>(i)] = s.rotors[i].acceleration;
    }
    m.L = m.R *
          (settings.inertia_diagonal.cwiseProduct(s.body.omega_body) + model.rotor_momentum(m.w));
    return m;
  }

  [[nodiscard]] VehicleState flown(double duration, double dt, double* fastest = nullptr) const {
    const Multirotor vehicle(settings);
    VehicleState state = start;
    FlightConditions air;
    air.wind_world = wind;
    const int steps = static_cast<int>(std::lround(duration / dt));
    for (int i = 0; i < steps; ++i) {
      vehicle.step(state, commands, dt, air);
      if (fastest != nullptr) *fastest = std::max(*fastest, state.body.omega_body.norm());
    }
    return state;
  }
};

/// Differences in position (m), velocity (m/s), attitude (matrix entries) and rates (rad/s).
double difference(const VehicleState& s,
                  const Momenta& m,
                  const MomentumModel& model,
                  double mass) {
  return std::max({(s.body.p_world - m.p).norm(),
                   (s.body.v_world - m.P / mass).norm(),
                   (s.body.q_world_body.toRotationMatrix() - m.R).norm(),
                   (s.body.omega_body - model.omega(m)).norm()});
}

class Formulations : public ::testing::TestWithParam<const char*> {};

TEST_P(Formulations, NewtonEulerAndMomentumAgree) {
  const Tumble tumble(GetParam());
  const MomentumModel model(tumble.settings, tumble.commands, tumble.wind);
  const Momenta reference = model.advanced(tumble.momenta(tumble.start, model), 10.0, 100000);
  double fastest = 0.0;
  const VehicleState flown = tumble.flown(10.0, 0.001, &fastest);
  const double apart = difference(flown, reference, model, tumble.settings.mass);
  RecordProperty("difference", fmt::format("{:.2e}", apart));
  RecordProperty("fastest", fmt::format("{:.2f}", fastest));
  std::printf("%s: apart by %.2e after 10 s, rates up to %.2f rad/s\n", GetParam(), apart, fastest);
  EXPECT_LT(apart, 2e-9);
  EXPECT_GT(fastest, 4.0);
  EXPECT_LT(fastest, 7.5);
}

TEST_P(Formulations, TheirDifferenceFallsSixteenfoldWithHalfTheStep) {
  Tumble tumble(GetParam());
  tumble.settings.drag_area.setZero();  // |v| v has a kink if v is zero: no order there
  const MomentumModel model(tumble.settings, tumble.commands, tumble.wind);
  const Momenta reference = model.advanced(tumble.momenta(tumble.start, model), 4.0, 40000);
  const auto error = [&](double dt) {
    return difference(tumble.flown(4.0, dt), reference, model, tumble.settings.mass);
  };
  const double ratio = error(0.008) / error(0.004);
  std::printf("%s: %.2f times less with half the step\n", GetParam(), ratio);
  EXPECT_GT(ratio, 14.0);
  EXPECT_LT(ratio, 18.5);
}

TEST_P(Formulations, EnergyIsWhatForcesPutInUnderDragAndWind) {
  const Tumble tumble(GetParam());
  const VehicleSettings& v = tumble.settings;
  const Multirotor vehicle(v);
  FlightConditions air;
  air.wind_world = tumble.wind;
  const auto energy = [&](const VehicleState& s) {
    return 0.5 * v.mass * s.body.v_world.squaredNorm() + v.mass * kGravity * s.body.p_world.z() +
           0.5 * s.body.omega_body.dot(v.inertia_diagonal.cwiseProduct(s.body.omega_body));
  };
  // power of what acts on the body beside gravity, from forces written down here
  const auto power = [&](const VehicleState& s) {
    const Matrix3d R = s.body.q_world_body.toRotationMatrix();
    double sum = 0.0;
    const Vector3d v_air = R.transpose() * (s.body.v_world - tumble.wind);
    const Vector3d v_body = R.transpose() * s.body.v_world;
    for (std::size_t i = 0; i < v.rotors.size(); ++i) {
      const double w = s.rotors[i].speed;
      const Vector3d turning = s.body.omega_body.cross(v.rotors[i].position);
      const Vector3d slip = v_air + turning;
      const Vector3d f(-v.rotor.drag_coefficient * w * slip.x(),
                       -v.rotor.drag_coefficient * w * slip.y(),
                       v.rotor.thrust_coefficient * w * w);
      sum += f.dot(v_body + turning);
      sum += v.rotors[i].yaw_sign * s.body.omega_body.z() *
             (v.rotor.torque_coefficient * w * w + v.rotor.inertia * s.rotors[i].acceleration);
    }
    const Vector3d drag =
        -0.5 * kAirDensity * v.drag_area.cwiseProduct(v_air.cwiseAbs().cwiseProduct(v_air));
    const Vector3d& om = s.body.omega_body;
    const Vector3d drag_torque = -om.norm() * v.rotational_drag.cwiseProduct(om);
    return sum + drag.dot(v_body) + drag_torque.dot(om);
  };
  VehicleState s = tumble.start;
  const double before = energy(s);
  double work = 0.0;
  double turnover = 0.0;
  constexpr double kStep = 0.001;
  for (int i = 0; i < 5000; ++i) {
    // Simpson over two half steps
    const double a = power(s);
    vehicle.step(s, tumble.commands, 0.5 * kStep, air);
    const double b = power(s);
    vehicle.step(s, tumble.commands, 0.5 * kStep, air);
    const double c = power(s);
    work += kStep / 6 * (a + 4 * b + c);
    turnover += kStep / 6 * (std::abs(a) + 4 * std::abs(b) + std::abs(c));
  }
  EXPECT_GT(turnover, 10.0);  // J
  EXPECT_NEAR(energy(s) - before, work, 1e-8 * turnover);
}

INSTANTIATE_TEST_SUITE_P(Vehicles,
                         Formulations,
                         ::testing::Values("quad_250", "quad_330", "hexa_550", "octo_1045"));

TEST(Multirotor, GroundEffectIsCheesemanAndBennetts) {
  VehicleSettings settings = load_vehicle("quad_330");
  const Multirotor vehicle(settings);
  VehicleState state = vehicle.hover_at({0, 0, 1}, 0.0);
  const std::vector<double> commands(4, settings.hover_speed());
  const double radius = settings.rotor.radius;
  for (const double above : {0.05, 0.1, 0.2, 0.5, 5.0}) {
    FlightConditions air;
    air.ground_z = state.body.p_world.z() + settings.rotors[0].position.z() - above;
    const double got = vehicle.acceleration(state, air).a_world.z();
    const double h = std::max(above, 0.5 * radius);
    const double factor = above > 10 * radius ? 1.0 : 1.0 / (1.0 - std::pow(radius / (4.0 * h), 2));
    EXPECT_NEAR(got, kGravity * (factor - 1.0), 1e-9) << above;
  }
}

}  // namespace
}  // namespace pointflight
