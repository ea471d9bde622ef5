// Preloaded into the program: its malloc has no memory every now and then. SCARCE_FROM: so many
// calls succeed first; SCARCE_RATE: one of so many fails after that; SCARCE_SEED: which ones.
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

extern "C" void* __libc_malloc(std::size_t size);  // NOLINT: glibc's name for its own

namespace {

std::atomic<std::uint64_t> calls = 0;
std::uint64_t first = 0;
std::uint64_t rate = 0;  // 0: until the constructor has run
std::uint64_t seed = 0;

std::uint64_t number_of(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? 0 : std::strtoull(text, nullptr, 10);
}

/// SplitMix64 (Steele, Lea, Flood 2014).
std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30u)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27u)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31u);
}

struct Settings {
  Settings() {
    first = number_of("SCARCE_FROM");
    seed = number_of("SCARCE_SEED");
    rate = number_of("SCARCE_RATE");
    ::unsetenv("LD_PRELOAD");  // the programs that it starts have memory
  }
} const settings;

}  // namespace

extern "C" void* malloc(std::size_t size) {
  if (rate != 0) {
    const std::uint64_t call = calls++;
    if (call >= first && mixed(call + seed * 0x9E3779B97F4A7C15u) % rate == 0) {
      errno = ENOMEM;
      return nullptr;
    }
  }
  return __libc_malloc(size);
}
