// What the files of a command line are, and what to do with those that a command does not read.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace pointflight::apps {

/// What a path is, by its first bytes where these tell, else by its name.
enum class InputKind {
  kMap,              ///< .pfmap
  kCloud,            ///< Points.
  kMesh,             ///< Faces.
  kRecording,        ///< .mcap, .bag
  kSqlite,           ///< .db3
  kRecordingFolder,  ///< Of `ros2 bag record`, or with .mcap files.
  kRun,              ///< The folder of a run.
  kYaml,             ///< A scenario, a study, a sensor, ...
  kOther,            ///< Or nothing at all: whoever reads it says so.
};

/// Never throws; what cannot be opened is `kOther`.
InputKind kind_of_input(const std::string& path);

/// Throws InputError if a path is one of the other kinds but `kOther`: what it is, what is wanted
/// instead ("a map (.pfmap)"), and what to do with it.
void require_kind(const std::string& path,
                  std::initializer_list<InputKind> kinds,
                  std::string_view wanted);

/// Throws InputError if a map would get the name of something else: `out.pcd`.
void check_map_name(const std::string& path);

}  // namespace pointflight::apps
