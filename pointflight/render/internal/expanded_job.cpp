#include "pointflight/render/internal/expanded_job.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kBeamsPerPart = 2048;

}  // namespace

ExpandedJob::ExpandedJob(const RenderJob& job, const Executor& executor, Expand expand)
    : job_(job), ranges_(job.ranges) {
  if (const AimedBeams* aimed = job.batch.aimed) {
    const std::size_t count = job.batch.size();
    const bool wants_across = job.wide && job.wide->across.empty();
    const bool wants_rays = expand == Expand::kAll;
    rays_.resize(wants_rays ? count : 0);
    across_.resize(wants_across ? count : 0);
    executor.parallel_for(count, kBeamsPerPart, [&](std::size_t begin, std::size_t end) {
      const std::size_t some = end - begin;
      if (wants_rays) make_rays(*aimed, begin, std::span(rays_).subspan(begin, some));
      if (wants_across) make_across(*aimed, begin, std::span(across_).subspan(begin, some));
    });
    if (wants_across) job_.wide->across = across_;
    if (wants_rays) {
      job_.batch.aimed = nullptr;
      job_.batch.rays = rays_;
    }
  }
  if (expand == Expand::kAll && !job.ranges.empty()) {
    hits_.resize(job.ranges.size());
    job_.hits = hits_;
    job_.ranges = {};
  }
}

void ExpandedJob::finish() const {
  for (std::size_t i = 0; i < hits_.size(); ++i) ranges_[i] = hits_[i].range;
}

}  // namespace pointflight
