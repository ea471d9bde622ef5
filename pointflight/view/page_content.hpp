#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "pointflight/view/live_server.hpp"
#include "pointflight/view/map_blocks.hpp"

namespace pointflight {

/// What is under each path: `/` and the files of the page in `folder`, and of the map `/map/index`,
/// `/map/overview/MOST`, `/map/block/NUMBER/LEVEL` (`MapBlocks`), empty without a map. No path
/// leads out of these.
std::function<std::optional<WebContent>(const std::string& path)> page_content(
    const std::string& folder, std::shared_ptr<const MapBlocks> map);

/// Folder of the page as it was built or installed; empty if it was not built: that takes node
/// and npm.
std::string page_folder();

}  // namespace pointflight
