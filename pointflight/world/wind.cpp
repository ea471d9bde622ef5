#include "pointflight/world/wind.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

constexpr Named<Turbulence> kTurbulence[] = {{Turbulence::kNone, "none"},
                                             {Turbulence::kLight, "light"},
                                             {Turbulence::kModerate, "moderate"},
                                             {Turbulence::kSevere, "severe"},
                                             {Turbulence::kCustom, "custom"}};
constexpr double kFoot = 0.3048;         // m
constexpr double kKnot = 1852.0 / 3600;  // m/s
constexpr double kLeastAirspeed = 1.0;   // m/s: a hovering vehicle still meets gusts that drift by

/// Filter of first order driven by white noise; deviation 1 at any step.
void advance_first(double& z, double h, double normal) {
  const double keep = math::exp(-h);
  z = keep * z + std::sqrt(std::max(0.0, 1.0 - keep * keep)) * normal;
}

/// The states of sqrt(3) s + 1 over (s + 1)^2 in units of their own time, each of deviation 1/2,
/// over a step h: x' = y, y' = -x - 2 y + noise. Exact: the noise that enters over the step has the
/// covariance integral of e^-2s (s, 1-s)(s, 1-s)^T.
void advance_second(std::array<double, 2>& z, double h, const std::array<double, 2>& normals) {
  const double keep = math::exp(-h);
  const double x = keep * ((1.0 + h) * z[0] + h * z[1]);
  const double y = keep * (-h * z[0] + (1.0 - h) * z[1]);
  // Gauss-Legendre of five points: closed forms cancel at small h
  constexpr std::array<double, 5> kAt = {
      -0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831, 0.9061798459386640};
  constexpr std::array<double, 5> kWeight = {0.2369268850561891,
                                             0.4786286704993665,
                                             0.5688888888888889,
                                             0.4786286704993665,
                                             0.2369268850561891};
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (std::size_t i = 0; i < kAt.size(); ++i) {
    const double s = 0.5 * h * (1.0 + kAt[i]);
    const double w = 0.5 * h * kWeight[i] * math::exp(-2.0 * s);
    xx += w * s * s;
    xy += w * s * (1.0 - s);
    yy += w * (1.0 - s) * (1.0 - s);
  }
  // a factor of the covariance
  const double a = std::sqrt(std::max(xx, 0.0));
  const double b = a > 0.0 ? xy / a : 0.0;
  const double c = std::sqrt(std::max(yy - b * b, 0.0));
  z = {x + a * normals[0], y + b * normals[0] + c * normals[1]};
}

/// Of deviation 1.
double value_of(const std::array<double, 2>& z) {
  return z[0] + std::sqrt(3.0) * z[1];
}

}  // namespace

void describe(SettingsVisitor& v, WindSettings& s) {
  v.value({"mean", "m/s", "where the wind blows to, world frame", -100, 100}, s.mean);
  v.choice({"turbulence", "", "Dryden gusts (MIL-F-8785C); custom: gust_sigma and gust_length"},
           s.turbulence,
           kTurbulence);
  v.only_if(s.turbulence == Turbulence::kCustom, "turbulence: custom", [&](SettingsVisitor& w) {
    w.value({"gust_sigma", "m/s", "deviations along, across, up", 0, 50}, s.gust_sigma);
    w.value({"gust_length", "m", "scale lengths along, across, up", 0.1, 10000}, s.gust_length);
  });
}

GustScales low_altitude_gusts(double height, double wind_at_20_feet) {
  const double h = std::clamp(height / kFoot, 10.0, 1000.0);
  const double bracket = 0.177 + 0.000823 * h;
  const double sigma_w = 0.1 * wind_at_20_feet;
  const double sigma_u = sigma_w / math::pow(bracket, 0.4);
  const double length_u = kFoot * h / math::pow(bracket, 1.2);
  return {{sigma_u, sigma_u, sigma_w}, {length_u, length_u, kFoot * h}};
}

GustScales Wind::scales(double height) const {
  if (settings_.turbulence == Turbulence::kCustom)
    return {settings_.gust_sigma, settings_.gust_length};
  // W20 of the three levels, knots (MIL-F-8785C, figure 11)
  const double knots = settings_.turbulence == Turbulence::kLight      ? 15.0
                       : settings_.turbulence == Turbulence::kModerate ? 30.0
                                                                       : 45.0;
  return low_altitude_gusts(height, knots * kKnot);
}

Vector3d Wind::over_step(GustState& state,
                         std::uint32_t vehicle,
                         std::uint64_t step,
                         double dt,
                         const Vector3d& v_world,
                         double height) const {
  if (settings_.turbulence == Turbulence::kNone) return settings_.mean;
  const GustScales gusts = scales(height);
  const double airspeed = std::max(kLeastAirspeed, (v_world - settings_.mean).norm());
  const RandomStream random(seed_, StreamId::kGusts, vehicle);
  const auto n0 = random.normal2(4 * step);
  const auto n1 = random.normal2(4 * step + 1);
  const auto n2 = random.normal2(4 * step + 2);
  if (!state.started) {
    state = {n0[0], {0.5 * n1[0], 0.5 * n1[1]}, {0.5 * n2[0], 0.5 * n2[1]}, true};
  } else {
    // the filters' own time; beyond one the steps are wider than the gusts
    const auto share = [&](int axis) { return std::min(1.0, airspeed * dt / gusts.length[axis]); };
    advance_first(state.along, share(0), n0[0]);
    advance_second(state.across, share(1), n1);
    advance_second(state.up, share(2), n2);
  }
  // along the mean wind (x without one), level
  Vector3d ahead(settings_.mean.x(), settings_.mean.y(), 0.0);
  ahead = ahead.norm() > 1e-6 ? Vector3d(ahead.normalized()) : Vector3d::UnitX();
  const Vector3d left(-ahead.y(), ahead.x(), 0.0);
  return settings_.mean + gusts.sigma[0] * state.along * ahead +
         gusts.sigma[1] * value_of(state.across) * left +
         gusts.sigma[2] * value_of(state.up) * Vector3d::UnitZ();
}

}  // namespace pointflight
