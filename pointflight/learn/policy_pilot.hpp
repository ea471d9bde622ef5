#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/learn/policy.hpp"
#include "pointflight/run/link.hpp"

namespace pointflight {

/// A policy as a party to a run: it flies a vehicle by its odometry and the scans of its first
/// LiDAR, to one goal after the other, and hovers at the last. Of a goal that takes it longer than
/// an episode, or than three times the straight way at full speed, it gives up, and hovers.
class PolicyPilot : public Link {
 public:
  /// A goal is reached within this, m.
  static constexpr double kRadius = 1.0;

  /// `vehicle`: its number in the fleet; goals in the world, m.
  PolicyPilot(std::shared_ptr<const Policy> policy,
              std::size_t vehicle,
              std::vector<Vector3d> goals_world);

  /// Throws InputError if the policy sees ranges and the vehicle has no LiDAR.
  void open(const RunDescription& run) override;
  void on_sample(const Sample& sample) override;
  std::vector<Order> take_orders() override;
  [[nodiscard]] bool wants_answer(const Sample& sample) const override;
  void on_reset(SimTime reached) override;

  /// How many goals were reached.
  [[nodiscard]] std::size_t reached() const { return next_; }

 private:
  void on_odometry(const OdometrySample& odometry);
  void begin_way(const Vector3d& from_world, SimTime now);
  void rest();
  void on_scan(const Scan& scan);
  void act(std::span<const float> image, SimTime now);
  [[nodiscard]] std::vector<Vector3d> points_now(const Scan& scan) const;

  std::shared_ptr<const Policy> policy_;
  std::size_t vehicle_;
  std::vector<Vector3d> goals_;
  Pose T_body_sensor_;

  std::optional<OdometrySample> odometry_;  ///< The last that came.
  std::size_t next_ = 0;                    ///< Goal.
  std::optional<SimTime> last_act_;
  bool rests_ = false;       ///< Arrived, or has given up.
  double time_limit_ = 0.0;  ///< Of the way to the goal, s; 0: it has not begun.
  SimTime since_;            ///< When it began.
  PolicyTarget target_;
  std::vector<Order> orders_;
};

}  // namespace pointflight
