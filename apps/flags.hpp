#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/cli.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight::apps {

/// Check of a flag: a number within limits. (CLI::Range lets NaN pass.)
CLI::Validator within(double min, double max);

/// --start-in: a box in the world, m. `box_from` throws InputError if it is none.
void add_start_in_flag(CLI::App& app, std::vector<double>& numbers);
Aabb box_from(const std::vector<double>& numbers, const std::string& flag);

/// Numbers of a flag, commas or blanks between. Throws InputError if one is not finite.
std::vector<double> parse_numbers(const std::string& text, const std::string& flag);
/// The same of so many; another count is an error that shows `form`, "x,y,z in metres".
std::vector<double> parse_numbers(const std::string& text,
                                  std::size_t count,
                                  const std::string& flag,
                                  const std::string& form);

/// "x,y,z,roll,pitch,yaw" in metres and degrees; without angles they are zero.
Pose parse_pose(const std::string& text, const std::string& flag);

/// What --renderer may be.
std::vector<std::string> renderer_names();

/// --force: outputs may replace what is there.
void add_force_flag(CLI::App& app, bool& force);

/// True if both paths mean one file, whether it is there or not.
bool is_same_file(const std::string& a, const std::string& b);

/// How a file that is written names another one: by the way from its own folder.
std::string path_in_file(const std::string& file, const std::string& other);

/// Looks at all files of a command before it begins; empty names are none. Throws InputError
/// - if an output is there already and `force` is not given, or is a link, a folder or a device;
/// - if two outputs are one file;
/// - if an output would replace an input, or a file in a folder that is an input.
void check_outputs(const std::vector<std::string>& outputs,
                   const std::vector<std::string>& inputs,
                   bool force);

/// A folder that a command makes for its pictures. A command that fails before it has written
/// one leaves no folder that was not there.
class PictureFolder {
 public:
  /// An empty name is none. Throws InputError if the folder cannot be made, or if it holds
  /// anything and `force` is not given.
  PictureFolder(const std::string& folder, bool force);
  ~PictureFolder();
  PictureFolder(const PictureFolder&) = delete;
  PictureFolder& operator=(const PictureFolder&) = delete;

 private:
  std::vector<std::filesystem::path> made_;  ///< With those above it, from the lowest.
};

/// The clouds of a command line; "-" is standard input, kept in `scratch` if it has to be read
/// again. `format`: what all of them are, empty: by their names. Throws InputError.
std::vector<CloudSource> cloud_sources(const std::vector<std::string>& inputs,
                                       const std::string& format,
                                       const std::string& scratch,
                                       const Progress& progress);

}  // namespace pointflight::apps
