#include "pointflight/survey/survey_rays.hpp"

#include <algorithm>
#include <utility>

#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

class SurveyCloud : public CloudReader {
 public:
  explicit SurveyCloud(std::unique_ptr<SurveyReader> survey) : survey_(std::move(survey)) {}

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    while (batch.empty() && survey_->read(rays_)) {
      for (const SurveyRay& ray : rays_) {
        if (ray.is_return) batch.push_back({ray.point_world(), ray.intensity});
      }
    }
    return !batch.empty();
  }
  [[nodiscard]] bool has_intensity() const override { return survey_->has_intensity(); }
  [[nodiscard]] double share_read() const override { return survey_->share_read(); }

 private:
  std::unique_ptr<SurveyReader> survey_;
  std::vector<SurveyRay> rays_;
};

/// The later one of the two poses that a time is between, or lies nearest to.
auto pose_after(std::span<const TimedPose> poses, SimTime time) {
  const auto is_later = [](SimTime t, const TimedPose& pose) { return t < pose.time; };
  return std::upper_bound(poses.begin() + 1, poses.end() - 1, time, is_later);
}

}  // namespace

double poses_apart(std::span<const TimedPose> poses, SimTime time) {
  if (poses.size() < 2) return 0.0;
  const auto next = pose_after(poses, time);
  return to_seconds(next->time - (next - 1)->time);
}

Pose pose_on(std::span<const TimedPose> poses, SimTime time) {
  if (poses.size() < 2) return poses.front().pose;
  const auto next = pose_after(poses, time);
  const TimedPose& from = *(next - 1);
  const double period = to_seconds(next->time - from.time);
  if (!(period > 0.0)) return from.pose;
  const double share = to_seconds(time - from.time) / period;
  if (share <= 1.0) return interpolate(from.pose, next->pose, std::max(0.0, share));
  const Pose after = next->pose * (from.pose.inverse() * next->pose);
  return interpolate(next->pose, after, std::min(1.0, share - 1.0));
}

SurveyRay survey_ray(const Pose& T_world_sensor, const Vector3d& point_sensor, bool is_return) {
  const double range = point_sensor.norm();
  SurveyRay ray;
  ray.origin_world = T_world_sensor.translation;
  ray.direction_world = (T_world_sensor.rotation * (point_sensor / range)).cast<float>();
  ray.range = static_cast<float>(range);
  ray.is_return = is_return;
  return ray;
}

std::unique_ptr<CloudReader> cloud_of(std::unique_ptr<SurveyReader> survey) {
  return std::make_unique<SurveyCloud>(std::move(survey));
}

}  // namespace pointflight
