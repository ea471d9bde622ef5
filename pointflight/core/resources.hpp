#pragma once

#include <string>
#include <vector>

namespace pointflight {

/// The folder with the shipped `lidars/`, `vehicles/` and `ros_profiles/`: `$POINTFLIGHT_DATA` if
/// set, else the first that is there of `../share/pointflight` beside the program, what
/// `add_data_folder` named, if the package was to be installed, and the source tree that it was
/// built from.
std::string data_folder();

/// One more folder for `data_folder` to look in. The CMake package calls this in programs that link
/// it, so that they find the data of whatever prefix it lies in. Returns true.
bool add_data_folder(const std::string& folder);

/// True for what `find_model` takes as a path: it contains '/' or ends in ".yaml", or in ".json" or
/// ".csv" as vendors' files of sensors do.
bool is_model_path(const std::string& name_or_path);

/// The path of a model given by its name ("mid360" -> "<data>/lidars/mid360.yaml") or by a path
/// (`is_model_path`); a relative path is taken from `base` (a folder; empty =
/// the working directory). Throws InputError that lists the known names.
std::string find_model(const std::string& kind,
                       const std::string& name_or_path,
                       const std::string& base = {});

/// The path of a table that a model's file names: a path from the file's folder `base`, or one of
/// the tables shipped with a kind ("velodyne_vlp32c" or "tables/velodyne_vlp32c.csv" ->
/// "<data>/lidars/tables/velodyne_vlp32c.csv"). Throws InputError that says where it looked.
std::string find_table(const std::string& kind,
                       const std::string& name_or_path,
                       const std::string& base);

/// Names of the shipped models of a kind ("lidars", "vehicles"), sorted. Throws InputError if
/// there are none: it says where it looked and what to do.
std::vector<std::string> model_names(const std::string& kind);

/// `path` as it is if absolute, else below `base` (a folder; empty = the working directory).
std::string resolve_path(const std::string& path, const std::string& base);

}  // namespace pointflight
