// Files of poses: TUM's and KITTI's.
#pragma once

#include <string>
#include <vector>

#include "pointflight/core/output_file.hpp"
#include "pointflight/geometry/types.hpp"

namespace pointflight {

/// One line of a TUM trajectory: `time tx ty tz qx qy qz qw [file]`.
struct TumPose {
  double time = 0.0;    ///< The file's own number: a time, or an index.
  Pose T_world_sensor;  ///< In the world that the file's map has.
  std::string file;     ///< Ninth column; empty if there is none.
};

/// Reads a TUM trajectory; lines that start with # are comments. Quaternions are normalised. Throws
/// InputError with file and line.
std::vector<TumPose> read_tum(const std::string& path);

/// Reads KITTI's poses, rows of the twelve numbers of R | t, which have no times. Lines that start
/// with # are comments. Throws InputError with file and line.
std::vector<Pose> read_kitti(const std::string& path);

/// True if the file's first row has twelve words: KITTI's.
bool is_kitti(const std::string& path);

/// Writes a TUM trajectory, with a head line.
void write_tum(OutputFile file, const std::vector<TumPose>& poses);

}  // namespace pointflight
