#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/geometry/types.hpp"
#include "pointflight/vehicle/state.hpp"

namespace pointflight {

/// The range image that a policy sees (`pointflight.gym.Lidar`): row 0 is the highest, column 0 the
/// farthest to the left.
struct PolicyImage {
  std::size_t rows = 0;                      ///< From the highest elevation to the lowest.
  std::size_t columns = 0;                   ///< From the left end of the azimuth to the right.
  std::array<double, 2> elevation = {0, 0};  ///< Ends of the field of view, rad.
  std::array<double, 2> azimuth = {0, 0};    ///< The right end, the left one; rad.
  double range_max = 10.0;                   ///< m
  /// A cell is the nearest of several beams; else one beam in its middle.
  bool pooled = false;
};

/// What is kept with a policy.
struct PolicySettings {
  std::string path;                  ///< Of its file.
  std::string task;                  ///< That it has learned: "goal", "race", "hover".
  std::string action;                ///< What its numbers mean: "velocity".
  double speed = 3.0;                ///< m/s at an action of 1.
  double yaw_rate = 1.0;             ///< rad/s at an action of 1.
  double action_period = 0.1;        ///< s
  double time_limit = 20.0;          ///< Of an episode, s.
  double base = 0.0;                 ///< Share of the straight way that its outputs add to.
  std::optional<PolicyImage> image;  ///< Nothing: it sees no ranges.
  /// It has learned for goals ahead: what it sees is turned so that the goal is, to the nearest
  /// column of the image, and what it says is turned back.
  bool faces_goal = false;
};

/// Where a vehicle of a policy is and goes to.
struct PolicyTarget {
  Vector3d goal_world = Vector3d::Zero();           ///< m
  double elapsed = 0.0;                             ///< Since the way to it began, s.
  std::array<float, 4> last_action = {0, 0, 0, 0};  ///< -1 to 1
};

/// A network of tanh layers that flies a vehicle (`pointflight.gym.Policy`).
class Policy {
 public:
  /// Of the .npz that `Policy.save` writes. Throws InputError if it cannot be read, does not fit
  /// together, or is of a task or of actions that are not flown outside of environments.
  static Policy load(const std::string& path);

  /// Of its file.
  [[nodiscard]] const PolicySettings& settings() const { return settings_; }

  /// The image's numbers for points of the body frame (m) as seen from its origin: shares of
  /// `range_max`, 1 where no point is.
  [[nodiscard]] std::vector<float> image_of(std::span<const Vector3d> points) const;

  /// Actions ahead, left, up, and yaw rate, -1 to 1; `image` as `image_of` gives it.
  [[nodiscard]] std::array<float, 4> act(std::span<const float> image,
                                         const RigidBodyState& body,
                                         const PolicyTarget& target) const;

 private:
  struct Layer {
    std::size_t outputs = 0;
    std::vector<float> weights;  ///< Rows of as many as there are inputs.
    std::vector<float> biases;
  };
  [[nodiscard]] std::vector<float> state_of(const RigidBodyState& body,
                                            const PolicyTarget& target) const;
  [[nodiscard]] std::vector<float> outputs(std::span<const float> image,
                                           std::span<const float> state) const;
  [[nodiscard]] std::vector<float> through(std::vector<float> numbers) const;

  PolicySettings settings_;
  std::vector<Layer> layers_;
  std::vector<Vector3d> middles_;  ///< Of the image's cells, unit vectors.
};

}  // namespace pointflight
