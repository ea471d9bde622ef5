#pragma once

#include <string>

#include "pointflight/picture/run_picture.hpp"

namespace pointflight::picture {

/// What a picture of a finished run shows, from the run's folder: trajectories, scans, obstacles,
/// collisions, the figures of its summary. Throws InputError, with file and line, if something is
/// missing or not what runs write.
RunPicture read_run_picture(const std::string& folder);

}  // namespace pointflight::picture
