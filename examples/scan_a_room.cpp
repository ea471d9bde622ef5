// Makes a map of a room from points, and takes a scan in it with a Mid-360.
#include <cstdio>
#include <exception>

#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/import/map_builder.hpp"

using namespace pointflight;

int main() try {
  ShapeScene room;
  room.add_box({0, 0, 0}, {8, 6, 3});
  room.shapes.emplace_back(SceneSphere{{5, 3, 1}, 0.5});
  std::vector<CloudPoint> points;
  room.sample(2000.0, 0.003, 1, [&](const Vector3d& p) { points.push_back({p, 0.0f}); });
  write_cloud_pcd(OutputFile("room.pcd"), points, false);

  const Executor executor;
  ImportOptions options;
  options.resolution = 0.05;
  const ImportedMap imported = import_clouds({"room.pcd"}, options, executor);
  write_map(OutputFile("room.pfmap"), imported.tree, imported.description);

  const auto map = SurfelMap::open("room.pfmap");
  const auto renderer = make_renderer("beam", Scene{map});
  const Lidar lidar(load_lidar("mid360"), 0);
  const Pose pose{Quaterniond::Identity(), {2, 3, 1.5}};
  const Scan scan = lidar.take(ScanRequest{}, PoseTrack(pose), *renderer, executor);
  std::printf("%zu of %zu beams returned\n", scan.points.size(), scan.beams);
  return scan.points.size() > scan.beams * 9 / 10 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
