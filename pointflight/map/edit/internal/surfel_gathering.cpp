#include "pointflight/map/edit/internal/surfel_gathering.hpp"

#include <fmt/format.h>

namespace pointflight {

EditedMap SurfelGathering::build(const MapDescription& description,
                                 bool keeps_base,
                                 const std::string& name,
                                 const Executor& executor) {
  if (count_ == 0) throw InputError(fmt::format("{}: nothing is left of it", name));
  std::array<std::int32_t, 3> base{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!keeps_base) base[axis] = min_[axis];
    if (max_[axis] - base[axis] < (1 << 20)) continue;
    throw InputError(fmt::format("{}: wider than {:.0f} km, too wide for a resolution of {:.4g} m",
                                 name,
                                 resolution_ * 1048.576,
                                 resolution_));
  }
  const auto entries = entries_.span().first(count_);
  std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.surfel.morton < b.surfel.morton;
  });
  // a leaf has room for eight at one place
  const auto crowd =
      std::unique(entries.begin(), entries.end(), [n = 1](const Entry& a, const Entry& b) mutable {
        n = a.surfel.morton == b.surfel.morton ? n + 1 : 1;
        return n > 8;
      });
  return finish(description, static_cast<std::size_t>(crowd - entries.begin()), base, executor);
}

}  // namespace pointflight
