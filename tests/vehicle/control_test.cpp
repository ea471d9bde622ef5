#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/vehicle/controller.hpp"
#include "pointflight/vehicle/multirotor.hpp"
#include "pointflight/vehicle/step_response.hpp"

namespace pointflight {
namespace {

struct Response {
  double rise_time = 0.0;  ///< 10 % to 90 %.
  double overshoot = 0.0;
  double settling = 0.0;  ///< Last time outside 5 %.
};

Response response_of(const std::vector<double>& y, double dt) {
  Response r;
  double t10 = -1;
  double t90 = -1;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double t = static_cast<double>(i) * dt;
    if (t10 < 0 && y[i] > 0.1) t10 = t;
    if (t90 < 0 && y[i] > 0.9) t90 = t;
    r.overshoot = std::max(r.overshoot, y[i] - 1.0);
    if (std::abs(y[i] - 1.0) > 0.05) r.settling = t;
  }
  r.rise_time = t90 - t10;
  return r;
}

/// The loop of one horizontal axis, linear, written apart from the controller: position PD with a
/// disturbance observer of rate l, then attitude PD whose torque passes the rotors' lag. Where the
/// demand is a = pd - d with d' = l (x'' - a - d), d is l (x' - integral of pd):
///
///   x'' = g th,  th_c = a / g,  a = pd + l (integral of pd - x'),  th'' = u (lagged),  u_c = wa^2
///   (th_c - th) - 2 za wa th' u'' = wr^2 (u_c - u) - 2 zr wr u'
std::vector<double> linear_horizontal_step(const VehicleSettings& v, double duration, double dt) {
  const LoopDesign& p = v.controller.horizontal;
  const LoopDesign& a = v.controller.roll_pitch;
  const bool ideal = v.rotor.natural_frequency <= 0.0;
  double x = 0, dx = 0, th = 0, dth = 0, u = 0, du = 0, integral = 0;
  std::vector<double> y;
  constexpr int kFine = 20;  // much finer than the simulation's step
  const double h = dt / kFine;
  for (int i = 0; i < static_cast<int>(duration / dt); ++i) {
    y.push_back(x);
    for (int k = 0; k < kFine; ++k) {
      const double wn = p.natural_frequency;
      const double e = 1.0 - x;
      const double pd = wn * wn * e - 2 * p.damping * wn * dx;
      const double acceleration = pd + p.integral * wn * (integral - dx);
      integral += pd * h;
      const double wa = a.natural_frequency;
      const double command = wa * wa * (acceleration / kGravity - th) - 2 * a.damping * wa * dth;
      if (ideal) {
        u = command;
      } else {
        const double wr = v.rotor.natural_frequency;
        du += h * (wr * wr * (command - u) - 2 * v.rotor.damping * wr * du);
        u += h * du;
      }
      dth += h * u;
      th += h * dth;
      dx += h * kGravity * th;
      x += h * dx;
    }
  }
  return y;
}

/// Height: thrust passes the lag directly (rotor speed near hover: thrust is linear in it).
std::vector<double> linear_vertical_step(const VehicleSettings& v, double duration, double dt) {
  const LoopDesign& p = v.controller.vertical;
  const bool ideal = v.rotor.natural_frequency <= 0.0;
  double z = 0, dz = 0, u = 0, du = 0, integral = 0;
  std::vector<double> y;
  constexpr int kFine = 20;
  const double h = dt / kFine;
  for (int i = 0; i < static_cast<int>(duration / dt); ++i) {
    y.push_back(z);
    for (int k = 0; k < kFine; ++k) {
      const double wn = p.natural_frequency;
      const double pd = wn * wn * (1.0 - z) - 2 * p.damping * wn * dz;
      const double command = pd + p.integral * wn * (integral - dz);
      integral += pd * h;
      if (ideal) {
        u = command;
      } else {
        const double wr = v.rotor.natural_frequency;
        du += h * (wr * wr * (command - u) - 2 * v.rotor.damping * wr * du);
        u += h * du;
      }
      dz += h * u;
      z += h * dz;
    }
  }
  return y;
}

std::vector<double> simulated_step(const VehicleSettings& settings,
                                   const Vector3d& direction,
                                   double duration) {
  const Multirotor vehicle(settings);
  const auto controller = make_controller("cascade", settings);
  ControllerMemory memory;
  VehicleState state = vehicle.hover_at({0, 0, 10}, 0.0);
  PositionCommand command;
  command.p_world = Vector3d(0, 0, 10) + direction;
  std::vector<double> y;
  for (int i = 0; i < static_cast<int>(duration * 1000); ++i) {
    y.push_back((state.body.p_world - Vector3d(0, 0, 10)).dot(direction));
    vehicle.step(state, controller->update(state.body, command, 1e-3, memory), 1e-3);
  }
  return y;
}

/// Limits out of the way and no drag: what the linear loop describes.
VehicleSettings unsaturated(const char* name) {
  VehicleSettings settings = load_vehicle(name);
  settings.controller.integral_max = 100.0;
  settings.controller.acceleration_max = 100.0;
  settings.controller.climb_acceleration_max = 100.0;
  settings.controller.tilt_max_deg = 80.0;
  settings.drag_area.setZero();
  settings.rotor.drag_coefficient = 0.0;
  return settings;
}

class LinearLoop : public ::testing::TestWithParam<const char*> {};

void expect_alike(const Response& got, const Response& wanted) {
  EXPECT_NEAR(got.rise_time, wanted.rise_time, 0.1 * wanted.rise_time);
  EXPECT_NEAR(got.settling, wanted.settling, 0.1 * wanted.settling);
  // a tenth of the overshoot, but not less than half a per cent of the step
  EXPECT_NEAR(got.overshoot, wanted.overshoot, std::max(0.005, 0.1 * wanted.overshoot));
}

TEST_P(LinearLoop, HorizontalFollowsTheLinearLoop) {
  const VehicleSettings settings = unsaturated(GetParam());
  const Response got = response_of(simulated_step(settings, {1, 0, 0}, 12.0), 1e-3);
  const Response wanted = response_of(linear_horizontal_step(settings, 12.0, 1e-3), 1e-3);
  RecordProperty("rise_ms", static_cast<int>(got.rise_time * 1e3));
  expect_alike(got, wanted);
}

TEST_P(LinearLoop, VerticalFollowsTheLinearLoop) {
  const VehicleSettings settings = unsaturated(GetParam());
  expect_alike(response_of(simulated_step(settings, {0, 0, 1}, 12.0), 1e-3),
               response_of(linear_vertical_step(settings, 12.0, 1e-3), 1e-3));
}

INSTANTIATE_TEST_SUITE_P(Vehicles,
                         LinearLoop,
                         ::testing::Values("quad_330", "lee2010", "marsim_quad"));

/// RMS distance from a circle of 3 m radius in steady flight, with feed-forward.
double circle_error(const VehicleSettings& settings, double radius, double speed) {
  const Multirotor vehicle(settings);
  const auto controller = make_controller("cascade", settings);
  ControllerMemory memory;
  const double w = speed / radius;
  const auto on_circle = [&](double t) {
    PositionCommand c;
    const double a = w * t;
    c.p_world = radius * Vector3d(std::cos(a), std::sin(a), 0);
    c.v_world = radius * w * Vector3d(-std::sin(a), std::cos(a), 0);
    c.a_world = -w * w * c.p_world;
    c.jerk_world = -w * w * c.v_world;
    return c;
  };
  VehicleState state = vehicle.hover_at(on_circle(0).p_world, 0.0);
  state.body.v_world = on_circle(0).v_world;
  double square = 0.0;
  int count = 0;
  for (int i = 0; i < 30000; ++i) {
    const double t = i * 1e-3;
    vehicle.step(state, controller->update(state.body, on_circle(t), 1e-3, memory), 1e-3);
    if (t < 10.0) continue;  // the start's transient
    square += (state.body.p_world - on_circle(t + 1e-3).p_world).squaredNorm();
    ++count;
  }
  return std::sqrt(square / count);
}

TEST(CascadedPid, TracksACircleBetterThanTheReleasedController) {
  VehicleSettings settings = load_vehicle("marsim_quad");
  const double ideal = circle_error(settings, 3.0, 3.0);
  settings.rotor.natural_frequency = 100.0;  // the lag of quad_330
  settings.rotor.damping = 1.0;
  const double lagged = circle_error(settings, 3.0, 3.0);
  std::printf("circle r 3 m at 3 m/s: %.2f mm RMS with ideal motors, %.2f mm with 20 ms of lag\n",
              ideal * 1e3,
              lagged * 1e3);
  EXPECT_LT(ideal, 0.022);
  EXPECT_LT(lagged, 0.022);
}

TEST(CascadedPid, StaysWithinItsTiltLimitAndRecoversFromALargeStep) {
  const VehicleSettings settings = load_vehicle("quad_330");
  const Multirotor vehicle(settings);
  const auto controller = make_controller("cascade", settings);
  ControllerMemory memory;
  VehicleState state = vehicle.hover_at({0, 0, 10}, 0.0);
  PositionCommand command;
  command.p_world = {30, -20, 14};
  command.yaw = 2.0;
  double worst_tilt = 0.0;
  for (int i = 0; i < 20000; ++i) {
    vehicle.step(state, controller->update(state.body, command, 1e-3, memory), 1e-3);
    const double up = (state.body.q_world_body * Vector3d::UnitZ()).z();
    worst_tilt = std::max(worst_tilt, std::acos(std::min(1.0, up)));
  }
  EXPECT_LT(worst_tilt / kDegree, settings.controller.tilt_max_deg + 10.0);
  EXPECT_LT((state.body.p_world - command.p_world).norm(), 0.005);
  EXPECT_LT(state.body.v_world.norm(), 0.005);
}

class ShippedVehicles : public ::testing::TestWithParam<const char*> {};

/// Share of a step that a second-order system of this damping overshoots by.
double overshoot_of(double damping) {
  return damping < 1.0 ? std::exp(-M_PI * damping / std::sqrt(1.0 - damping * damping)) : 0.0;
}

TEST_P(ShippedVehicles, Statistics_OvershootNoMoreThanTheirDampingPromises) {
  for (const std::string& name : model_names("vehicles")) {
    VehicleSettings settings = load_vehicle(name);
    settings.controller.kind = GetParam();
    for (const StepResponse& r : step_responses(settings)) {
      if (!r.name.starts_with("position")) continue;
      SCOPED_TRACE(name + " " + r.name);
      EXPECT_LT(r.overshoot, overshoot_of(r.design.damping) + 0.002);
      EXPECT_NEAR(r.value.back(), 1.0, 0.003);
    }
  }
}

/// Step response of a second-order system at `t` (s).
double second_order(double wn, double damping, double t) {
  if (std::abs(damping - 1.0) < 1e-6) return 1.0 - std::exp(-wn * t) * (1.0 + wn * t);
  if (damping < 1.0) {
    const double wd = wn * std::sqrt(1.0 - damping * damping);
    return 1.0 -
           std::exp(-damping * wn * t) * (std::cos(wd * t) + damping * wn / wd * std::sin(wd * t));
  }
  const double root = std::sqrt(damping * damping - 1.0);
  const double slow = wn * (damping - root);
  const double fast = wn * (damping + root);
  return 1.0 - (fast * std::exp(-slow * t) - slow * std::exp(-fast * t)) / (fast - slow);
}

/// The second-order system nearest to a response, by a search that halves its steps.
LoopDesign nearest_design(const StepResponse& response) {
  LoopDesign found = response.design;
  const auto distance = [&](const LoopDesign& d) {
    double sum = 0.0;
    for (std::size_t i = 0; i < response.value.size(); i += 10) {
      const double t = response.step * static_cast<double>(i);
      const double off = response.value[i] - second_order(d.natural_frequency, d.damping, t);
      sum += off * off;
    }
    return sum;
  };
  double least = distance(found);
  for (double step = 0.2; step > 1e-4;) {
    bool is_nearer = false;
    for (const auto& [dw, dz] : {std::pair(step, 0.0), {-step, 0.0}, {0.0, step}, {0.0, -step}}) {
      LoopDesign tried = found;
      tried.natural_frequency *= 1.0 + dw;
      tried.damping += dz;
      const double now = distance(tried);
      if (now >= least) continue;
      least = now;
      found = tried;
      is_nearer = true;
    }
    if (!is_nearer) step *= 0.5;
  }
  return found;
}

TEST_P(ShippedVehicles, Statistics_AnswerWithTheNaturalFrequencyAndDampingOfTheirFile) {
  for (const std::string& name : model_names("vehicles")) {
    VehicleSettings settings = load_vehicle(name);
    settings.controller.kind = GetParam();
    for (const StepResponse& r : step_responses(settings)) {
      if (!r.name.starts_with("position")) continue;
      SCOPED_TRACE(name + " " + r.name);
      const LoopDesign found = nearest_design(r);
      EXPECT_NEAR(found.damping, r.design.damping, 0.05);
      EXPECT_NEAR(found.natural_frequency / r.design.natural_frequency, 1.0, 0.05);
      EXPECT_LT(r.overshoot, 0.03);
    }
  }
}

/// Where a vehicle is `duration` seconds after it was told to hover at the origin.
Vector3d place_after(double duration,
                     const VehicleSettings& as_flown,
                     const VehicleSettings& as_known,
                     const Vector3d& wind_world) {
  const Multirotor vehicle(as_flown);
  const auto controller = make_controller(as_known.controller.kind, as_known);
  ControllerMemory memory;
  VehicleState state = vehicle.hover_at(Vector3d::Zero(), 0.0);
  FlightConditions conditions;
  conditions.wind_world = wind_world;
  for (int i = 0; i < static_cast<int>(duration * 1000); ++i) {
    const auto speeds = controller->update(state.body, PositionCommand{}, 1e-3, memory);
    vehicle.step(state, speeds, 1e-3, conditions);
  }
  return state.body.p_world;
}

TEST_P(ShippedVehicles, Statistics_ComeBackToTheirPlaceInSteadyWindAndWithAWrongMass) {
  for (const std::string& name : model_names("vehicles")) {
    SCOPED_TRACE(name);
    VehicleSettings known = load_vehicle(name);
    known.controller.kind = GetParam();
    VehicleSettings flown = known;
    flown.mass *= 1.15;
    const Vector3d wind(5.0, 3.0, 0.0);
    const double blown = place_after(2.0, flown, known, wind).norm();
    EXPECT_GT(blown, 0.05);  // it is a test only if something disturbs
    EXPECT_LT(place_after(30.0, flown, known, wind).norm(), 0.005);
  }
}

INSTANTIATE_TEST_SUITE_P(Controllers, ShippedVehicles, ::testing::Values("cascade", "geometric"));

}  // namespace
}  // namespace pointflight
