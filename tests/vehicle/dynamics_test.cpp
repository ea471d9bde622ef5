#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/mixer.hpp"
#include "pointflight/vehicle/multirotor.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

/// A body without rotors turning, drag or air: only what Newton and Euler say.
VehicleSettings bare(const std::string& name = "lee2010") {
  VehicleSettings settings = load_vehicle(name);
  settings.drag_area.setZero();
  settings.rotor.drag_coefficient = 0.0;
  settings.rotor.natural_frequency = 0.0;
  settings.rotor.speed_min = 0.0;
  return settings;
}

VehicleState at_rest(const VehicleSettings& settings) {
  VehicleState state;
  state.rotors.resize(settings.rotors.size());
  return state;
}

TEST(Multirotor, FreeFallIsTheParabola) {
  const Multirotor vehicle(bare());
  VehicleState state = at_rest(vehicle.settings());
  state.body.p_world = {1, 2, 100};
  state.body.v_world = {3, -1, 2};
  const std::vector<double> off(4, 0.0);
  for (int i = 0; i < 3000; ++i) vehicle.step(state, off, 1e-3);
  EXPECT_NEAR(state.body.p_world.x(), 1 + 3 * 3.0, 1e-9);
  EXPECT_NEAR(state.body.p_world.z(), 100 + 2 * 3.0 - 0.5 * kGravity * 9.0, 1e-9);
  EXPECT_NEAR(state.body.v_world.z(), 2 - kGravity * 3.0, 1e-9);
}

TEST(Multirotor, TorqueFreeSpinConservesMomentumAndEnergy) {
  const Multirotor vehicle(bare());
  const Vector3d J = vehicle.settings().inertia_diagonal;
  VehicleState state = at_rest(vehicle.settings());
  state.body.omega_body = {2.0, -1.0, 3.0};
  const auto momentum = [&] {
    return Vector3d(state.body.q_world_body * J.cwiseProduct(state.body.omega_body));
  };
  const auto energy = [&] {
    return 0.5 * state.body.omega_body.dot(J.cwiseProduct(state.body.omega_body));
  };
  const Vector3d momentum0 = momentum();
  const double energy0 = energy();
  const std::vector<double> off(4, 0.0);
  for (int i = 0; i < 10000; ++i) vehicle.step(state, off, 1e-3);
  EXPECT_LT((momentum() - momentum0).norm() / momentum0.norm(), 1e-10);
  EXPECT_NEAR(energy() / energy0, 1.0, 1e-11);
}

TEST(Multirotor, RotationalDragSlowsASpinAsTheClosedFormSays) {
  VehicleSettings settings = bare();
  settings.rotational_drag = {0.0, 0.0, 2e-4};
  const Multirotor vehicle(settings);
  VehicleState state = at_rest(settings);
  state.body.omega_body = {0.0, 0.0, 30.0};
  const std::vector<double> off(4, 0.0);
  for (int i = 0; i < 5000; ++i) vehicle.step(state, off, 1e-3);
  // J dw/dt = -K |w| w
  const double expected = 30.0 / (1.0 + 2e-4 * 30.0 * 5.0 / settings.inertia_diagonal.z());
  EXPECT_LT(expected, 25.0);
  EXPECT_NEAR(state.body.omega_body.z(), expected, 1e-9);
}

TEST(Multirotor, RungeKuttaShowsItsOrder) {
  // everything on: lag, drag, gyroscopic torque, tumbling
  VehicleSettings settings = load_vehicle("quad_330");
  settings.rotor.advance_ratios.clear();  // kinks of the rotors' curve would hide it
  const Multirotor vehicle(settings);
  const std::vector<double> commands = {900, 1100, 1000, 1050};
  const auto end_state = [&](double dt) {
    VehicleState state = vehicle.hover_at({0, 0, 0}, 0.3);
    state.body.omega_body = {1.0, -2.0, 1.5};
    state.body.v_world = {4, 1, -1};
    const int steps = static_cast<int>(std::lround(0.8 / dt));
    for (int i = 0; i < steps; ++i) vehicle.step(state, commands, dt);
    return state;
  };
  const auto truth = end_state(0.00025);
  const auto error = [&](double dt) {
    const auto s = end_state(dt);
    return (s.body.p_world - truth.body.p_world).norm() +
           (s.body.omega_body - truth.body.omega_body).norm();
  };
  const double coarse = error(0.004);
  const double fine = error(0.002);
  // fourth order: sixteen times less for half the step
  EXPECT_GT(coarse / fine, 12.0);
  EXPECT_LT(coarse / fine, 22.0);
}

TEST(Multirotor, HoversAtTheAnalyticRotorSpeed) {
  for (const char* name : {"lee2010", "marsim_quad", "quad_330"}) {
    SCOPED_TRACE(name);
    const VehicleSettings settings = load_vehicle(name);
    const double w =
        std::sqrt(settings.mass * kGravity / (4.0 * settings.rotor.thrust_coefficient));
    EXPECT_NEAR(settings.hover_speed(), w, 1e-9);
    const Multirotor vehicle(settings);
    VehicleState state = vehicle.hover_at({0, 0, 5}, 0.0);
    const std::vector<double> commands(4, w);
    for (int i = 0; i < 1000; ++i) vehicle.step(state, commands, 1e-3);
    EXPECT_LT((state.body.p_world - Vector3d(0, 0, 5)).norm(), 1e-9);
    EXPECT_LT(state.body.omega_body.norm(), 1e-9);
  }
  // as the released code: 13,151 rpm
  EXPECT_NEAR(load_vehicle("marsim_quad").hover_speed() * 60 / (2 * kPi), 13151.0, 2.0);
  EXPECT_NEAR(load_vehicle("marsim_quad").thrust_to_weight(), 7.08, 0.01);
}

TEST(Multirotor, RotorSpeedFollowsItsCommandAsASecondOrderSystem) {
  VehicleSettings settings = load_vehicle("quad_330");
  settings.rotor.natural_frequency = 50.0;
  settings.rotor.damping = 0.5;
  const Multirotor vehicle(settings);
  VehicleState state = vehicle.hover_at({0, 0, 0}, 0.0);
  const double from = settings.hover_speed();
  const double to = from + 100.0;
  const std::vector<double> commands(4, to);
  const double wd = 50.0 * std::sqrt(1 - 0.25);
  for (int i = 1; i <= 200; ++i) {
    vehicle.step(state, commands, 1e-3);
    const double t = i * 1e-3;
    const double response =
        1.0 - std::exp(-25.0 * t) * (std::cos(wd * t) + 25.0 / wd * std::sin(wd * t));
    ASSERT_NEAR(state.rotors[2].speed, from + 100.0 * response, 1e-4) << t;
  }
}

TEST(Multirotor, AWeakRotorTurnsWithItsShareOfTheCommand) {
  for (const char* name : {"quad_330", "marsim_quad"}) {  // with and without a lag
    const VehicleSettings settings = load_vehicle(name);
    const Multirotor vehicle(settings);
    for (const double share : {0.0, 0.05, 0.5, 1.0}) {
      SCOPED_TRACE(fmt::format("{} {}", name, share));
      VehicleState state = vehicle.hover_at({0, 0, 0}, 0.0);
      const double wanted = settings.hover_speed();
      FlightConditions conditions;
      conditions.rotor_shares = {1.0, share, 1.0, 1.0};
      const std::vector<double> commands(4, wanted);
      for (int i = 0; i < 1000; ++i) vehicle.step(state, commands, 1e-3, conditions);
      EXPECT_NEAR(state.rotors[1].speed, share * wanted, 1e-6);
      EXPECT_NEAR(state.rotors[0].speed, wanted, 1e-6);
    }
  }
}

TEST(Multirotor, SpinningTheBodyAgainstItsRotorsFeelsThem) {
  // all rotors turn the same way: rolling the body then pitches it
  VehicleSettings settings = bare("quad_330");
  for (RotorPlacement& rotor : settings.rotors) rotor.yaw_sign = 1.0;
  settings.rotor.torque_coefficient = 0.0;
  const Multirotor vehicle(settings);
  VehicleState state = vehicle.hover_at({0, 0, 0}, 0.0);
  state.body.omega_body = {2.0, 0.0, 0.0};
  const std::vector<double> commands(4, settings.hover_speed());
  const auto a = vehicle.acceleration(state);
  // H = -4 J w e3; torque on the body = -omega x H: y = -(omega_z H_x - omega_x H_z) = omega_x H_z
  const double h = -4.0 * settings.rotor.inertia * settings.hover_speed();
  EXPECT_NEAR(a.alpha_body.y(), 2.0 * h / settings.inertia_diagonal.y(), 1e-9);
}

TEST(Multirotor, DragTakesEnergyAway) {
  VehicleSettings settings = load_vehicle("quad_330");
  const Multirotor vehicle(settings);
  VehicleState state = vehicle.hover_at({0, 0, 0}, 0.0);
  state.body.v_world = {8, 0, 0};
  const std::vector<double> commands(4, settings.hover_speed());
  const auto a = vehicle.acceleration(state);
  const double by_hand = (0.5 * kAirDensity * settings.drag_area.x() * 64.0 +
                          4.0 * settings.rotor.drag_coefficient * settings.hover_speed() * 8.0) /
                         settings.mass;
  EXPECT_NEAR(a.a_world.x(), -by_hand, 1e-9);
}

TEST(Multirotor, ThrustFallsWithTheAdvanceRatio) {
  VehicleSettings settings = load_vehicle("quad_330");
  const RotorModel& rotor = settings.rotor;
  const double n = rotor.speed_max / (2.0 * kPi);
  const double diameter = 2.0 * rotor.radius;
  // at the table's ratios and halfway between them
  for (std::size_t i = 0; i < rotor.advance_ratios.size(); ++i) {
    const double v = rotor.advance_ratios[i] * n * diameter;
    EXPECT_NEAR(rotor.thrust_share(v, rotor.speed_max), rotor.thrust_shares[i], 1e-12);
    EXPECT_NEAR(rotor.torque_share(v, rotor.speed_max), rotor.torque_shares[i], 1e-12);
    if (i == 0) continue;
    const double between = 0.5 * (rotor.advance_ratios[i - 1] + rotor.advance_ratios[i]);
    EXPECT_NEAR(rotor.thrust_share(between * n * diameter, rotor.speed_max),
                0.5 * (rotor.thrust_shares[i - 1] + rotor.thrust_shares[i]),
                1e-12);
  }
  EXPECT_EQ(rotor.thrust_share(-5.0, rotor.speed_max), 1.0);
  // straight up at full speed: against the equation of one dimension, solved on its own
  const Multirotor vehicle(settings);
  VehicleState state = vehicle.hover_at(Vector3d::Zero(), 0.0);
  const std::vector<double> full(4, rotor.speed_max);
  for (RotorState& r : state.rotors) r.speed = rotor.speed_max;
  double v = 0.0;
  const auto rate = [&](double climb) {
    const double thrust = 4.0 * rotor.thrust_coefficient * rotor.speed_max * rotor.speed_max *
                          rotor.thrust_share(climb, rotor.speed_max);
    const double drag = 0.5 * kAirDensity * settings.drag_area.z() * climb * std::abs(climb);
    return (thrust - drag) / settings.mass - kGravity;
  };
  double fastest = 0.0;
  for (int i = 0; i < 10000; ++i) {
    vehicle.step(state, full, 1e-3);
    for (int k = 0; k < 10; ++k) v += 1e-4 * rate(v + 0.5e-4 * rate(v));
    ASSERT_NEAR(state.body.v_world.z(), v, 1e-4) << i;
    fastest = std::max(fastest, v);
  }
  EXPECT_NEAR(rate(v), 0.0, 1e-3);  // as fast as it gets
  EXPECT_LT(fastest, 30.0);
  EXPECT_GT(fastest, 15.0);
  // without the curve drag alone would hold it
  settings.rotor.advance_ratios.clear();
  EXPECT_EQ(settings.rotor.thrust_share(20.0, rotor.speed_max), 1.0);
}

TEST(Multirotor, ShaftPowerIsTorqueTimesSpeed) {
  const VehicleSettings settings = load_vehicle("quad_330");
  const Multirotor vehicle(settings);
  VehicleState state = vehicle.hover_at(Vector3d::Zero(), 0.0);
  const double w = settings.hover_speed();
  EXPECT_NEAR(
      vehicle.shaft_power(state), 4.0 * settings.rotor.torque_coefficient * w * w * w, 1e-9);
  state.body.v_world = {0, 0, 8.0};
  EXPECT_NEAR(
      vehicle.shaft_power(state),
      4.0 * settings.rotor.torque_coefficient * w * w * w * settings.rotor.torque_share(8.0, w),
      1e-9);
  FlightConditions rising;
  rising.wind_world = {0, 0, 8.0};  // the air goes along
  EXPECT_NEAR(vehicle.shaft_power(state, rising),
              4.0 * settings.rotor.torque_coefficient * w * w * w,
              1e-9);
}

TEST(Mixer, SpeedsAndWrenchAreInverse) {
  for (const char* name :
       {"lee2010", "marsim_quad", "quad_250", "quad_330", "quad_450", "hexa_550", "octo_1045"}) {
    SCOPED_TRACE(name);
    const VehicleSettings settings = load_vehicle(name);
    const Mixer mixer(settings);
    const double weight = settings.mass * kGravity;
    const RandomStream random(1, StreamId::kTest, 0);
    for (std::uint64_t i = 0; i < 200; ++i) {
      const double arm = settings.rotors[0].position.norm();
      const double yaw = settings.rotor.torque_coefficient / settings.rotor.thrust_coefficient;
      const Wrench wanted{weight * random.uniform(5 * i, 0.8, 1.5),
                          {0.1 * weight * arm * random.uniform(5 * i + 1, -1, 1),
                           0.1 * weight * arm * random.uniform(5 * i + 2, -1, 1),
                           0.1 * weight * yaw * random.uniform(5 * i + 3, -1, 1)}};
      const Wrench got = mixer.wrench(mixer.speeds(wanted));
      EXPECT_NEAR(got.thrust, wanted.thrust, 1e-9 * weight);
      EXPECT_LT((got.torque - wanted.torque).norm(), 1e-9 * weight);
    }
  }
}

TEST(Mixer, AllowsForTheRotorsClimb) {
  for (const char* name : {"quad_250", "quad_330", "hexa_550", "octo_1045"}) {
    SCOPED_TRACE(name);
    const VehicleSettings settings = load_vehicle(name);
    const Mixer mixer(settings);
    const double weight = settings.mass * kGravity;
    for (const double climb : {-6.0, -0.5, 0.0, 0.5, 3.0, 6.0, 9.0}) {
      SCOPED_TRACE(climb);
      const AirMotion motion{{2.0, -1.0, climb}, {0.4, -0.8, 0.2}};
      const Wrench wanted{1.1 * weight, {0.02 * weight * 0.1, -0.01 * weight * 0.1, 0.0}};
      const Wrench got = mixer.wrench(mixer.speeds(wanted, motion), motion);
      EXPECT_NEAR(got.thrust, wanted.thrust, 1e-9 * weight);
      EXPECT_TRUE(got.torque.isApprox(wanted.torque, 1e-7));
    }
    // speeds beyond any limit, which the mixer cuts
    const RotorModel& rotor = settings.rotor;
    const double fast = rotor.speed_for(1.0, 1000.0);
    EXPECT_NEAR(
        rotor.thrust_coefficient * fast * fast * rotor.thrust_share(1000.0, fast), 1.0, 1e-9);
    EXPECT_EQ(mixer.speeds({weight, Vector3d::Zero()}, {{0, 0, 1000}, Vector3d::Zero()})[0],
              rotor.speed_max);
    EXPECT_NEAR(rotor.speed_for(2.0, -1000.0), std::sqrt(2.0 / rotor.thrust_coefficient), 1e-9);
  }
}

TEST(Mixer, GivesUpYawBeforeTilt) {
  const VehicleSettings settings = load_vehicle("quad_330");
  const Mixer mixer(settings);
  const double weight = settings.mass * kGravity;
  const Wrench wanted{0.9 * settings.thrust_to_weight() * weight, {0.5, -0.4, 50.0}};
  const auto speeds = mixer.speeds(wanted);
  const Wrench got = mixer.wrench(speeds);
  EXPECT_NEAR(got.torque.x(), 0.5, 1e-9);
  EXPECT_NEAR(got.torque.y(), -0.4, 1e-9);
  EXPECT_LT(got.torque.z(), 5.0);
  for (const double w : speeds) {
    EXPECT_LE(w, settings.rotor.speed_max + 1e-9);
    EXPECT_GE(w, settings.rotor.speed_min - 1e-9);
  }
}

TEST(VehicleSettings, BadFilesSayWhereAndWhat) {
  const std::string good = testing::read_file(load_vehicle("quad_330").path);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return error_of([&] { parse_vehicle(text, "v.yaml"); });
  };
  expect_contains(with("mass: 1.6", "mass: -1.6"), "mass: -1.6 is out of range");
  expect_contains(with("mass: 1.6", "mass: 16"), "cannot hover");
  expect_contains(with("mass: 1.6", "mass: 1.6 kg"), "plain number in kg");
  expect_contains(with("speed_min: 150", "speed_min: 2150"), "not below speed_max");
  expect_contains(with("damping: 1.0", "dampng: 1.0"), "did you mean 'damping'");
  expect_contains(with("thrust_shares: [1,", "thrust_shares: ["), "as many of each are wanted");
  expect_contains(with("advance_ratios: [0,", "advance_ratios: [0.5,"), "not in ascending order");
  expect_contains(with("thrust_shares: [1, 0.87", "thrust_shares: [1, 1.87"),
                  "fall with the advance");
  expect_contains(error_of([] { load_vehicle("quad_300"); }), "did you mean 'quad_330'");
}

}  // namespace
}  // namespace pointflight
