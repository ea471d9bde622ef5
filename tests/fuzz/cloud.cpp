// Clouds of any bytes: points or an InputError, and what was read can be imported.
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/internal/e57_pages.hpp"
#include "pointflight/map/import/map_builder.hpp"

namespace {

constexpr std::size_t kPointsToImport = 20000;

/// No fuzzer guesses the checksums that end an E57 file's pages of 1,024 bytes: they are put right.
std::vector<std::uint8_t> with_checksums(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> bytes(data, data + size);
  if (std::string_view(POINTFLIGHT_FUZZ_EXTENSION) != ".e57") return bytes;
  constexpr std::size_t kPayload = 1020;
  for (std::size_t page = 0; page + kPayload + 4 <= size; page += kPayload + 4) {
    const auto payload = std::as_bytes(std::span(bytes).subspan(page, kPayload));
    const std::uint32_t checksum = pointflight::crc32c(payload);
    for (std::size_t i = 0; i < 4; ++i) {
      bytes[page + kPayload + i] = static_cast<std::uint8_t>(checksum >> (24 - 8 * i));
    }
  }
  return bytes;
}

/// The readers map files, so the input has to be one; kept in memory.
std::string write_input(const std::vector<std::uint8_t>& bytes) {
  static const std::string path =
      "/dev/shm/pointflight_fuzz_" + std::to_string(::getpid()) + POINTFLIGHT_FUZZ_EXTENSION;
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr || std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size())
    __builtin_trap();
  std::fclose(file);
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = write_input(with_checksums(data, size));
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
