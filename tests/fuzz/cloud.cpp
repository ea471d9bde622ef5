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
    if (pointflight::is_mesh(path)) return 0;  // assimp's to read
    const auto reader = pointflight::open_cloud(path);
    std::vector<pointflight::CloudPoint> batch;
    std::size_t count = 0;
    while (reader->read(batch)) count += batch.size();
    if (count <= kPointsToImport) {
      pointflight::import_clouds({path}, {}, pointflight::Executor(1));
    }
  } catch (const pointflight::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();  // one line
  }
  ::unlink(path.c_str());
  return 0;
}
