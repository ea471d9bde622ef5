#include "pointflight/scenes/world_tasks.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pointflight/core/random.hpp"
#include "pointflight/geometry/polyline.hpp"
#include "pointflight/scenes/space_ways.hpp"

namespace pointflight {
namespace {

constexpr double kStraightMin = 4.0;  // m between start and goal
constexpr double kEndLow = 1.2;       // m above what is below
constexpr double kEndHigh = 1.8;
constexpr std::size_t kStarts = 6;
constexpr std::size_t kGoals = 24;

double hardness(const WorldTask& task) {
  return task.length * task.length / (task.straight * task.passage);
}

/// Pairs of positions that are connected at flight height.
class Pairs {
 public:
  Pairs(const SceneSpace& space, std::uint64_t seed)
      : space_(space), ways_(space), random_(seed, StreamId::kMissionSearch, 2) {
    for (std::size_t i = 0; i < ways_.cells().size(); ++i) {
      const std::uint32_t cell = ways_.cells()[i];
      const double height = space.height(cell);
      const bool is_end = height >= kEndLow && height <= kEndHigh &&
                          space.clearance(cell) >= WorldTask::kRoomAtEnds;
      if (is_end) ends_.push_back(static_cast<std::uint32_t>(i));
    }
  }

  [[nodiscard]] std::vector<WorldTask> all() const {
    std::vector<WorldTask> tasks;
    if (ends_.empty()) return tasks;
    for (std::uint64_t start = 0; start < kStarts; ++start) {
      const std::uint32_t from = drawn(start);
      const auto cost = ways_.shortest_from(from);
      const auto width = ways_.widest_from(from);
      for (std::uint64_t goal = 0; goal < kGoals; ++goal) {
        const std::uint32_t to = drawn(kStarts + start * kGoals + goal);
        if (auto task = task_of(from, to, cost, width)) tasks.push_back(std::move(*task));
      }
    }
    return tasks;
  }

 private:
  [[nodiscard]] std::uint32_t drawn(std::uint64_t i) const {
    const double at = random_.uniform(i) * static_cast<double>(ends_.size());
    return ends_[std::min(static_cast<std::size_t>(at), ends_.size() - 1)];
  }

  [[nodiscard]] std::optional<WorldTask> task_of(std::uint32_t from,
                                                 std::uint32_t to,
                                                 const std::vector<std::uint32_t>& cost,
                                                 const std::vector<float>& width) const {
    WorldTask task;
    task.start = space_.center(ways_.cells()[from]);
    task.goal = space_.center(ways_.cells()[to]);
    task.straight = (task.goal - task.start).norm();
    if (cost[to] == SpaceWays::kUnreached || task.straight < kStraightMin) return std::nullopt;
    task.passage = 2.0 * static_cast<double>(width[to]);
    const std::vector<Vector3d> shortest = straightened(space_, ways_.way_back(cost, to));
    task.length = length_of(shortest);
    task.way = with_room(space_, shortest, WorldTask::kRoomAtEnds);
    return task;
  }

  const SceneSpace& space_;
  SpaceWays ways_;
  RandomStream random_;
  std::vector<std::uint32_t> ends_;  ///< Cells (by number) at which tasks may begin and end.
};

}  // namespace

std::string_view name_of(Difficulty difficulty) {
  switch (difficulty) {
    case Difficulty::kEasy:
      return "easy";
    case Difficulty::kMedium:
      return "medium";
    case Difficulty::kHard:
      return "hard";
  }
  return {};
}

std::vector<WorldTask> make_tasks(const SceneSpace& space, std::uint64_t seed, std::size_t count) {
  std::vector<WorldTask> pairs = Pairs(space, seed).all();
  std::stable_sort(pairs.begin(), pairs.end(), [](const WorldTask& a, const WorldTask& b) {
    return hardness(a) < hardness(b);
  });
  std::vector<WorldTask> tasks;
  constexpr Difficulty kAll[] = {Difficulty::kEasy, Difficulty::kMedium, Difficulty::kHard};
  const std::size_t each = std::min(count, pairs.size() / std::size(kAll));
  for (std::size_t third = 0; third < std::size(kAll); ++third) {
    const std::size_t begin = third * pairs.size() / std::size(kAll);
    const std::size_t end = (third + 1) * pairs.size() / std::size(kAll);
    for (std::size_t i = 0; i < each; ++i) {
      WorldTask task = pairs[begin + (2 * i + 1) * (end - begin) / (2 * each)];
      task.difficulty = kAll[third];
      tasks.push_back(std::move(task));
    }
  }
  return tasks;
}

}  // namespace pointflight
