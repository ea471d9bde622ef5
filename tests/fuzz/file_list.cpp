// Lists of a folder's files: whatever they say, what is read of them is written and read again as
// the same.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "pointflight/core/owned_files.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pointflight;  // NOLINT(google-build-using-namespace)
  const auto files = parse_file_list({reinterpret_cast<const char*>(data), size});
  if (files && parse_file_list(file_list_text(*files)) != files) std::abort();
  return 0;
}
