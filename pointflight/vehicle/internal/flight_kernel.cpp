#include "pointflight/vehicle/internal/flight_kernel.hpp"

#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/vehicle/internal/flight_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/vehicle/internal/flight-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// The rows of one group of lanes.
class Columns {
 public:
  Columns(const FlightTable& table, std::size_t first) : table_(table), first_(first) {}

  HWY_INLINE void load(std::size_t row, Lanes& to) const {
    to = Lanes(hn::LoadU(kD, table_.row(row) + first_));
  }
  HWY_INLINE void load(std::size_t row, Vec3<Lanes>& to) const {
    load(row, to.x);
    load(row + 1, to.y);
    load(row + 2, to.z);
  }
  HWY_INLINE void store(std::size_t row, const Lanes& from) const {
    hn::StoreU(from.raw, kD, table_.row(row) + first_);
  }
  HWY_INLINE void store(std::size_t row, const Vec3<Lanes>& from) const {
    store(row, from.x);
    store(row + 1, from.y);
    store(row + 2, from.z);
  }

 private:
  const FlightTable& table_;
  std::size_t first_;
};

HWY_INLINE void load(const Columns& columns, std::size_t rotors, FlightNumbers<Lanes>& flight) {
  BodyNumbers<Lanes>& body = flight.body;
  columns.load(kPosition, body.p);
  columns.load(kVelocity, body.v);
  columns.load(kOrientation, body.q.x);
  columns.load(kOrientation + 1, body.q.y);
  columns.load(kOrientation + 2, body.q.z);
  columns.load(kOrientation + 3, body.q.w);
  columns.load(kRates, body.omega);
  columns.load(kVelocityIntegral, flight.integral);
  columns.load(kYawTorque, flight.yaw_torque);
  columns.load(kYaw, flight.yaw);
  columns.load(kAsked, flight.asked);
  columns.load(kAskedTurn, flight.turn);
  columns.load(kWind, flight.air.wind);
  columns.load(kGround, flight.air.ground_z);
  columns.load(kLoadShare, flight.air.load_share);
  for (std::size_t i = 0; i < rotors; ++i) {
    columns.load(kRotorRows + i, flight.rotors.speed[i]);
    columns.load(kRotorRows + rotors + i, flight.rotors.acceleration[i]);
    columns.load(kRotorRows + 3 * rotors + i, flight.rotor_shares[i]);
  }
}

HWY_INLINE void store(const Columns& columns,
                      std::size_t rotors,
                      const FlightNumbers<Lanes>& flight) {
  const BodyNumbers<Lanes>& body = flight.body;
  columns.store(kPosition, body.p);
  columns.store(kVelocity, body.v);
  columns.store(kOrientation, body.q.x);
  columns.store(kOrientation + 1, body.q.y);
  columns.store(kOrientation + 2, body.q.z);
  columns.store(kOrientation + 3, body.q.w);
  columns.store(kRates, body.omega);
  columns.store(kVelocityIntegral, flight.integral);
  columns.store(kYawTorque, flight.yaw_torque);
  columns.store(kYaw, flight.yaw);
  for (std::size_t i = 0; i < rotors; ++i) {
    columns.store(kRotorRows + i, flight.rotors.speed[i]);
    columns.store(kRotorRows + rotors + i, flight.rotors.acceleration[i]);
  }
}

void fly_lanes(const FlightPlan& plan,
               const FlightTable& table,
               FlightLevel level,
               std::size_t begin,
               std::size_t end,
               int periods) {
  const std::size_t rotors = plan.vehicle->rotors.size();
  for (std::size_t first = begin; first < end; first += kDoubles) {
    const Columns columns(table, first);
    FlightNumbers<Lanes> flight;
    load(columns, rotors, flight);
    PerRotor<Lanes> commands;
    for (std::size_t i = 0; i < rotors; ++i) {
      columns.load(kRotorRows + 2 * rotors + i, commands[i]);
    }
    for (int period = 0; period < periods; ++period) {
      control(plan, level, flight, commands);
      integrate(plan, flight, commands);
    }
    for (std::size_t i = 0; i < rotors; ++i) {
      columns.store(kRotorRows + 2 * rotors + i, commands[i]);
    }
    store(columns, rotors, flight);
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(fly_lanes);

}  // namespace

void fly_on(const FlightPlan& plan,
            const FlightTable& table,
            FlightLevel level,
            std::size_t begin,
            std::size_t end,
            int periods) {
  HWY_DYNAMIC_DISPATCH(fly_lanes)(plan, table, level, begin, end, periods);
}

}  // namespace pointflight
#endif  // HWY_ONCE
