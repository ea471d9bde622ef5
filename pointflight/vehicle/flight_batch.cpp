#include "pointflight/vehicle/flight_batch.hpp"

#include <algorithm>
#include <cassert>
#include <new>

#include "pointflight/core/argument.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/internal/flight_kernel.hpp"

namespace pointflight {
namespace {

constexpr std::align_val_t kAlignment{64};

}  // namespace

static_assert(FlightBatch::kGroup == kFlightLanes);

struct FlightBatch::Table {
  Table(const VehicleSettings& settings, std::size_t count, const FlightTiming& timing)
      : vehicle(settings), gains(settings), mixer(settings), size(count) {
    require_argument(timing.physics_step > 0.0 && timing.steps_per_control > 0 && timing.parts > 0,
                     "FlightBatch: steps above zero");
    check_settings(settings, settings.path.empty() ? "vehicle" : settings.path);
    table.stride = (count + kGroup - 1) / kGroup * kGroup;
    row_count = kRotorRows + 4 * settings.rotors.size();
    table.rows =
        static_cast<double*>(::operator new(row_count* table.stride * sizeof(double), kAlignment));
    std::fill_n(table.rows, row_count * table.stride, 0.0);
    plan.vehicle = &vehicle;
    plan.gains = &gains;
    plan.mixer = &mixer.model();
    plan.lag = step_lag(settings.rotor, timing.physics_step / timing.parts);
    plan.parts = timing.parts;
    plan.held = timing.steps_per_control;
    plan.control_dt = timing.physics_step * timing.steps_per_control;
  }
  ~Table() { ::operator delete(table.rows, kAlignment); }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  void set(std::size_t row, std::size_t column, const Vector3d& v) const {
    for (std::size_t k = 0; k < 3; ++k) {
      table.row(row + k)[column] = v[static_cast<Eigen::Index>(k)];
    }
  }
  [[nodiscard]] Vector3d vector(std::size_t row, std::size_t column) const {
    return {table.row(row)[column], table.row(row + 1)[column], table.row(row + 2)[column]};
  }

  VehicleSettings vehicle;
  LoopGains gains;
  Mixer mixer;
  std::size_t size;
  std::size_t row_count = 0;
  FlightTable table;
  FlightPlan plan;
};

FlightBatch::FlightBatch(const VehicleSettings& settings,
                         std::size_t count,
                         const FlightTiming& timing)
    : table_(std::make_unique<Table>(settings, count, timing)) {
  for (std::size_t i = 0; i < table_->table.stride; ++i) place(i, RigidBodyState{});
}

FlightBatch::~FlightBatch() = default;
FlightBatch::FlightBatch(FlightBatch&&) noexcept = default;
FlightBatch& FlightBatch::operator=(FlightBatch&&) noexcept = default;

std::size_t FlightBatch::size() const {
  return table_->size;
}
const VehicleSettings& FlightBatch::settings() const {
  return table_->vehicle;
}
double FlightBatch::control_period() const {
  return table_->plan.control_dt;
}

void FlightBatch::place(std::size_t vehicle, const RigidBodyState& body) {
  const Table& t = *table_;
  for (std::size_t row = 0; row < t.row_count; ++row) t.table.row(row)[vehicle] = 0.0;
  t.set(kPosition, vehicle, body.p_world);
  t.set(kVelocity, vehicle, body.v_world);
  t.set(kRates, vehicle, body.omega_body);
  for (std::size_t k = 0; k < 4; ++k) {
    t.table.row(kOrientation + k)[vehicle] =
        body.q_world_body.coeffs()[static_cast<Eigen::Index>(k)];
  }
  // the velocity loop begins without an acceleration, as a LoopController whose level changes does
  t.set(kVelocityIntegral,
        vehicle,
        t.gains.velocity_damping.cwiseProduct(Vector3d(2.0 * body.v_world)));
  t.table.row(kYaw)[vehicle] = yaw_of(body.q_world_body);
  t.table.row(kGround)[vehicle] = kFarBelow;
  t.table.row(kLoadShare)[vehicle] = 1.0;
  const std::size_t rotors = t.vehicle.rotors.size();
  for (std::size_t i = 0; i < rotors; ++i) {
    t.table.row(kRotorRows + i)[vehicle] = t.vehicle.hover_speed();
    t.table.row(kRotorRows + 2 * rotors + i)[vehicle] = t.vehicle.hover_speed();
    t.table.row(kRotorRows + 3 * rotors + i)[vehicle] = 1.0;
  }
}

void FlightBatch::set_air(std::size_t vehicle, const Vector3d& wind_world, double ground_z) {
  table_->set(kWind, vehicle, wind_world);
  table_->table.row(kGround)[vehicle] = ground_z;
}

void FlightBatch::set_load(std::size_t vehicle, double share) {
  table_->table.row(kLoadShare)[vehicle] = share;
}

void FlightBatch::set_rotor(std::size_t vehicle, std::size_t rotor, double share) {
  const std::size_t rotors = table_->vehicle.rotors.size();
  table_->table.row(kRotorRows + 3 * rotors + rotor)[vehicle] = share;
}

void FlightBatch::ask(std::size_t vehicle, const Vector3d& asked, double turn) {
  table_->set(kAsked, vehicle, asked);
  table_->table.row(kAskedTurn)[vehicle] = turn;
}

void FlightBatch::ask_rotors(std::size_t vehicle, const double* speeds) {
  const std::size_t rotors = table_->vehicle.rotors.size();
  for (std::size_t i = 0; i < rotors; ++i) {
    table_->table.row(kRotorRows + 2 * rotors + i)[vehicle] = speeds[i];
  }
}

void FlightBatch::fly(std::size_t group, FlightLevel level, int periods) {
  assert(group * kGroup < table_->table.stride);
  fly_on(table_->plan, table_->table, level, group * kGroup, (group + 1) * kGroup, periods);
}

void FlightBatch::fly(FlightLevel level, int periods) {
  fly_on(table_->plan, table_->table, level, 0, table_->table.stride, periods);
}

std::size_t FlightBatch::column_size() const {
  return table_->row_count;
}

void FlightBatch::save(std::size_t vehicle, std::span<double> numbers) const {
  for (std::size_t row = 0; row < numbers.size(); ++row) {
    numbers[row] = table_->table.row(row)[vehicle];
  }
}

void FlightBatch::restore(std::size_t vehicle, std::span<const double> numbers) {
  for (std::size_t row = 0; row < numbers.size(); ++row) {
    table_->table.row(row)[vehicle] = numbers[row];
  }
}

Vector3d FlightBatch::position(std::size_t vehicle) const {
  return table_->vector(kPosition, vehicle);
}

RigidBodyState FlightBatch::body(std::size_t vehicle) const {
  const Table& t = *table_;
  RigidBodyState body;
  body.p_world = t.vector(kPosition, vehicle);
  body.v_world = t.vector(kVelocity, vehicle);
  body.omega_body = t.vector(kRates, vehicle);
  for (std::size_t k = 0; k < 4; ++k) {
    body.q_world_body.coeffs()[static_cast<Eigen::Index>(k)] =
        t.table.row(kOrientation + k)[vehicle];
  }
  return body;
}

VehicleState FlightBatch::state(std::size_t vehicle) const {
  VehicleState state{body(vehicle), {}};
  const std::size_t rotors = table_->vehicle.rotors.size();
  for (std::size_t i = 0; i < rotors; ++i) {
    state.rotors.push_back({table_->table.row(kRotorRows + i)[vehicle],
                            table_->table.row(kRotorRows + rotors + i)[vehicle]});
  }
  return state;
}

double FlightBatch::yaw(std::size_t vehicle) const {
  return table_->table.row(kYaw)[vehicle];
}

}  // namespace pointflight
