#pragma once

#include <memory>
#include <string>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/progress.hpp"
#include "pointflight/io/cloud_reader.hpp"

/// @file
/// One function per format; each takes a mapped file and throws InputError if it is not valid.
namespace pointflight {

/// PCD 0.7: ascii, binary, binary_compressed; any order and type of fields that include x, y, z.
std::unique_ptr<CloudReader> open_pcd(MappedFile file);

/// PLY vertices: ascii, binary little and big endian; other elements are skipped.
std::unique_ptr<CloudReader> open_ply(MappedFile file);

/// True if the PLY header promises faces (or triangle strips): a mesh, not a cloud.
bool ply_has_faces(const MappedFile& file);

/// True if an OBJ has a face.
bool obj_has_faces(const MappedFile& file);

/// The vertices of an OBJ without faces, with their colours.
std::unique_ptr<CloudReader> open_obj_points(MappedFile file);

/// Text: x y z [intensity] a line; blanks, commas or semicolons between; an optional line of
/// names; # and // comments. Without names, columns 4 to 6 of six or seven may be colours.
std::unique_ptr<CloudReader> open_xyz(MappedFile file);

/// The same with a line that gives the number of points before each scan; without names x y z
/// intensity red green blue (Leica).
std::unique_ptr<CloudReader> open_pts(MappedFile file);

/// Leica's PTX: scans in their scanners' frames, each with its pose; beams without a return go.
std::unique_ptr<CloudReader> open_ptx(MappedFile file);

/// Float32 x y z intensity without a header, as KITTI has them; with a fifth number, the ring, as
/// nuScenes has them. What it is is guessed by what the numbers say.
std::unique_ptr<CloudReader> open_kitti_bin(MappedFile file);

/// NumPy's .npy: rows x y z [intensity] of floats or whole numbers, organised clouds (height,
/// width, numbers), structured arrays with fields x, y, z.
std::unique_ptr<CloudReader> open_npy(MappedFile file);

/// NumPy's .npz: the first of its arrays that `open_npy` takes, those called points or alike before
/// others.
std::unique_ptr<CloudReader> open_npz(MappedFile file);

/// ASPRS LAS 1.0 to 1.4, uncompressed, point formats 0 to 10.
std::unique_ptr<CloudReader> open_las(MappedFile file);

/// ASTM E57 1.0: the points of all its scans, Cartesian or spherical, each in its scan's pose;
/// pictures are left out.
std::unique_ptr<CloudReader> open_e57(MappedFile file);

/// Resource limits for the import of a mesh: a damaged file can demand unbounded memory or time.
struct MeshLimits {
  double cpu_seconds;        ///< Of the process that reads it.
  std::size_t memory_bytes;  ///< Of its address space, beside what it shares.
};
/// More than any sound mesh of that size takes.
MeshLimits mesh_limits(std::size_t file_bytes);

/// Triangles of a PLY, an OBJ or any format that assimp reads, sampled evenly by area. What assimp
/// reads it reads in a child process: if it crashes there, that is an InputError here. Throws
/// InputError, for these formats also if the program was built without assimp. `format` is an
/// extension in lower case: ".ply".
std::unique_ptr<CloudReader> open_mesh(const std::string& path,
                                       const std::string& format,
                                       const MeshSampling& sampling,
                                       const MeshLimits& limits,
                                       const Progress& progress = {});

}  // namespace pointflight
