#include "pointflight/vehicle/controllers/geometric.hpp"

#include "pointflight/vehicle/internal/loops-inl.hpp"
#include "pointflight/vehicle/internal/scalar_numbers-inl.hpp"

namespace pointflight {

namespace hw = HWY_NAMESPACE;

Vector3d GeometricController::demanded_torque(const RigidBodyState& state,
                                              const AttitudeDemand& demand,
                                              double /*dt*/,
                                              ControllerMemory& /*memory*/) const {
  return hw::vector_of(hw::geometric_torque(
      settings(),
      gains(),
      hw::matrix_of(hw::numbers_of(state.q_world_body)),
      hw::numbers_of(state.omega_body),
      {hw::numbers_of(demand.R_world_body), hw::numbers_of(demand.omega_body), demand.thrust}));
}

}  // namespace pointflight
