#include "pointflight/share/share_link.hpp"

namespace pointflight {

ShareLink::ShareLink(Simulation& simulation, FleetShare& share)
    : simulation_(simulation), share_(share) {}

bool ShareLink::is_ready() {
  if (!share_.is_ready()) return false;
  const Duration step = from_seconds(simulation_.scenario().physics_step);
  const Duration ahead = share_.time_of_others() - simulation_.time();
  if (ahead > Duration{0}) {
    simulation_.skip_to(simulation_.time() + (ahead + step - Duration{1}) / step * step);
  }
  return true;
}

std::vector<Order> ShareLink::take_orders() {
  const FleetShare::Adjustment adjustment = share_.keep_time();
  if (adjustment.skip > Duration{0}) return {SkipOrder{simulation_.time() + adjustment.skip}};
  if (adjustment.hurry > Duration{0}) return {ShiftPaceOrder{adjustment.hurry}};
  return {};
}

std::string ShareLink::objection(const Order& order) const {
  if (std::holds_alternative<ResetOrder>(order)) {
    return "a run that other processes share cannot begin again";
  }
  const bool moves_clock =
      std::holds_alternative<PauseOrder>(order) || std::holds_alternative<RateOrder>(order);
  if (moves_clock && !share_.decides_together()) {
    return "a run that other processes share by their clocks cannot be paused or go at another "
           "rate";
  }
  return {};
}

void ShareLink::close() {
  share_.leave();
}

}  // namespace pointflight
