#include "pointflight/map/cell_accumulator.hpp"

#include <algorithm>
#include <numeric>

namespace pointflight {
namespace {

constexpr std::size_t kChunkPoints = 8192;

/// Equal for all voxels of a tile, so that a tile's cells are all in one shard.
std::size_t shard_of(const std::array<std::int32_t, 3>& voxel, std::size_t shards) {
  static_assert(CellTile::kWidth == 1 << 6);
  std::uint32_t h = 0;
  for (const std::int32_t x : voxel) {
    h = (h ^ static_cast<std::uint32_t>(x >> 6)) * 0x9e3779b1u;
    h ^= h >> 15;
  }
  return h % shards;
}

/// A tile's cells within a run.
struct Segment {
  std::uint64_t key;
  const ScratchArray<VoxelCell>* run;
  std::size_t begin;
  std::size_t end;

  [[nodiscard]] std::span<const VoxelCell> cells() const {
    return run->span().subspan(begin, end - begin);
  }
  void release() const { run->release(begin, end); }
};

/// The tiles of the sorted cells [begin, end) of a run.
void append_segments(const ScratchArray<VoxelCell>& run,
                     std::size_t begin,
                     std::size_t end,
                     std::vector<Segment>& segments) {
  while (begin < end) {
    const std::uint64_t key = tile_key(run[begin].voxel);
    const VoxelCell* behind =
        std::partition_point(run.data() + begin, run.data() + end, [key](const VoxelCell& c) {
          return tile_key(c.voxel) == key;
        });
    const auto next = static_cast<std::size_t>(behind - run.data());
    segments.push_back({key, &run, begin, next});
    begin = next;
  }
}

}  // namespace

CellAccumulator::CellAccumulator(const VoxelFrame& frame,
                                 const Executor& executor,
                                 Scratch& scratch,
                                 std::size_t memory_bytes)
    : frame_(frame),
      executor_(executor),
      scratch_(scratch),
      memory_bytes_(memory_bytes),
      shards_(kShards, VoxelGrid(frame)) {}

void CellAccumulator::sort_points(std::span<const CloudPoint> points, Chunk& chunk) const {
  std::array<CellPoint, kChunkPoints> placed;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  std::array<std::uint8_t, kChunkPoints> shard{};
  std::array<std::size_t, kShards + 1> counts{};
  std::size_t n = 0;
  for (const CloudPoint& point : points) {
    const auto place = frame_.place_of(point.position);
    if (!place) continue;
    const Vector3f q = place->in_cell.cast<float>();
    placed[n] = {place->voxel, {q.x(), q.y(), q.z()}, point.intensity};
    shard[n] = static_cast<std::uint8_t>(shard_of(place->voxel, kShards));
    ++counts[shard[n] + std::size_t{1}];
    ++n;
  }
  chunk.out_of_reach = points.size() - n;
  std::partial_sum(counts.begin(), counts.end(), chunk.first.begin());
  chunk.points.resize(n);
  auto next = chunk.first;
  for (std::size_t i = 0; i < n; ++i) chunk.points[next[shard[i]]++] = placed[i];
}

std::size_t CellAccumulator::add(std::span<const CloudPoint> points_world) {
  const std::size_t chunks = (points_world.size() + kChunkPoints - 1) / kChunkPoints;
  chunks_.resize(std::max(chunks_.size(), chunks));
  executor_.parallel_for(
      points_world.size(), kChunkPoints, [&](std::size_t begin, std::size_t end) {
        sort_points(points_world.subspan(begin, end - begin), chunks_[begin / kChunkPoints]);
      });
  executor_.parallel_for(kShards, 1, [&](std::size_t shard, std::size_t) {
    for (std::size_t i = 0; i < chunks; ++i) {
      const Chunk& chunk = chunks_[i];
      shards_[shard].add(
          std::span(chunk.points)
              .subspan(chunk.first[shard], chunk.first[shard + 1] - chunk.first[shard]));
    }
  });
  std::size_t memory = 0;
  for (const VoxelGrid& shard : shards_) memory += shard.memory();
  if (memory > memory_bytes_) end_run();
  std::size_t out_of_reach = 0;
  for (std::size_t i = 0; i < chunks; ++i) out_of_reach += chunks_[i].out_of_reach;
  return out_of_reach;
}

void CellAccumulator::end_run() {
  Run run;
  for (std::size_t i = 0; i < kShards; ++i) {
    run.first[i + 1] = run.first[i] + shards_[i].cells().size();
  }
  if (run.first[kShards] == 0) return;
  run.cells = ScratchArray<VoxelCell>(scratch_, run.first[kShards]);
  executor_.parallel_for(kShards, 1, [&](std::size_t shard, std::size_t) {
    std::size_t at = run.first[shard];
    for (const std::uint32_t cell : shards_[shard].morton_order()) {
      run.cells[at++] = shards_[shard].cells()[cell];
    }
    run.cells.release(run.first[shard], at);
    shards_[shard] = VoxelGrid(frame_);
  });
  runs_.push_back(std::move(run));
}

CellTiles CellAccumulator::finish() {
  end_run();
  std::vector<Segment> segments;
  for (const Run& run : runs_) {
    for (std::size_t shard = 0; shard < kShards; ++shard) {
      append_segments(run.cells, run.first[shard], run.first[shard + 1], segments);
    }
    run.cells.release(0, run.cells.size());
  }
  // stable: a tile's runs stay in the order in which they were made
  std::stable_sort(segments.begin(), segments.end(), [](const Segment& a, const Segment& b) {
    return a.key < b.key;
  });
  std::vector<CellTile> tiles;
  std::vector<std::size_t> first_segment;
  std::size_t room = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (tiles.empty() || tiles.back().key != segments[i].key) {
      tiles.push_back({segments[i].key, room, room});
      first_segment.push_back(i);
    }
    room += segments[i].cells().size();
  }
  first_segment.push_back(segments.size());
  ScratchArray<VoxelCell> cells(scratch_, room);
  executor_.parallel_for(tiles.size(), 1, [&](std::size_t i, std::size_t) {
    CellTile& tile = tiles[i];
    const auto of_tile =
        std::span(segments).subspan(first_segment[i], first_segment[i + 1] - first_segment[i]);
    tile.end = tile.begin;
    if (of_tile.size() == 1) {
      const auto only = of_tile[0].cells();
      std::copy(only.begin(), only.end(), cells.begin() + tile.begin);
      tile.end += only.size();
    } else {
      VoxelGrid merged(frame_);
      for (const Segment& segment : of_tile) {
        for (const VoxelCell& cell : segment.cells()) merged.add(cell);
      }
      for (const std::uint32_t cell : merged.morton_order()) {
        cells[tile.end++] = merged.cells()[cell];
      }
    }
    cells.release(tile.begin, tile.end);
    for (const Segment& segment : of_tile) segment.release();
  });
  runs_.clear();
  return {frame_, std::move(cells), std::move(tiles)};
}

}  // namespace pointflight
