#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "pointflight/geometry/types.hpp"

/// The inner loops of the `paper` renderer, eight lanes at a time, for each instruction set. All in
/// float: a pixel is 10^4 times wider than its rounding.
namespace pointflight {

/// Azimuth and elevation of directions, rad.
struct PaperAngles {
  std::vector<float> azimuth, elevation;  ///< Room for whole groups of eight.

  explicit PaperAngles(std::size_t count)
      : azimuth((count + 7) / 8 * 8), elevation((count + 7) / 8 * 8) {}
};

/// The points of a voxel of the screening grid: arrays with room for whole groups of eight.
struct PaperPoints {
  std::size_t count = 0;
  std::vector<float> x, y, z;     ///< From the voxel's corner, m.
  std::vector<float> nx, ny, nz;  ///< Normals.
  std::vector<float> planar;      ///< 1 if gamma is below the threshold, else 0.
  std::vector<float> intensity;
  std::vector<float> radius;  ///< Of the point's cube, m.

  struct Point {
    Vector3f place, normal;
    bool is_planar;
    float intensity;
    float radius;
  };
  void add(const Point& point);
  /// Fills up the last group, once all points are there.
  void finish();
};

/// The depth image as planes of rows: depths (infinity if empty), cosines of incidence,
/// intensities. Rows are elevations, columns azimuths, in the sensor's frame.
struct PaperImage {
  int rows = 0;
  int columns = 0;
  std::size_t stride = 0;  ///< Of a row, with room for a group of eight behind its end.
  float step = 0.0f;       ///< Between rows, rad.
  float column_step = 0.0f;
  float azimuth_min = 0.0f;
  float elevation_min = 0.0f;
  bool full_turn = false;  ///< The last column lies beside the first.
  float range_max = 0.0f;
  // which directions fill any pixel, without trigonometry
  float sin_low = -1.0f, sin_high = 1.0f;
  bool narrow = false;     ///< The azimuths are a wedge of less than half a turn:
  float left[2] = {0, 0};  ///< Inward normals of its sides.
  float right[2] = {0, 0};
  std::vector<float> row_cos, row_sin, column_cos, column_sin;
  std::vector<float> depth, cosine, intensity;
};

/// A point in the sensor's frame, on its way into the image.
struct PaperSplat {
  float p[3];  ///< m
  float n[3];
  float distance;
  float cos_max;  ///< Of theta_max, within which pixels are filled (the paper's eq. 1).
  float theta_max;
  float row_at, column_at;  ///< Where it projects to.
  float planar;
  float intensity;
  float reach_squared;  ///< The point's plane ends so far from it, m^2.
  int first_row, last_row;
};

/// Angles of `matrix d` for the rays' directions d; `begin` a multiple of eight.
void paper_angles(std::span<const Ray> rays,
                  const Matrix3f& matrix,
                  std::size_t begin,
                  std::size_t end,
                  PaperAngles& angles);

/// Appends those of a voxel's points that may fill pixels. `corner` is the voxel's in the sensor's
/// frame, `turn` the rotation into it.
void paper_project(const PaperImage& image,
                   const PaperPoints& points,
                   const Vector3f& corner,
                   const Matrix3f& turn,
                   std::vector<PaperSplat>& splats);

/// Fills the pixels of rows [row_begin, row_end).
void paper_fill(PaperImage& image, std::span<const PaperSplat> splats, int row_begin, int row_end);

}  // namespace pointflight
