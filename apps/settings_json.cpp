#include "apps/settings_json.hpp"

#include <fmt/format.h>

namespace pointflight::apps {

void print_json(const nlohmann::ordered_json& json) {
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

void print_reference(const std::string& rows) {
  fmt::print("| key | unit | default | range | meaning |\n| --- | --- | --- | --- | --- |\n{}",
             rows);
}

}  // namespace pointflight::apps
