// Surveys in memory.
#pragma once

#include <vector>

#include "pointflight/survey/survey_rays.hpp"

namespace pointflight::testing {

/// A survey held in memory, in batches.
class Rays : public SurveyReader {
 public:
  explicit Rays(const std::vector<SurveyRay>& rays, bool backwards = false)
      : rays_(rays), backwards_(backwards) {}
  bool read(std::vector<SurveyRay>& batch) override {
    constexpr std::size_t kSome = 7000;  // several chunks for threads to share
    batch.clear();
    for (; next_ < rays_.size() && batch.size() < kSome; ++next_) {
      batch.push_back(rays_[backwards_ ? rays_.size() - 1 - next_ : next_]);
    }
    return !batch.empty();
  }
  [[nodiscard]] double share_read() const override {
    return static_cast<double>(next_) / static_cast<double>(rays_.size());
  }

 private:
  const std::vector<SurveyRay>& rays_;
  bool backwards_;
  std::size_t next_ = 0;
};

inline SurveyRay ray_between(const Vector3d& from, const Vector3d& to, bool is_return = true) {
  return survey_ray({Quaterniond::Identity(), from}, to - from, is_return);
}

}  // namespace pointflight::testing
