#include "pointflight/map/import/internal/cell_accumulator.hpp"

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
  std::size_t shard;
  std::span<const VoxelCell> cells;
};

/// The tiles of a shard's sorted cells in a run.
void append_segments(std::span<const VoxelCell> cells,
                     std::size_t shard,
                     std::vector<Segment>& segments) {
  while (!cells.empty()) {
    const std::uint64_t key = tile_key(cells.front().voxel);
    const auto behind = std::partition_point(cells.begin(), cells.end(), [key](const auto& cell) {
      return tile_key(cell.voxel) == key;
    });
    const auto count = static_cast<std::size_t>(behind - cells.begin());
    segments.push_back({key, shard, cells.first(count)});
    cells = cells.subspan(count);
  }
}

/// Writes the cells of a tile, in Morton order, from its begin on, and sets its end.
void merge(const VoxelFrame& frame,
           std::span<const Segment> segments,
           CellTile& tile,
           const ScratchArray<VoxelCell>& cells) {
  tile.end = tile.begin;
  if (segments.size() == 1) {
    const auto only = segments[0].cells;
    std::copy(only.begin(), only.end(), cells.begin() + tile.begin);
    tile.end += only.size();
  } else {
    VoxelGrid merged(frame);
    for (const Segment& segment : segments) {
      for (const VoxelCell& cell : segment.cells) merged.add(cell);
    }
    for (const std::uint32_t cell : merged.morton_order()) {
      cells[tile.end++] = merged.cells()[cell];
    }
  }
  cells.release(tile.begin, tile.end);
}

/// A tile and its part in every run.
struct TileOfRuns {
  std::span<const Segment> segments;
  CellTile* tile;
};

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
      append_segments(run.of_shard(shard), shard, segments);
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
    room += segments[i].cells.size();
  }
  first_segment.push_back(segments.size());
  std::array<std::vector<TileOfRuns>, kShards> of_shard;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const auto of_tile =
        std::span(segments).subspan(first_segment[i], first_segment[i + 1] - first_segment[i]);
    of_shard[of_tile.front().shard].push_back({of_tile, &tiles[i]});
  }
  ScratchArray<VoxelCell> cells(scratch_, room);
  // shard by shard: its cells lie together in every run, and leave memory together
  for (std::size_t shard = 0; shard < kShards; ++shard) {
    const auto& todo = of_shard[shard];
    executor_.parallel_for(todo.size(), 1, [&](std::size_t i, std::size_t) {
      merge(frame_, todo[i].segments, *todo[i].tile, cells);
    });
    for (const Run& run : runs_) run.cells.release(run.first[shard], run.first[shard + 1]);
  }
  runs_.clear();
  return {frame_, std::move(cells), std::move(tiles)};
}

}  // namespace pointflight
