// States of vehicles of other processes: moved on, put between two, bounded; clocks of others.
#include "pointflight/share/remote_track.hpp"

#include <gtest/gtest.h>

#include <random>

#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/share/clock_estimate.hpp"
#include "pointflight/vehicle/multirotor.hpp"

namespace pointflight {
namespace {

SimTime at(double seconds) {
  return SimTime(from_seconds(seconds));
}

RigidBodyState turning() {
  RigidBodyState state;
  state.p_world = {1, 2, 3};
  state.v_world = {2, -1, 0.5};
  state.omega_body = {0.3, -0.2, 1.5};
  state.q_world_body = quaternion_from_rpy(0.1, -0.2, 0.7);
  return state;
}

TEST(RemoteTrack, AStateIsMovedOnAsItsVelocitiesSay) {
  const RigidBodyState state = turning();
  const RigidBodyState moved = moved_on(state, 0.4);
  EXPECT_NEAR((moved.p_world - Vector3d(1.8, 1.6, 3.2)).norm(), 0.0, 1e-12);
  // dq/dt = q w / 2, in small steps
  Quaterniond q = state.q_world_body;
  constexpr int kSteps = 40000;
  for (int i = 0; i < kSteps; ++i) {
    const Vector3d half = 0.5 * 0.4 / kSteps * state.omega_body;
    const Quaterniond rate = q * Quaterniond(0.0, half.x(), half.y(), half.z());
    q.coeffs() += rate.coeffs();
    q.normalize();
  }
  EXPECT_LT(rotation_vector(q.conjugate() * moved.q_world_body).norm(), 1e-6);
  EXPECT_EQ(moved.v_world, state.v_world);
}

TEST(RemoteTrack, Statistics_NothingThatRotorsCanDoIsBeyondTheBound) {
  std::mt19937 draws(1);
  const auto draw = [&draws](double least, double most) {
    return least + (most - least) * static_cast<double>(draws()) / 4294967295.0;
  };
  for (const char* name : {"quad_330", "quad_250", "hexa_550"}) {
    const VehicleSettings settings = load_vehicle(name);
    const Multirotor dynamics(settings);
    const double radius = bounding_radius(settings.hull());
    double worst = 0.0;
    for (int k = 0; k < 3000; ++k) {
      VehicleState state = dynamics.hover_at({0, 0, 10}, draw(-3, 3));
      const auto any = [&](double most) {
        return Vector3d(draw(-1, 1), draw(-1, 1), draw(-1, 1)).normalized() * draw(0, most);
      };
      state.body.v_world = any(settings.controller.speed_max);
      state.body.omega_body = any(0.6 * settings.controller.body_rate_max);
      for (RotorState& rotor : state.rotors) {
        rotor.speed = draw(settings.rotor.speed_min, settings.rotor.speed_max);
      }
      std::vector<double> commands(settings.rotors.size());
      for (double& command : commands) command = draw(0, 1) < 0.5 ? 0.0 : settings.rotor.speed_max;
      const RigidBodyState before = state.body;
      for (int ms = 1; ms <= 50; ++ms) {
        dynamics.step(state, commands, 1e-3);
        // beyond what its autopilot lets it turn, the bound promises nothing
        if (state.body.omega_body.norm() > settings.controller.body_rate_max) break;
        const RigidBodyState moved = moved_on(before, 1e-3 * ms);
        const double bound = extrapolation_bound(settings, radius, 1e-3 * ms);
        for (const Vector3d& corner :
             {Vector3d(radius, 0, 0), Vector3d(0, radius, 0), Vector3d(0, 0, radius)}) {
          const double off =
              (moved.T_world_body() * corner - state.body.T_world_body() * corner).norm();
          ASSERT_LE(off, bound) << name << " after " << ms << " ms";
          worst = std::max(worst, off / bound);
        }
      }
    }
    EXPECT_GT(worst, 0.2) << "a bound that says little";
  }
}

TEST(RemoteTrack, BetweenStatesACubicIsExact) {
  const auto place = [](double t) {
    return Vector3d(1 + 2 * t - t * t * t, 0.5 * t * t, 3 - t + 2 * t * t * t);
  };
  const auto speed = [](double t) { return Vector3d(2 - 3 * t * t, t, -1 + 6 * t * t); };
  RemoteTrack track;
  for (const double t : {0.0, 0.1, 0.3, 0.2}) {  // one comes late
    RigidBodyState state;
    state.p_world = place(t);
    state.v_world = speed(t);
    state.q_world_body = quaternion_from_rpy(0, 0, 0.8 * t);
    track.add(at(t), state);
    track.add(at(t), state);  // and each twice
  }
  EXPECT_EQ(track.newest(), at(0.3));
  EXPECT_FALSE(track.at(at(-0.001), std::chrono::seconds(1)));
  for (double t = 0.0; t <= 0.3; t += 0.007) {
    const auto state = track.at(at(t), std::chrono::seconds(1));
    ASSERT_TRUE(state);
    EXPECT_LT((state->p_world - place(t)).norm(), 1e-9) << t;
    EXPECT_NEAR(yaw_of(state->q_world_body), 0.8 * t, 1e-5);
  }
  // beyond the last: moved on, but not for longer than is asked for
  const auto later = track.at(at(0.5), std::chrono::milliseconds(100));
  ASSERT_TRUE(later);
  EXPECT_LT((later->p_world - (place(0.3) + 0.1 * speed(0.3))).norm(), 1e-9);
  const auto poses = track.track(at(0.1), at(0.2), std::chrono::seconds(1));
  ASSERT_TRUE(poses);
  for (double t = 0.1; t <= 0.2; t += 0.0013) {
    EXPECT_LT((poses->at(at(t)).translation - place(t)).norm(), 1e-4) << t;
  }
  EXPECT_FALSE(track.track(at(-2), at(-1), std::chrono::seconds(1)));
}

/// Two clocks with messages there and back, whose ways take what `way` says.
template <class Way>
void exchange(ClockEstimate& estimate, std::int64_t offset, const Way& way) {
  for (std::int64_t k = 0; k < 40; ++k) {
    const std::int64_t sent = k * 100'000'000;
    const std::int64_t came = sent + way();
    const std::int64_t answered = came + 30'000'000;
    estimate.add(sent, 30'000'000, answered + way(), answered + offset);
  }
}

TEST(ClockEstimate, IsAsFarOffAsItSays) {
  std::mt19937 draws(2);
  ClockEstimate even(1.0);
  constexpr std::int64_t kOffset = 123'456'789;
  exchange(even, kOffset, [] { return 2'000'000; });
  const auto reading = even.at(5'000'000'000);
  ASSERT_TRUE(reading);
  EXPECT_NEAR(static_cast<double>(reading->clock - 5'000'000'000 - kOffset), 0.0, 10.0);
  EXPECT_EQ(reading->error, 2'000'000);
  // ways that differ and change: off by less than it says, and the quickest count
  ClockEstimate uneven(1.0);
  exchange(
      uneven, kOffset, [&] { return 1'000'000 + static_cast<std::int64_t>(draws() % 20'000'000); });
  const auto rough = uneven.at(4'000'000'000);
  ASSERT_TRUE(rough);
  EXPECT_LE(std::abs(rough->clock - 4'000'000'000 - kOffset), rough->error);
  EXPECT_LT(rough->error, 8'000'000);
}

TEST(ClockEstimate, RunsAtTheRunsRateAndTakesNoNonsense) {
  ClockEstimate fast(4.0);
  EXPECT_FALSE(fast.at(0));
  fast.add(100, 0, 50, 0);         // came before it was sent
  fast.add(0, 1'000'000, 500, 0);  // held for longer than it took
  fast.add(0, -1, 500, 0);
  fast.add(0, 0, 10'000'000'000, 0);  // ten seconds on the way
  EXPECT_FALSE(fast.at(0));
  fast.add(0, 0, 2'000'000, 8'000'000'000);
  EXPECT_EQ(fast.at(1'001'000'000)->clock, 12'000'000'000);
  fast.clear();
  EXPECT_FALSE(fast.at(0));
}

}  // namespace
}  // namespace pointflight
