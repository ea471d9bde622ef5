#pragma once

#include <memory>
#include <string>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/io/cloud_reader.hpp"

/// One function per format; each takes a mapped file and throws InputError where it is not valid.
namespace pointflight {

/// PCD 0.7: ascii, binary, binary_compressed; any order and type of fields that include x, y, z.
std::unique_ptr<CloudReader> open_pcd(MappedFile file);

/// PLY vertices: ascii, binary little and big endian; other elements are skipped.
std::unique_ptr<CloudReader> open_ply(MappedFile file);

/// True if the PLY header promises faces (or triangle strips): a mesh, not a cloud.
bool ply_has_faces(const MappedFile& file);

/// Text: x y z [intensity ...] a line; blanks, commas or semicolons between; an optional line of
/// names; # and // comments; the count line of PTS.
std::unique_ptr<CloudReader> open_xyz(MappedFile file);

/// ASPRS LAS 1.0 to 1.4, uncompressed, point formats 0 to 10.
std::unique_ptr<CloudReader> open_las(MappedFile file);

/// Triangles of any format that assimp reads, sampled evenly by area. Throws InputError where the
/// program was built without assimp.
std::unique_ptr<CloudReader> open_mesh(const std::string& path, const MeshSampling& sampling);

}  // namespace pointflight
