// Any bytes as a recording in SQLite: its messages, or an InputError of one line.
#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <string>

#include "pointflight/recording/sqlite_reader.hpp"
#include "tests/fuzz/one_line.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string path =
      "/dev/shm/pointflight_fuzz_" + std::to_string(::getpid()) + ".db3";
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  pointflight::expect_one_line([&] { pointflight::read_sqlite(path); });
  pointflight::expect_one_line([&] {
    const auto reader = pointflight::open_sqlite({path}, {});
    pointflight::Recorded message;
    while (reader->next(message)) {
      if (message.size > 0 && message.data == nullptr) __builtin_trap();
    }
  });
  ::unlink(path.c_str());
  return 0;
}
