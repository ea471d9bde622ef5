// Clouds of any bytes: points or an InputError, and what was read can be imported.
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <string>

#include "pointflight/core/input_error.hpp"
#include "pointflight/map/import/map_builder.hpp"

namespace {

constexpr std::size_t kPointsToImport = 20000;

/// The readers map files, so the input has to be one; kept in memory.
std::string write_input(const std::uint8_t* data, std::size_t size) {
  static const std::string path =
      "/dev/shm/pointflight_fuzz_" + std::to_string(::getpid()) + POINTFLIGHT_FUZZ_EXTENSION;
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr || std::fwrite(data, 1, size, file) != size) __builtin_trap();
  std::fclose(file);
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = write_input(data, size);
  try {
    const bool is_mesh = pointflight::is_mesh(path);
    pointflight::MeshSampling sampling;
    sampling.points_per_square_metre = 1e-3;
    const auto reader = pointflight::open_cloud(path, sampling);
    std::vector<pointflight::CloudPoint> batch;
    std::size_t count = 0;
    // of a mesh any number may be wanted
    while ((!is_mesh || count < kPointsToImport) && reader->read(batch)) count += batch.size();
    if (!is_mesh && count <= kPointsToImport) {
      pointflight::import_clouds({path}, {}, pointflight::Executor(1));
    }
  } catch (const pointflight::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();  // one line
  }
  ::unlink(path.c_str());
  return 0;
}
