#pragma once

#include <memory>

#include "pointflight/run/link.hpp"
#include "pointflight/share/fleet_share.hpp"

namespace pointflight {

/// A shared run's place in the run's loop: the run starts when the others were looked for and goes
/// on at their time.
class ShareLink : public Link {
 public:
  /// All must outlive it.
  ShareLink(Simulation& simulation, FleetShare& share);

  bool is_ready() override;
  std::vector<Order> take_orders() override;
  [[nodiscard]] std::string objection(const Order& order) const override;
  void close() override;
  [[nodiscard]] bool is_over() const override { return !share_.fault().empty(); }
  // others' rates are the same, and would have to be changed with this one's
  [[nodiscard]] std::string remedy_when_behind(double /*rate*/) const override {
    return "share: {time: lockstep}";
  }
  /// Nobody flies for its sake alone.
  [[nodiscard]] bool is_in_use() const override { return false; }

 private:
  Simulation& simulation_;
  FleetShare& share_;
};

}  // namespace pointflight
