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

/// Walks over all rows of a PLY. Throws InputError if the file ends before them.
void check_ply_rows(MappedFile file);

/// Text: x y z [intensity ...] a line; blanks, commas or semicolons between; an optional line of
/// names; # and // comments; the count line of PTS.
std::unique_ptr<CloudReader> open_xyz(MappedFile file);

/// ASPRS LAS 1.0 to 1.4, uncompressed, point formats 0 to 10.
std::unique_ptr<CloudReader> open_las(MappedFile file);

/// Resource limits for the import of a mesh: a damaged file can demand unbounded memory or time.
struct MeshLimits {
  double cpu_seconds;        ///< Of the process that reads it.
  std::size_t memory_bytes;  ///< Of its address space, beside what it shares.
};
/// More than any sound mesh of that size takes.
MeshLimits mesh_limits(std::size_t file_bytes);

/// Triangles of any format that assimp reads, sampled evenly by area. The file is read in a child
/// process: if assimp crashes there, that is an InputError here. Throws InputError if the
/// program was built without assimp.
std::unique_ptr<CloudReader> open_mesh(const std::string& path,
                                       const MeshSampling& sampling,
                                       const MeshLimits& limits,
                                       const Progress& progress = {});

}  // namespace pointflight
