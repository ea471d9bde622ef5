#include "apps/memory_reserve.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>

#include "apps/commands.hpp"

namespace pointflight::apps {
namespace {

// small enough to lie in the heap: glibc gives larger blocks back to the system when they are freed
constexpr std::size_t kPiece = std::size_t{64} << 10u;  // bytes
constexpr std::size_t kPieces = 32;

std::array<std::atomic<void*>, kPieces>& reserve() {
  static std::array<std::atomic<void*>, kPieces> pieces{};
  return pieces;
}

std::string& last_line() {
  static std::string line;
  return line;
}

bool release_piece() {
  for (std::atomic<void*>& piece : reserve()) {
    if (void* const memory = piece.exchange(nullptr)) {
      std::free(memory);  // NOLINT(cppcoreguidelines-no-malloc): `new` would end up here again
      return true;
    }
  }
  return false;
}

/// Called by `operator new` when there is no memory; it tries again if this returns.
void find_memory() {
  if (std::uncaught_exceptions() > 0 && release_piece()) return;
  throw std::bad_alloc();
}

[[noreturn]] void end_without_memory() {
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    static_cast<void>(!::write(STDERR_FILENO, last_line().data(), last_line().size()));
    ::_exit(kWrongInput);
  } catch (...) {  // NOLINT(bugprone-empty-catch): no end of ours; what follows shows it
  }
  std::abort();
}

}  // namespace

void keep_memory_reserve(const std::string& line) {
  last_line() = line;
  for (std::atomic<void*>& piece : reserve()) {
    piece = std::malloc(kPiece);  // NOLINT(cppcoreguidelines-no-malloc): see release_piece
  }
  std::set_new_handler(find_memory);
  std::set_terminate(end_without_memory);
}

void release_memory_reserve() {
  while (release_piece()) {
  }
}

}  // namespace pointflight::apps
