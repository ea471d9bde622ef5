// Frames that a stranger sends to the port of `--view`: a request, or an InputError of one line.
// The first byte says whether it is text, binary, an order of the page, or a path.
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/view/foxglove.hpp"
#include "pointflight/view/page_content.hpp"
#include "pointflight/view/page_orders.hpp"
#include "pointflight/view/web_rules.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pointflight;
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data + 1), size - 1);
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  static const std::vector<MotionLimits> motions(2);
  static const auto content = page_content("", nullptr);
  try {
    switch (data[0] % 5) {
      case 0:
        static_cast<void>(foxglove::parse_text(text));
        break;
      case 1:
        static_cast<void>(foxglove::parse_binary(bytes));
        break;
      case 2:
        static_cast<void>(page_order(text, motions));
        break;
      case 3: {
        const auto range = range_of(text, 1000);
        if (range && (range->from > range->to || range->to >= 1000)) __builtin_trap();
        const std::size_t half = text.size() / 2;
        const Asker asker{text.substr(0, half), text.substr(half), text};
        if (permission_of(asker, "0123456789abcdef0123456789abcdef", true).command)
          __builtin_trap();
        static_cast<void>(chosen_subprotocol(text));
        break;
      }
      default: {
        const auto found = content(std::string(text));  // without a page and a map nothing is there
        if (found && !found->bytes->empty()) __builtin_trap();
      }
    }
  } catch (const InputError& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) __builtin_trap();
  }
  return 0;
}
