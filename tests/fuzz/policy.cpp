// Any bytes as a policy: one that acts, or an InputError of one line.
#include "pointflight/learn/policy.hpp"

#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>

#include "pointflight/core/input_error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string path =
      "/dev/shm/pointflight_fuzz_" + std::to_string(::getpid()) + ".npz";
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr || std::fwrite(data, 1, size, file) != size) __builtin_trap();
  std::fclose(file);
  try {
    const auto policy = pointflight::Policy::load(path);
    const auto image = policy.image_of(std::vector{pointflight::Vector3d(1, 0.5, 0.1)});
    for (const float action : policy.act(image, {}, {})) {
      if (!(std::abs(action) <= 1.0f)) __builtin_trap();
    }
  } catch (const pointflight::InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
  std::remove(path.c_str());
  return 0;
}
