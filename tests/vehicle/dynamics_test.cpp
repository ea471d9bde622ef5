#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/imu.hpp"
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

TEST(Multirotor, RungeKuttaShowsItsOrder) {
  // everything on: lag, drag, gyroscopic torque, tumbling
  VehicleSettings settings = load_vehicle("quad_330");
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

TEST(Imu, ReadsPlusGravityAtRestAndTheLeverArmWhileTurning) {
  ImuSettings settings;
  settings.position = {0.1, 0, 0};
  const Imu imu(settings, 1, 0);
  Imu::Biases biases;
  const RigidBodyState still;
  const ImuSample rest = imu.sample(0, SimTime{}, still, {}, biases);
  EXPECT_TRUE(rest.accel.isApprox(Vector3d(0, 0, kGravity), 1e-12));
  EXPECT_EQ(rest.gyro, Vector3d::Zero());
  // turning about z at 3 rad/s and speeding up by 2 rad/s^2: centripetal and tangential
  RigidBodyState turning;
  turning.omega_body = {0, 0, 3};
  const ImuSample t = imu.sample(1, SimTime{}, turning, {{0, 0, 0}, {0, 0, 2}}, biases);
  EXPECT_NEAR(t.accel.x(), -0.9, 1e-12);
  EXPECT_NEAR(t.accel.y(), 0.2, 1e-12);
  EXPECT_EQ(t.gyro.z(), 3.0);
  // tilted: gravity turns into the body; in free fall nothing is felt
  RigidBodyState rolled;
  rolled.q_world_body = quaternion_from_rpy(kPi / 2, 0, 0);
  EXPECT_NEAR(imu.sample(2, SimTime{}, rolled, {}, biases).accel.y(), kGravity, 1e-12);
  EXPECT_LT(imu.sample(3, SimTime{}, still, {{0, 0, -kGravity}, {0, 0, 0}}, biases).accel.norm(),
            1e-12);
}

TEST(Imu, NoiseAndBiasWalkHaveTheFilesDensities) {
  ImuSettings settings;
  settings.rate = 200;
  settings.gyro_noise_density = 1e-3;
  settings.accel_bias_walk = 1e-2;
  constexpr int kRuns = 400;
  constexpr int kSamples = 200;  // one second
  double gyro_square = 0.0;
  double bias_square = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const Imu imu(settings, static_cast<std::uint64_t>(run), 0);
    Imu::Biases biases;
    ImuSample last{};
    for (int i = 0; i <= kSamples; ++i) {
      last = imu.sample(i, SimTime{}, {}, {}, biases);
      gyro_square += last.gyro.squaredNorm() / (3.0 * kRuns * (kSamples + 1));
    }
    bias_square += (last.accel - Vector3d(0, 0, kGravity)).squaredNorm() / (3.0 * kRuns);
  }
  // white noise of density d sampled at f has deviation d sqrt(f); a walk grows as w sqrt(T)
  EXPECT_NEAR(std::sqrt(gyro_square), 1e-3 * std::sqrt(200.0), 1e-3 * std::sqrt(200.0) * 0.01);
  EXPECT_NEAR(std::sqrt(bias_square), 1e-2, 1e-2 * 0.1);
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
  expect_contains(error_of([] { load_vehicle("quad_300"); }), "did you mean 'quad_330'");
}

}  // namespace
}  // namespace pointflight
