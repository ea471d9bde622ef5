#include "pointflight/view/page_content.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostOverview = 4'000'000;  // surfels

struct PageFile {
  const char* path;
  const char* name;
  const char* type;
};
constexpr std::array<PageFile, 3> kFiles = {
    {{"/", "index.html", "text/html; charset=utf-8"},
     {"/index.html", "index.html", "text/html; charset=utf-8"},
     {"/page.js", "page.js", "text/javascript; charset=utf-8"}}};

WebContent content_of(std::vector<std::byte> bytes, std::string type) {
  return {std::move(type), std::make_shared<const std::vector<std::byte>>(std::move(bytes)), false};
}

/// A whole number at the front of `text`, which it is taken from; nothing if there is none.
std::optional<std::size_t> take_number(std::string& text) {
  const std::size_t end = std::min(text.find('/'), text.size());
  double value = 0.0;
  if (!parse_number(text.substr(0, end), value) || !(value >= 0.0) || !(value < 1e9) ||
      value != static_cast<double>(static_cast<std::size_t>(value))) {
    return std::nullopt;
  }
  text.erase(0, std::min(end + 1, text.size()));
  return static_cast<std::size_t>(value);
}

std::optional<WebContent> map_content(const MapBlocks& map, std::string path) {
  constexpr const char* kBytes = "application/octet-stream";
  if (path == "index") return content_of(map.index(), kBytes);
  if (path.starts_with("overview/")) {
    path.erase(0, 9);
    const auto most = take_number(path);
    if (!most || !path.empty()) return std::nullopt;
    return content_of(map.overview(std::min(*most, kMostOverview)), kBytes);
  }
  if (path.starts_with("block/")) {
    path.erase(0, 6);
    const auto number = take_number(path);
    const auto level = number ? take_number(path) : std::nullopt;
    if (!level || !path.empty() || *level > 100) return std::nullopt;
    std::vector<std::byte> block = map.block(*number, static_cast<int>(*level));
    if (block.empty()) return std::nullopt;
    return content_of(std::move(block), kBytes);
  }
  return std::nullopt;
}

}  // namespace

std::function<std::optional<WebContent>(const std::string& path)> page_content(
    const std::string& folder, std::shared_ptr<const MapBlocks> map) {
  return [folder, map = std::move(map)](const std::string& path) -> std::optional<WebContent> {
    constexpr const char* kMap = "/map/";
    if (map && path.starts_with(kMap)) return map_content(*map, path.substr(5));
    // there is none, which is no error: recordings may come without
    if (path.starts_with(kMap)) return content_of({}, "application/octet-stream");
    for (const PageFile& file : kFiles) {
      if (path != file.path || folder.empty()) continue;
      const MappedFile bytes((fs::path(folder) / file.name).string());
      return content_of({bytes.bytes().begin(), bytes.bytes().end()}, file.type);
    }
    return std::nullopt;
  };
}

std::string page_folder() {
  std::error_code ignored;
  for (const std::string& folder : {std::string(POINTFLIGHT_BUILT_PAGE), data_folder() + "/page"}) {
    if (fs::is_regular_file(fs::path(folder) / "page.js", ignored)) return folder;
  }
  return {};
}

}  // namespace pointflight
