#include "pointflight/vehicle/imu.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

/// A vehicle of which an IMU needs no more than its own settings.
VehicleSettings with(const ImuErrors& errors, double rate = 200.0) {
  VehicleSettings vehicle;
  vehicle.imu.rate = rate;
  vehicle.imu.errors = errors;
  return vehicle;
}

VehicleState body(const RigidBodyState& state) {
  return {state, {}};
}

TEST(Imu, ReadsPlusGravityAtRestAndTheLeverArmWhileTurning) {
  VehicleSettings vehicle;
  vehicle.imu.position = {0.1, 0, 0};
  const Imu imu(vehicle, 1, 0);
  Imu::Memory memory;
  const ImuSample rest = imu.sample(0, SimTime{}, {}, {}, memory);
  EXPECT_TRUE(rest.accel.isApprox(Vector3d(0, 0, kGravity), 1e-12));
  EXPECT_EQ(rest.gyro, Vector3d::Zero());
  // turning about z at 3 rad/s and speeding up by 2 rad/s^2: centripetal and tangential
  RigidBodyState turning;
  turning.omega_body = {0, 0, 3};
  const ImuSample t = imu.sample(1, SimTime{}, body(turning), {{0, 0, 0}, {0, 0, 2}}, memory);
  EXPECT_NEAR(t.accel.x(), -0.9, 1e-12);
  EXPECT_NEAR(t.accel.y(), 0.2, 1e-12);
  EXPECT_EQ(t.gyro.z(), 3.0);
  // tilted: gravity turns into the body; in free fall nothing is felt
  RigidBodyState rolled;
  rolled.q_world_body = quaternion_from_rpy(kPi / 2, 0, 0);
  EXPECT_NEAR(imu.sample(2, SimTime{}, body(rolled), {}, memory).accel.y(), kGravity, 1e-12);
  EXPECT_LT(imu.sample(3, SimTime{}, {}, {{0, 0, -kGravity}, {0, 0, 0}}, memory).accel.norm(),
            1e-12);
}

TEST(Imu, DrawsOfSeveralSamplesAreThoseOfEach) {
  const RandomStream stream(7, StreamId::kImuGyroNoise, 3);
  AxisNormals draws;
  for (const std::uint64_t sample : {0, 1, 15, 16, 17, 40, 3, 1'000'003}) {
    const double* drawn = draws.of(stream, sample);
    for (std::uint64_t axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(drawn[axis], stream.normal(sample * 3 + axis)) << sample;
    }
  }
}

TEST(Imu, NoiseAndBiasWalkHaveTheFilesDensities) {
  ImuErrors errors;
  errors.gyro.noise_density = 1e-3;
  errors.accel.bias_walk = 1e-2;
  constexpr int kRuns = 400;
  constexpr int kSamples = 200;  // one second
  double gyro_square = 0.0;
  double bias_square = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const Imu imu(with(errors), static_cast<std::uint64_t>(run), 0);
    Imu::Memory memory;
    ImuSample last{};
    for (int i = 0; i <= kSamples; ++i) {
      last = imu.sample(i, SimTime{}, {}, {}, memory);
      gyro_square += last.gyro.squaredNorm() / (3.0 * kRuns * (kSamples + 1));
    }
    bias_square += (last.accel - Vector3d(0, 0, kGravity)).squaredNorm() / (3.0 * kRuns);
  }
  // white noise of density d sampled at f has deviation d sqrt(f); a walk grows as w sqrt(T)
  EXPECT_NEAR(std::sqrt(gyro_square), 1e-3 * std::sqrt(200.0), 1e-3 * std::sqrt(200.0) * 0.01);
  EXPECT_NEAR(std::sqrt(bias_square), 1e-2, 1e-2 * 0.1);
}

/// Allan variance of samples `dt` apart at averaging times dt 2^k (IEEE Std 952, not overlapping).
std::vector<double> allan_variances(std::vector<double> means, std::size_t least) {
  std::vector<double> variances;
  while (means.size() >= least) {
    double sum = 0.0;
    for (std::size_t i = 1; i < means.size(); ++i) {
      sum += (means[i] - means[i - 1]) * (means[i] - means[i - 1]);
    }
    variances.push_back(0.5 * sum / static_cast<double>(means.size() - 1));
    std::vector<double> halved(means.size() / 2);
    for (std::size_t i = 0; i < halved.size(); ++i) {
      halved[i] = 0.5 * (means[2 * i] + means[2 * i + 1]);
    }
    means = std::move(halved);
  }
  return variances;
}

/// White noise N^2 / tau, floor 2 ln 2 / pi B^2, walk K^2 tau / 3 that fit variances best, each
/// weighted by the number of means it comes from.
struct Terms {
  double density, instability, walk;
};
Terms fit_terms(const std::vector<double>& variances, double dt) {
  const double floor = 2.0 * std::log(2.0) / kPi;
  // relative errors: each row weighs by the model, which is found again with new weights
  std::vector<double> model = variances;
  Vector3d x = Vector3d::Zero();
  for (int round = 0; round < 20; ++round) {
    Matrix3d a = Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    for (std::size_t k = 0; k < variances.size(); ++k) {
      const double tau = dt * static_cast<double>(std::size_t{1} << k);
      const Vector3d row(1.0 / tau, floor, tau / 3.0);
      const double weight = 1.0 / tau / (model[k] * model[k]);
      a += weight * row * row.transpose();
      b += weight * variances[k] * row;
    }
    x = a.ldlt().solve(b).cwiseMax(0.0);
    for (std::size_t k = 0; k < variances.size(); ++k) {
      const double tau = dt * static_cast<double>(std::size_t{1} << k);
      model[k] = x.dot(Vector3d(1.0 / tau, floor, tau / 3.0));
    }
  }
  return {std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2])};
}

/// Mean Allan variances of the three axes of three IMUs at rest.
std::vector<double> recorded_variances(const ImuErrors& errors,
                                       double rate,
                                       std::size_t samples,
                                       bool gyro) {
  std::vector<double> sums;
  constexpr int kRuns = 3;
  for (int run = 0; run < kRuns; ++run) {
    const Imu imu(with(errors, rate), static_cast<std::uint64_t>(run), 0);
    Imu::Memory memory;
    std::array<std::vector<double>, 3> axes;
    for (std::size_t i = 0; i < samples; ++i) {
      const ImuSample s = imu.sample(static_cast<std::int64_t>(i), SimTime{}, {}, {}, memory);
      for (int axis = 0; axis < 3; ++axis) {
        axes[static_cast<std::size_t>(axis)].push_back(gyro ? s.gyro[axis] : s.accel[axis]);
      }
    }
    for (auto& axis : axes) {
      const std::vector<double> variances = allan_variances(std::move(axis), 16);
      sums.resize(variances.size());
      for (std::size_t k = 0; k < variances.size(); ++k) sums[k] += variances[k] / (3.0 * kRuns);
    }
  }
  return sums;
}

TEST(Imu, Statistics_AllanDeviationGivesBackDensityInstabilityAndWalk) {
  // the floor is reached after 30 s and left after 3,000: all three terms show in 1.05e5 s
  ImuErrors errors;
  errors.gyro = {.noise_density = 1e-2, .bias_walk = 5.8e-5, .bias_instability = 2.75e-3};
  errors.accel = {.noise_density = 1e-1, .bias_walk = 5.8e-4, .bias_instability = 2.75e-2};
  constexpr double kRate = 2.5;
  for (const bool gyro : {true, false}) {
    const TriadErrors& truth = gyro ? errors.gyro : errors.accel;
    const auto variances = recorded_variances(errors, kRate, std::size_t{1} << 18, gyro);
    const Terms found = fit_terms(variances, 1.0 / kRate);
    EXPECT_NEAR(found.density / truth.noise_density, 1.0, 0.05);
    EXPECT_NEAR(found.instability / truth.bias_instability, 1.0, 0.2);
    EXPECT_NEAR(found.walk / truth.bias_walk, 1.0, 0.2);
  }
}

/// A sampling interval a sixtieth of the time at which white noise passes the floor, and as many
/// samples as last fifteen times longer than until the walk passes it.
struct Record {
  double dt;
  std::size_t samples;
};
Record record_for(const TriadErrors& e) {
  const double floor = 0.664 * e.bias_instability;
  const double white_until = std::pow(e.noise_density / floor, 2);
  const double walk_from = 3.0 * std::pow(floor / e.bias_walk, 2);
  const double dt = white_until / 60.0;
  return {dt, static_cast<std::size_t>(15.0 * std::max(walk_from, 10.0 * white_until) / dt)};
}

class EachPart : public ::testing::TestWithParam<std::string> {};

TEST_P(EachPart, Statistics_AllanDeviationGivesBackWhatItsFileSays) {
  if (testing::kSanitized) GTEST_SKIP() << "millions of samples for their numbers alone";
  // at such intervals 16 bits would round white noise away, which does not happen at 200 Hz
  ImuErrors errors = load_imu_part(GetParam()).errors;
  errors.bits = 0;
  errors.gyro.range = errors.accel.range = 0.0;
  for (const bool gyro : {true, false}) {
    SCOPED_TRACE(gyro ? "gyro" : "accelerometer");
    const TriadErrors& truth = gyro ? errors.gyro : errors.accel;
    ASSERT_GT(truth.bias_instability, 0.0);
    const Record record = record_for(truth);
    const auto variances = recorded_variances(errors, 1.0 / record.dt, record.samples, gyro);
    const Terms found = fit_terms(variances, record.dt);
    EXPECT_NEAR(found.density / truth.noise_density, 1.0, 0.05);
    EXPECT_NEAR(found.instability / truth.bias_instability, 1.0, 0.2);
    EXPECT_NEAR(found.walk / truth.bias_walk, 1.0, 0.2);
  }
}

INSTANTIATE_TEST_SUITE_P(ImuParts,
                         EachPart,
                         ::testing::ValuesIn(model_names("imus")),
                         [](const auto& part) { return part.param; });

/// Allan variance of a first-order Gauss-Markov process of deviation s and time constant T:
/// 2 s^2 T / tau (1 - T / (2 tau) (3 - 4 e^(-tau / T) + e^(-2 tau / T))).
double gauss_markov_variance(double s, double constant, double tau) {
  const double x = tau / constant;
  return 2.0 * s * s / x * (1.0 - (3.0 - 4.0 * std::exp(-x) + std::exp(-2.0 * x)) / (2.0 * x));
}

TEST(Imu, FlickerIsFlatOverFourDecades) {
  const double instability = 1.0;
  const FlickerNoise flicker(instability, 0.01);
  EXPECT_NEAR(flicker.deviation(), 0.664, 1e-3);
  const auto of_all = [&](double tau) {
    double sum = 0.0;
    double constant = 1.0 / 16.0;
    for (std::size_t k = 0; k < FlickerNoise::kProcesses; ++k) {
      sum += gauss_markov_variance(flicker.deviation(), constant, tau);
      constant *= 4.0;
    }
    return std::sqrt(sum);
  };
  for (double tau = 1.0; tau < 1.0e4; tau *= 1.3) {
    EXPECT_NEAR(of_all(tau) / flicker.deviation(), 1.0, 0.07) << tau;
  }
  // and that is what samples do
  ImuErrors errors;
  errors.gyro.bias_instability = instability;
  const auto variances = recorded_variances(errors, 10.0, std::size_t{1} << 17, true);
  for (std::size_t k = 3; k + 4 < variances.size(); ++k) {
    const double tau = 0.1 * static_cast<double>(std::size_t{1} << k);
    EXPECT_NEAR(std::sqrt(variances[k]) / of_all(tau), 1.0, 0.12) << tau;
  }
}

TEST(Imu, SteadyErrorsHaveTheFilesDeviationsFromRunToRun) {
  ImuErrors errors;
  errors.gyro = {.turn_on_bias = 0.01, .scale_error = 0.02, .misalignment_deg = 1.0};
  errors.accel = {.turn_on_bias = 0.2};
  errors.gyro_g_sensitivity = 0.003;
  constexpr int kRuns = 3000;
  RigidBodyState turning;
  turning.omega_body = {2, 0, 0};
  double accel = 0.0;
  Vector3d spread = Vector3d::Zero();
  for (int run = 0; run < kRuns; ++run) {
    const Imu imu(with(errors), static_cast<std::uint64_t>(run), 3);
    Imu::Memory memory;
    const ImuSample s = imu.sample(0, SimTime{}, body(turning), {}, memory);
    accel += (s.accel - Vector3d(0, 0, kGravity)).squaredNorm() / (3.0 * kRuns);
    spread += (s.gyro - Vector3d(2, 0, 0)).cwiseAbs2() / kRuns;
    // the same for the whole run
    EXPECT_EQ(imu.sample(1, SimTime{}, body(turning), {}, memory).gyro, s.gyro);
  }
  EXPECT_NEAR(std::sqrt(accel), 0.2, 0.2 * 0.03);
  const double rest = 0.01 * 0.01 + std::pow(0.003 * kGravity, 2);  // bias and force
  EXPECT_NEAR(spread.x(), rest + std::pow(2 * 0.02, 2), 0.1 * spread.x());
  EXPECT_NEAR(spread.y(), rest + std::pow(2 * kDegree, 2), 0.1 * spread.y());
  EXPECT_NEAR(spread.z(), rest + std::pow(2 * kDegree, 2), 0.1 * spread.z());
}

TEST(Imu, SaturatesAndRoundsAsItsConverterDoes) {
  ImuErrors errors;
  errors.gyro.range = 10.0;
  errors.accel.range = 20.0;
  errors.bits = 8;
  const Imu imu(with(errors), 1, 0);
  Imu::Memory memory;
  RigidBodyState state;
  state.omega_body = {11.0, -11.0, 0.03};
  const ImuSample s = imu.sample(0, SimTime{}, body(state), {}, memory);
  const double step = 20.0 / 256;
  EXPECT_NEAR(s.gyro.x(), 10.0 - step, 1e-12);
  EXPECT_NEAR(s.gyro.y(), -10.0, 1e-12);
  EXPECT_EQ(s.gyro.z(), 0.0);
  EXPECT_NEAR(s.accel.z(), 0.15625 * 63, 1e-12);  // 9.81 / (40 / 256) = 62.8
  errors.accel_bits = 6;
  Imu::Memory other;
  const ImuSample coarse = Imu(with(errors), 1, 0).sample(0, SimTime{}, body(state), {}, other);
  EXPECT_NEAR(coarse.accel.z(), 0.625 * 16, 1e-12);  // 9.81 / (40 / 64) = 15.7
  EXPECT_EQ(coarse.gyro, s.gyro);
}

TEST(Imu, ItsClockIsLateAndJitters) {
  ImuErrors errors;
  errors.clock_offset = 0.005;
  errors.clock_jitter = 0.0002;
  const Imu imu(with(errors), 1, 0);
  Imu::Memory memory;
  double mean = 0.0;
  double square = 0.0;
  constexpr int kSamples = 4000;
  for (int i = 0; i < kSamples; ++i) {
    const SimTime time{from_seconds(1.0 + 0.005 * i)};
    const ImuSample s = imu.sample(i, time, {}, {}, memory);
    ASSERT_EQ(s.time, time);
    const double late = to_seconds(s.stamp - s.time);
    mean += late / kSamples;
    square += (late - 0.005) * (late - 0.005) / kSamples;
  }
  EXPECT_NEAR(mean, 0.005, 2e-5);
  EXPECT_NEAR(std::sqrt(square), 0.0002, 1e-5);
}

TEST(Imu, RotorsAndBladesShakeAtTheirFrequencies) {
  VehicleSettings vehicle = load_vehicle("quad_330");
  vehicle.imu.part_errors.reset();
  vehicle.imu.errors = {};
  vehicle.imu.rate = 1000.0;
  vehicle.vibration = {.rotor_accel = 0.5, .blade_accel = 0.8, .rotor_gyro = 0.0, .blades = 3};
  const Imu imu(vehicle, 1, 0);
  Imu::Memory memory;
  VehicleState state;
  const double hz = 100.0;
  const double share = std::pow(2.0 * kPi * hz / vehicle.hover_speed(), 2);
  state.rotors = {{2.0 * kPi * hz, 0.0}};
  // amplitude of the lines at a frequency, by correlation over a second
  const auto amplitude = [&](int axis, double frequency) {
    std::complex<double> sum = 0.0;
    Imu::Memory fresh;
    for (int i = 0; i < 1000; ++i) {
      const double value = imu.sample(i, SimTime{}, state, {}, fresh).accel[axis];
      sum += value * std::polar(1.0, -2.0 * kPi * frequency * i / 1000.0);
    }
    return 2.0 * std::abs(sum) / 1000.0;
  };
  EXPECT_NEAR(amplitude(0, 100.0), 0.5 * share, 1e-6);
  EXPECT_NEAR(amplitude(1, 100.0), 0.5 * share, 1e-6);
  EXPECT_NEAR(amplitude(2, 300.0), 0.8 * share, 1e-6);
  EXPECT_NEAR(amplitude(0, 250.0), 0.0, 1e-6);
  EXPECT_NEAR(amplitude(2, 100.0), 0.0, 1e-6);
}

TEST(ImuParts, AreShippedAndSaidWhereTheyAreNot) {
  const std::vector<std::string> names = model_names("imus");
  EXPECT_EQ(names.size(), 9u);
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    const ImuPart part = load_imu_part(name);
    EXPECT_FALSE(part.title.empty());
    for (const TriadErrors& triad : {part.errors.gyro, part.errors.accel}) {
      EXPECT_GT(triad.noise_density, 0.0);
      EXPECT_GT(triad.bias_walk, 0.0);
      EXPECT_GT(triad.bias_instability, 0.0);
      EXPECT_GT(triad.range, 10.0);
    }
    EXPECT_EQ(part.errors.bits, 16);
  }
  EXPECT_EQ(load_vehicle("quad_330").imu.in_use().gyro.noise_density, 7.85e-5);
  const std::string text = testing::read_file(load_vehicle("quad_330").path);
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string mine = text;
    mine.replace(mine.find(from), from.size(), to);
    return error_of([&] { parse_vehicle(mine, "v.yaml"); });
  };
  expect_contains(changed("icm40609", "icm40608"), "imu.part: 'icm40608' is not among");
  expect_contains(changed("icm40609", "icm40608"), "did you mean 'icm40609'");
  expect_contains(changed("part: icm40609", "part: icm40609\n  clock_jitter: 0.001"),
                  "clock_jitter");
}

}  // namespace
}  // namespace pointflight
