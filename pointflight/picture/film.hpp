#pragma once

#include <optional>
#include <string>

#include "pointflight/core/progress.hpp"
#include "pointflight/run/playback.hpp"

namespace pointflight::picture {

/// How a run is filmed.
struct FilmOptions {
  std::string frames;  ///< Folder for its pictures, 000000.png on; it is there.
  /// Whom the camera follows; else the first that the folder has.
  std::optional<std::size_t> vehicle;
  double rate = 20.0;  ///< Pictures per second of the run.
  int width = 960;     ///< Pixels, even.
  int height = 540;    ///< Pixels, even.
};

/// Films a finished run: the map, vehicles with their arms and propellers, obstacles, the last scan
/// and the flown way, from behind and above a vehicle, rendered as scans are. Returns how many
/// pictures. Throws InputError, also if the folder has no such vehicle.
std::size_t film_run(RecordedRun& run, const FilmOptions& options, const Progress& progress);

/// Makes a video of such a folder's pictures by ffmpeg. Throws InputError, also if that is not
/// installed.
void make_video(const FilmOptions& options, const std::string& path);

}  // namespace pointflight::picture
