#pragma once

#include <vector>

#include "pointflight/render/renderer.hpp"

namespace pointflight {

/// What a job's renderer is to make of it.
enum class Expand {
  kAll,     ///< Rays of aimed beams, what lies across wide ones, hits for ranges.
  kAcross,  ///< What lies across wide beams alone.
};

/// A job for who knows rays and hits alone, or at least what lies across beams.
class ExpandedJob {
 public:
  /// The job must outlive it.
  ExpandedJob(const RenderJob& job, const Executor& executor, Expand expand = Expand::kAll);
  ExpandedJob(const ExpandedJob&) = delete;  // the job refers to what it holds
  ExpandedJob& operator=(const ExpandedJob&) = delete;

  [[nodiscard]] const RenderJob& job() const { return job_; }
  /// Writes what was asked for, once `job` is rendered.
  void finish() const;

 private:
  RenderJob job_;
  std::vector<Ray> rays_;
  std::vector<Vector3f> across_;
  std::vector<Hit> hits_;
  std::span<float> ranges_;
};

}  // namespace pointflight
