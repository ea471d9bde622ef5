#include "pointflight/survey/surface_share.hpp"

#include <array>
#include <atomic>
#include <mutex>
#include <unordered_map>

#include "pointflight/geometry/internal/grid_cells.hpp"
#include "pointflight/survey/internal/ray_fate.hpp"
#include "pointflight/survey/survey_hits.hpp"

namespace pointflight {
namespace {

constexpr double kVotingCell = 0.2;        // m
constexpr std::uint64_t kVote = 1u << 20;  // in parts, so that sums do not depend on their order

/// Returns and those of them that were right, by the cell that they end in, from several threads.
class CellVotes {
 public:
  void add(const Vector3d& point_world, bool is_right) {
    const std::uint64_t key = grid_key(grid_cell(point_world, kVotingCell));
    Part& part = parts_[key % kParts];
    const std::lock_guard lock(part.mutex);
    Votes& votes = part.cells[key];
    ++votes.all;
    votes.right += is_right ? 1 : 0;
  }

  /// Mean over the cells of their share of right returns; 0 without any.
  [[nodiscard]] double right() const {
    std::uint64_t sum = 0;
    std::uint64_t cells = 0;
    for (const Part& part : parts_) {
      for (const auto& [key, votes] : part.cells) {
        sum += kVote * votes.right / votes.all;
        ++cells;
      }
    }
    return cells > 0 ? static_cast<double>(sum) / static_cast<double>(kVote * cells) : 0.0;
  }

 private:
  struct Votes {
    std::uint64_t all = 0;
    std::uint64_t right = 0;
  };
  struct Part {
    std::mutex mutex;
    std::unordered_map<std::uint64_t, Votes> cells;
  };
  static constexpr std::size_t kParts = 64;

  std::array<Part, kParts> parts_;
};

}  // namespace

SurfaceShare measure_surface(const SurfelMap& map,
                             const SurveyOpener& survey,
                             double right,
                             const std::function<bool(const SurveyRay&)>& counts,
                             const Executor& executor,
                             const Progress& progress) {
  CellVotes votes;
  std::atomic<std::uint64_t> returns{0};
  std::atomic<std::uint64_t> empty{0};
  std::atomic<std::uint64_t> free{0};
  const auto visit = [&](const SurveyRay& ray, const RayHits& way) {
    if (!counts(ray)) return;
    const Fate fate = fate_of(ray, way.range, static_cast<float>(right));
    if (ray.is_return) {
      returns.fetch_add(1, std::memory_order_relaxed);
      votes.add(ray.point_world(), fate == Fate::kRight);
    } else {
      empty.fetch_add(1, std::memory_order_relaxed);
      if (fate == Fate::kFree) free.fetch_add(1, std::memory_order_relaxed);
    }
  };
  follow_survey(map, survey, right, executor, "rendering left out scans", progress, visit);
  SurfaceShare share;
  share.rays = returns + empty;
  if (share.rays > 0) {
    share.right = (static_cast<double>(returns) * votes.right() + static_cast<double>(free)) /
                  static_cast<double>(share.rays);
  }
  return share;
}

}  // namespace pointflight
