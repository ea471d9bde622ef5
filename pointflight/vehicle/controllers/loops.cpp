#include "pointflight/vehicle/controllers/loops.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/vehicle/internal/loops-inl.hpp"
#include "pointflight/vehicle/internal/scalar_numbers-inl.hpp"

namespace pointflight {

namespace hw = HWY_NAMESPACE;

namespace {

// Of the attitude loop's natural frequency and damping. The rotor across from the lost one can only
// push, so that half of a fast loop's torque is not to be had: with 0.5 and 1 quad_330 tumbles.
constexpr double kSpinningAxisRate = 0.25;
constexpr double kSpinningDamping = 0.2;
// Of a spinning body's nutation, whose damping is to be right for wobbles that keep still in the
// body as well: between -0.3 and -0.6 all shipped quadrotors that spin up are stable.
constexpr double kDampingLead = -0.45;

Vector3d limited(const Vector3d& v, double length) {
  return hw::vector_of(hw::limited(hw::numbers_of(v), length));
}

bool differ(const Vector3d& a, const Vector3d& b) {
  return (a - b).cwiseAbs().maxCoeff() > 1e-9;
}

/// One number for each axis from the horizontal and the vertical loop.
Vector3d by_axis(const ControllerSettings& c, double LoopDesign::*member) {
  return {c.horizontal.*member, c.horizontal.*member, c.vertical.*member};
}

}  // namespace

LoopGains::LoopGains(const VehicleSettings& settings) {
  const ControllerSettings& c = settings.controller;
  const Vector3d wn_v = velocity_frequency(c);
  velocity_square = wn_v.cwiseProduct(wn_v);
  velocity_damping = by_axis(c, &LoopDesign::damping).cwiseProduct(wn_v);
  const Vector3d wn(
      c.roll_pitch.natural_frequency, c.roll_pitch.natural_frequency, c.yaw.natural_frequency);
  const Vector3d z(c.roll_pitch.damping, c.roll_pitch.damping, c.yaw.damping);
  attitude_square = wn.cwiseProduct(wn);
  attitude_damping = z.cwiseProduct(wn);
  tilt_is_free = c.tilt_max_deg >= 90.0;
  if (!tilt_is_free) tilt_tangent = math::tan(c.tilt_max_deg * kDegree);
  const double slope = 2.0 * settings.rotor.torque_coefficient * settings.hover_speed();
  yaw_lag = slope > 0.0 ? settings.rotor.inertia / slope : 0.0;
}

Matrix3d attitude_from(const Vector3d& b3, double yaw, const Matrix3d& R_now) {
  return hw::matrix_from(
      hw::attitude_from(hw::numbers_of(b3), hw::heading_of(yaw), hw::numbers_of(R_now)));
}

LoopController::LoopController(const VehicleSettings& settings)
    : settings_(settings), gains_(settings), mixer_(settings) {}

std::vector<double> LoopController::update(const RigidBodyState& state,
                                           const Setpoint& setpoint,
                                           double dt,
                                           ControllerMemory& memory) const {
  struct Visitor {
    const LoopController& self;
    const RigidBodyState& state;
    double dt;
    ControllerMemory& memory;

    [[nodiscard]] std::vector<double> accelerate(const Vector3d& a,
                                                 const Vector3d& jerk,
                                                 double yaw,
                                                 double yaw_rate) const {
      const AttitudeDemand demand = self.demanded_attitude(state, a, jerk, yaw, yaw_rate);
      const Vector3d f = a + Vector3d(0, 0, kGravity);
      memory.limits.tilt = differ(f, self.tilt_limited(f));
      return self.speeds(state, demand.thrust, torque(demand), dt, memory);
    }
    [[nodiscard]] Vector3d torque(const AttitudeDemand& demand) const {
      if (memory.spins) {
        return self.spinning_torque(state, memory.rotor_momentum, demand.R_world_body.col(2));
      }
      return self.demanded_torque(state, demand, dt, memory);
    }
    std::vector<double> operator()(const RotorSpeedCommand& c) const { return c.speeds; }
    std::vector<double> operator()(const BodyRateCommand& c) const {
      return self.speeds(state, c.thrust, self.rate_torque(state, c.omega_body), dt, memory);
    }
    std::vector<double> operator()(const AttitudeCommand& c) const {
      const AttitudeDemand demand{c.q_world_body.toRotationMatrix(), c.omega_body, c.thrust};
      return self.speeds(state, demand.thrust, torque(demand), dt, memory);
    }
    std::vector<double> operator()(const AccelerationCommand& c) const {
      const Vector3d a = self.allowed(c.a_world, memory);
      return accelerate(a, Vector3d::Zero(), c.yaw, c.yaw_rate);
    }
    std::vector<double> operator()(const VelocityCommand& c) const {
      const Vector3d a = self.velocity_loop(state, c.v_world, dt, memory);
      return accelerate(a, Vector3d::Zero(), c.yaw, c.yaw_rate);
    }
    std::vector<double> operator()(const PositionCommand& c) const {
      self.observe(state, dt, memory);
      const Vector3d a = self.position_loop(state, c, memory);
      std::vector<double> speeds = accelerate(a, c.jerk_world, c.yaw, c.yaw_rate);
      memory.expected = {state.v_world, self.expected_acceleration(state, a, speeds, memory)};
      return speeds;
    }
  };
  if (memory.level != setpoint.index()) {
    // no jump when the level changes in flight: the velocity loop starts from zero acceleration,
    // the position loop from the disturbance that it knew
    memory.velocity_integral = gains_.velocity_damping.cwiseProduct(2.0 * state.v_world);
    memory.expected.reset();
    memory.level = setpoint.index();
  }
  memory.limits = {};
  memory.spins = rotors_fail(memory) && !mixer_.holds_heading(memory.rotor_shares);
  return std::visit(Visitor{*this, state, dt, memory}, setpoint);
}

/// Through still air: what wind adds is a disturbance.
AirMotion LoopController::motion_of(const RigidBodyState& state) {
  return {state.q_world_body.conjugate() * state.v_world, state.omega_body};
}

std::vector<double> LoopController::speeds(const RigidBodyState& state,
                                           double thrust,
                                           const Vector3d& torque,
                                           double dt,
                                           ControllerMemory& memory) const {
  auto filtered = hw::numbers_of(torque);
  hw::filter_yaw(gains_, dt, filtered, memory.yaw_torque);
  const AirMotion motion = motion_of(state);
  const Wrench wanted{thrust, hw::vector_of(filtered)};
  std::vector<double> speeds =
      rotors_fail(memory) ? mixer_.speeds_with_failed_rotors(wanted, motion, memory.rotor_shares)
                          : mixer_.speeds(wanted, motion);
  memory.rotor_momentum = memory.spins ? momentum_of(speeds, memory.rotor_shares) : 0.0;
  memory.limits.rotors =
      std::abs(thrust_of(speeds, state, memory) - thrust) > 1e-3 * settings_.mass * kGravity;
  return speeds;
}

/// Of rotors that turn with their shares of these speeds, about body z.
double LoopController::momentum_of(const std::vector<double>& speeds,
                                   const std::vector<double>& shares) const {
  double momentum = 0.0;
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    momentum -= settings_.rotors[i].yaw_sign * settings_.rotor.inertia *
                std::max(0.0, speeds[i] * shares[i]);
  }
  return momentum;
}

bool LoopController::rotors_fail(const ControllerMemory& memory) const {
  return settings_.controller.reallocate && std::any_of(memory.rotor_shares.begin(),
                                                        memory.rotor_shares.end(),
                                                        [](double share) { return share < 1.0; });
}

double LoopController::thrust_of(const std::vector<double>& commands,
                                 const RigidBodyState& state,
                                 const ControllerMemory& memory) const {
  if (!rotors_fail(memory)) return mixer_.wrench(commands, motion_of(state)).thrust;
  std::vector<double> turning = commands;
  for (std::size_t i = 0; i < turning.size(); ++i) turning[i] *= memory.rotor_shares[i];
  return mixer_.wrench(turning, motion_of(state)).thrust;
}

/// The axis follows a rate that falls with its angle to b3, w_d = k e, by J c (w_d - w), and a body
/// that spins at r has to be made to precess: H (w_d x z), H = J_z r + h, h of the rotors, which
/// turn against the spin. Both errors die out, with rates k and c, however fast it spins. To the
/// rotors what stands still in the world turns at -r: the torque is turned ahead by their phase at
/// that. Damping has to suit nutation, which turns at H / J - r in the body, and wobbles that do
/// not. (Primary-axis control as in Sun, Sijbers, Wang, de Visser, High-speed flight of quadrotor
/// despite loss of single rotor, RA-L 2018, here for a body that is about round.)
Vector3d LoopController::spinning_torque(const RigidBodyState& state,
                                         double rotor_momentum,
                                         const Vector3d& b3_world) const {
  const Vector3d b3 = state.q_world_body.conjugate() * b3_world;
  const double sine = std::hypot(b3.x(), b3.y());
  const Vector3d axis =
      sine > 1e-9 ? Vector3d(-b3.y() / sine, b3.x() / sine, 0.0) : Vector3d::UnitX();
  const double wn = attitude_frequency().x();
  const double c = kSpinningDamping * 2.0 * attitude_damping().x() * wn;
  const Vector3d wanted = kSpinningAxisRate * wn * math::atan2(sine, b3.z()) * axis;
  const Vector3d& inertia = settings_.inertia_diagonal;
  const double r = state.omega_body.z();
  const double round = 0.5 * (inertia.x() + inertia.y());
  const double momentum = inertia.z() * r + rotor_momentum;
  const Vector3d moving =
      c * inertia.cwiseProduct(wanted) + momentum * wanted.cross(Vector3d::UnitZ());
  const Vector3d damping = -c * inertia.cwiseProduct(state.omega_body);
  const Vector3d torque = ahead(moving, -r) + ahead(damping, kDampingLead * (momentum / round - r));
  return {torque.x(), torque.y(), 0.0};
}

/// What turns at `rate` (rad/s) about z, turned on by as much as the rotors fall behind it.
Vector3d LoopController::ahead(const Vector3d& torque, double rate) const {
  const RotorModel& rotor = settings_.rotor;
  const double f = rotor.natural_frequency;
  if (f <= 0.0) return torque;
  const double lag = math::atan2(2.0 * rotor.damping * f * rate, f * f - rate * rate);
  const auto turn = math::sincos(lag);
  return {turn.cos * torque.x() - turn.sin * torque.y(),
          turn.sin * torque.x() + turn.cos * torque.y(),
          torque.z()};
}

Vector3d LoopController::allowed(const Vector3d& a, ControllerMemory& memory) const {
  const Vector3d within =
      hw::vector_of(hw::allowed_acceleration(settings_.controller, hw::numbers_of(a)));
  memory.limits.acceleration = differ(a, within);
  return within;
}

/// What comes of a demand (without gravity) once the attitude is there: tilt and thrust are cut,
/// and the vehicle's own motion has drag, which is no disturbance.
Vector3d LoopController::expected_acceleration(const RigidBodyState& state,
                                               const Vector3d& a_world,
                                               const std::vector<double>& speeds,
                                               const ControllerMemory& memory) const {
  const Vector3d gravity(0, 0, kGravity);
  const Vector3d f = tilt_limited(a_world + gravity);
  const double wanted = settings_.mass * f.dot(state.q_world_body * Vector3d::UnitZ());
  const double share = wanted > 0.0 ? thrust_of(speeds, state, memory) / wanted : 1.0;
  return std::min(share, 1.0) * f - gravity + drag_of(state, state.v_world);
}

/// Of motion through still air, world, m/s^2.
Vector3d LoopController::drag_of(const RigidBodyState& state, const Vector3d& v_world) const {
  return state.q_world_body * settings_.drag_in_still_air(state.q_world_body.conjugate() * v_world);
}

/// Disturbance observer (Ohnishi, Shibata, Murakami, Motion control for advanced mechatronics,
/// IEEE/ASME Trans. Mechatronics 1, 1996): d' = l (v' - a_expected - d). Wind, a wrong mass or a
/// weak rotor make the vehicle accelerate otherwise than demanded; an integral of the error would
/// take every step of the setpoint for one of them, and pay it back by overshooting. With
/// l = integral wn steady disturbances are learnt as quickly as with an integral gain of
/// integral wn^3. What is cut is not expected, so nothing winds up.
void LoopController::observe(const RigidBodyState& state,
                             double dt,
                             ControllerMemory& memory) const {
  if (!memory.expected) return;
  const ControllerSettings& c = settings_.controller;
  const auto& [v_before, a_expected] = *memory.expected;
  const Vector3d rate =
      by_axis(c, &LoopDesign::integral).cwiseProduct(by_axis(c, &LoopDesign::natural_frequency));
  const Vector3d unexplained = state.v_world - v_before - (a_expected + memory.disturbance) * dt;
  memory.disturbance += rate.cwiseProduct(unexplained);
  memory.disturbance = memory.disturbance.cwiseMax(-c.integral_max).cwiseMin(c.integral_max);
}

/// a = a_ff + 2 z wn (v_ref - v) - d with v_ref = v_ff + wn / (2 z) e_p, no faster than the limit:
/// the second-order loop a = a_ff + wn^2 e_p + 2 z wn e_v - d as long as it is not cut. d is the
/// disturbance and the drag of its own motion, which would damp the loop beyond its design.
Vector3d LoopController::position_loop(const RigidBodyState& state,
                                       const PositionCommand& command,
                                       ControllerMemory& memory) const {
  const ControllerSettings& c = settings_.controller;
  const Vector3d wn = by_axis(c, &LoopDesign::natural_frequency);
  const Vector3d z = by_axis(c, &LoopDesign::damping);
  const Vector3d e_p = limited(command.p_world - state.p_world, c.error_max);
  const Vector3d v_wanted = command.v_world + 0.5 * wn.cwiseProduct(e_p).cwiseQuotient(z);
  const Vector3d v_ref = limited(v_wanted, c.speed_max);
  memory.limits.speed = differ(v_wanted, v_ref);
  const Vector3d d = memory.disturbance + drag_of(state, state.v_world);
  const Vector3d a = 2.0 * z.cwiseProduct(wn).cwiseProduct(v_ref - state.v_world);
  return allowed(command.a_world + a - d, memory);
}

Vector3d LoopController::velocity_loop(const RigidBodyState& state,
                                       const Vector3d& v_world,
                                       double dt,
                                       ControllerMemory& memory) const {
  const ControllerSettings& c = settings_.controller;
  const Vector3d v_ref = limited(v_world, c.speed_max);
  memory.limits.speed = differ(v_world, v_ref);
  auto integral = hw::numbers_of(memory.velocity_integral);
  const auto wanted = hw::velocity_demand(
      gains_, hw::numbers_of(state.v_world), hw::numbers_of(v_ref), dt, integral);
  const Vector3d a = allowed(hw::vector_of(wanted), memory);
  hw::keep_what_is_allowed(gains_, hw::numbers_of(state.v_world), hw::numbers_of(a), integral);
  memory.velocity_integral = hw::vector_of(integral);
  return a;
}

Vector3d velocity_frequency(const ControllerSettings& c) {
  return kVelocityToPosition * by_axis(c, &LoopDesign::natural_frequency);
}

Vector3d LoopController::attitude_frequency() const {
  const ControllerSettings& c = settings_.controller;
  return {c.roll_pitch.natural_frequency, c.roll_pitch.natural_frequency, c.yaw.natural_frequency};
}

Vector3d LoopController::attitude_damping() const {
  const ControllerSettings& c = settings_.controller;
  return {c.roll_pitch.damping, c.roll_pitch.damping, c.yaw.damping};
}

AttitudeDemand LoopController::demanded_attitude(const RigidBodyState& state,
                                                 const Vector3d& a_world,
                                                 const Vector3d& jerk_world,
                                                 double yaw,
                                                 double yaw_rate) const {
  const Vector3d f = tilt_limited(a_world + Vector3d(0, 0, kGravity));
  const auto demand = hw::demanded_attitude(settings_,
                                            hw::matrix_of(hw::numbers_of(state.q_world_body)),
                                            hw::numbers_of(f),
                                            hw::numbers_of(jerk_world),
                                            hw::heading_of(yaw),
                                            yaw_rate);
  return {hw::matrix_from(demand.R), hw::vector_of(demand.omega), demand.thrust};
}

Vector3d LoopController::tilt_limited(const Vector3d& f) const {
  return hw::vector_of(hw::tilt_limited(gains_, hw::numbers_of(f)));
}

Vector3d LoopController::rate_torque(const RigidBodyState& state, const Vector3d& omega) const {
  return hw::vector_of(
      hw::rate_torque(settings_, gains_, hw::numbers_of(state.omega_body), hw::numbers_of(omega)));
}

}  // namespace pointflight
