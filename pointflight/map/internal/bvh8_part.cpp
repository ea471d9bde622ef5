#include "pointflight/map/internal/bvh8_part.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>

namespace pointflight {
namespace {

constexpr std::size_t kMaxLeafSurfels = 8;
constexpr std::uint32_t kMaxLeafVoxels = 13;  // 10 bits at r / 64 reach 16

/// Values that are complete, in an array of just their size: many parts wait at the same time.
template <class T>
ScratchArray<T> stored(Scratch& scratch, std::vector<T> values) {
  ScratchArray<T> array(scratch, values.size());
  std::copy(values.begin(), values.end(), array.begin());
  array.release(0, array.size());
  return array;
}

double leaves_of(std::size_t count) {
  const std::size_t leaves = (count + kMaxLeafSurfels - 1) / kMaxLeafSurfels;
  return static_cast<double>(leaves);
}

/// Cuts a box of centres into equal bins along each axis.
class BinGrid {
 public:
  BinGrid(std::span<const std::uint32_t> order, const std::vector<NodeBox>& boxes)
      : bins_(order.size() < 64 ? 8 : kMostBins) {
    Eigen::Array4f high = Eigen::Array4f::Constant(-std::numeric_limits<float>::infinity());
    low_ = -high;
    for (const std::uint32_t i : order) {
      const Eigen::Array4f center = boxes[i].center();
      low_ = low_.min(center);
      high = high.max(center);
    }
    // an axis without extent has but one bin
    const Eigen::Array4f extent = high - low_;
    scale_ = (extent > 0.0f).select(static_cast<float>(bins_) / extent, Eigen::Array4f::Zero());
  }

  static constexpr std::size_t kMostBins = 16;

  [[nodiscard]] std::size_t bins() const { return bins_; }
  [[nodiscard]] bool has_extent(int axis) const { return scale_[axis] != 0.0f; }
  [[nodiscard]] Eigen::Array4i bins_of(const NodeBox& box) const {
    return ((box.center() - low_) * scale_).cast<int>().min(static_cast<int>(bins_) - 1);
  }

 private:
  std::size_t bins_;
  Eigen::Array4f low_;
  Eigen::Array4f scale_;
};

/// What lies in the bins along one axis.
struct Bins {
  std::array<NodeBox, BinGrid::kMostBins> boxes;
  std::array<std::uint32_t, BinGrid::kMostBins> counts{};
};

/// The cheapest border between bins: a part of n surfels costs its area times the leaves that it
/// will have.
struct Border {
  double cost = std::numeric_limits<double>::infinity();
  int axis = -1;
  int bin = 0;            ///< The last one of the first part.
  std::size_t count = 0;  ///< Of the first part.
  double first_area = 0.0;
  double second_area = 0.0;
};

void try_borders(const Bins& along, int axis, std::size_t bins, std::size_t total, Border& best) {
  std::array<double, BinGrid::kMostBins> above{};  // areas of the parts from a bin on
  NodeBox box;
  for (std::size_t bin = bins - 1; bin > 0; --bin) {
    box.add(along.boxes[bin]);
    above[bin] = box.half_area();
  }
  box = {};
  std::size_t count = 0;
  for (std::size_t bin = 0; bin + 1 < bins; ++bin) {
    box.add(along.boxes[bin]);
    count += along.counts[bin];
    if (count == 0 || count == total) continue;
    const double area = box.half_area();
    const double cost = area * leaves_of(count) + above[bin + 1] * leaves_of(total - count);
    if (cost < best.cost) best = {cost, axis, static_cast<int>(bin), count, area, above[bin + 1]};
  }
}

}  // namespace

Split Surfels::split_by_key(const Range& range) const {
  const auto surfels = input_.surfels.span();
  const std::uint64_t first = surfels[range.begin].morton;
  const std::uint64_t last = surfels[range.end - 1].morton;
  assert(first < last);
  const std::uint64_t bit = std::bit_floor(first ^ last);
  const std::uint64_t border = last & ~(bit - 1);
  const auto at =
      std::lower_bound(surfels.begin() + static_cast<std::ptrdiff_t>(range.begin),
                       surfels.begin() + static_cast<std::ptrdiff_t>(range.end),
                       border,
                       [](const BuildSurfel& s, std::uint64_t key) { return s.morton < key; });
  const auto middle = static_cast<std::size_t>(at - surfels.begin());
  return {
      middle, static_cast<double>(middle - range.begin), static_cast<double>(range.end - middle)};
}

NodeBox Surfels::support_box(SurfelWord word, const Voxel& origin) const {
  const Surfel surfel = decode(word);
  const double r = input_.resolution;
  NodeBox box{Eigen::Array4f::Zero(), Eigen::Array4f::Zero()};
  for (int axis = 0; axis < 3; ++axis) {
    double variance = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double part = static_cast<double>(surfel.s[k] * surfel.axes(axis, k)) * r;
      variance += part * part;
    }
    const double center =
        (origin[static_cast<std::size_t>(axis)] + static_cast<double>(surfel.center_voxels[axis])) *
        r;
    const double half =
        static_cast<double>(kSupport) * std::sqrt(variance) * 1.04 + 0.02 * r + center * 0x1p-21;
    box.min[axis] = static_cast<float>(center - half);
    box.max[axis] = static_cast<float>(center + half);
  }
  return box;
}

void quantise(const NodeBox& whole, std::span<const NodeBox> boxes, Bvh8Node& node) {
  const float extent = (whole.max - whole.min).head<3>().maxCoeff();
  node.scale = std::nextafter(extent / 254.0f, std::numeric_limits<float>::infinity());
  for (int axis = 0; axis < 3; ++axis) node.origin[axis] = whole.min[axis];
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const float low = (boxes[i].min[axis] - node.origin[axis]) / node.scale;
      const float high = (boxes[i].max[axis] - node.origin[axis]) / node.scale;
      node.lo[axis][i] =
          static_cast<std::uint8_t>(std::clamp(std::floor(low - 1e-3f), 0.0f, 255.0f));
      node.hi[axis][i] =
          static_cast<std::uint8_t>(std::clamp(std::ceil(high + 1e-3f), 0.0f, 255.0f));
    }
  }
}

void TreePart::build(Scratch& scratch) {
  order_.resize(range_.count());
  std::iota(order_.begin(), order_.end(), 0u);
  if (quality_ == TreeQuality::kHigh) {
    boxes_.reserve(order_.size());
    for (std::size_t i = range_.begin; i < range_.end; ++i) {
      boxes_.push_back(surfels_.support_box(surfels_.word(i), surfels_.voxel(i)));
    }
  }
  new_nodes_.emplace_back();
  box = build_node(0, {0, order_.size()});
  // "= {}" would keep the room
  order_ = std::vector<std::uint32_t>();
  boxes_ = std::vector<NodeBox>();
  surfels_.release(range_);
  nodes = stored(scratch, std::move(new_nodes_));
  words = stored(scratch, std::move(new_words_));
  intensity = stored(scratch, std::move(new_intensity_));
}

void TreePart::clear() {
  nodes = {};
  words = {};
  intensity = {};
}

/// Fills node `index` with the surfels of `range` and returns their box.
NodeBox TreePart::build_node(std::size_t index, const Range& range) {
  const Children children = open_children(
      range,
      [this](const Range& part) { return is_leaf(part); },
      [this](const Range& part) { return split(part); });
  std::array<std::uint8_t, 8> meta{};
  std::array<NodeBox, 8> boxes;
  const std::size_t first_leaf_word = new_words_.size();
  const std::size_t first_inner = new_nodes_.size();
  std::size_t inner_count = 0;
  for (std::size_t i = 0; i < children.count; ++i) {
    if (is_leaf(children.ranges[i])) {
      meta[i] = static_cast<std::uint8_t>(children.ranges[i].count());
      boxes[i] = append_leaf(children.ranges[i]);
    } else {
      meta[i] = Bvh8Node::kInner;
      ++inner_count;
    }
  }
  new_nodes_.resize(first_inner + inner_count);
  std::size_t next_inner = first_inner;
  for (std::size_t i = 0; i < children.count; ++i) {
    if (meta[i] == Bvh8Node::kInner) boxes[i] = build_node(next_inner++, children.ranges[i]);
  }
  NodeBox whole;
  for (std::size_t i = 0; i < children.count; ++i) whole.add(boxes[i]);
  Bvh8Node& node = new_nodes_[index];
  node = {};
  node.first_inner = static_cast<std::uint32_t>(first_inner);
  node.first_leaf_word = static_cast<std::uint32_t>(first_leaf_word);
  quantise(whole, std::span(boxes).first(children.count), node);
  std::copy(meta.begin(), meta.end(), node.meta);
  return whole;
}

bool TreePart::is_leaf(const Range& range) const {
  if (range.count() > kMaxLeafSurfels) return false;
  const auto [min, max] = voxel_bounds(range);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (max[axis] - min[axis] >= kMaxLeafVoxels) return false;
  }
  return true;
}

std::pair<Voxel, Voxel> TreePart::voxel_bounds(const Range& range) const {
  Voxel min = surfels_.voxel(surfel(range.begin));
  Voxel max = min;
  for (std::size_t i = range.begin + 1; i < range.end; ++i) {
    const Voxel voxel = surfels_.voxel(surfel(i));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      min[axis] = std::min(min[axis], voxel[axis]);
      max[axis] = std::max(max[axis], voxel[axis]);
    }
  }
  return {min, max};
}

Split TreePart::split(const Range& range) {
  if (quality_ == TreeQuality::kHigh) return split_by_area(range);
  // in this quality the order is still that of the keys
  const std::size_t first = range_.begin;
  Split parts = surfels_.split_by_key({first + range.begin, first + range.end});
  parts.middle -= first;
  return parts;
}

/// Surface area heuristic over bins along each axis (Wald 2007); parts are worth their areas.
Split TreePart::split_by_area(const Range& range) {
  const BinGrid grid(order(range), boxes_);
  std::array<Bins, 3> along;
  for (const std::uint32_t i : order(range)) {
    const Eigen::Array4i bin = grid.bins_of(boxes_[i]);
    for (int axis = 0; axis < 3; ++axis) {
      Bins& of_axis = along[static_cast<std::size_t>(axis)];
      const auto k = static_cast<std::size_t>(bin[axis]);
      of_axis.boxes[k].add(boxes_[i]);
      ++of_axis.counts[k];
    }
  }
  Border best;
  for (int axis = 0; axis < 3; ++axis) {
    if (!grid.has_extent(axis)) continue;
    try_borders(along[static_cast<std::size_t>(axis)], axis, grid.bins(), range.count(), best);
  }
  if (best.axis < 0) {  // all centres at one place
    const double area = boxes_[order_[range.begin]].half_area();
    return {range.begin + range.count() / 2, area, area};
  }
  const auto indices = order(range);
  std::stable_partition(indices.begin(), indices.end(), [&](std::uint32_t i) {
    return grid.bins_of(boxes_[i])[best.axis] <= best.bin;
  });
  return {range.begin + best.count, best.first_area, best.second_area};
}

NodeBox TreePart::append_leaf(const Range& range) {
  const Voxel origin = voxel_bounds(range).first;
  new_words_.push_back(encode(
      LeafHeader{origin[0], origin[1], origin[2], static_cast<std::uint32_t>(range.count())}));
  if (surfels_.has_intensity()) new_intensity_.push_back(0);
  NodeBox whole;
  for (std::size_t i = range.begin; i < range.end; ++i) {
    const Voxel voxel = surfels_.voxel(surfel(i));
    SurfelWord word = surfels_.word(surfel(i));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // 64 steps per voxel
      word += static_cast<SurfelWord>(voxel[axis] - origin[axis]) << (6 + 10 * axis);
    }
    new_words_.push_back(word);
    if (surfels_.has_intensity()) new_intensity_.push_back(surfels_.intensity(surfel(i)));
    whole.add(surfels_.support_box(word, origin));
  }
  return whole;
}

}  // namespace pointflight
