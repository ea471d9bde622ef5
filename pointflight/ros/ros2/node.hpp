#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/ros/ros2/discovery.hpp"
#include "pointflight/ros/ros2/graph_message.hpp"
#include "pointflight/ros/ros2/raw_type.hpp"

namespace pointflight {

struct ListenerDeleter {
  void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
};
using Listener = std::unique_ptr<dds_listener_t, ListenerDeleter>;

/// An endpoint's topic and quality of service, in ROS' words.
struct EndpointSettings {
  std::string name;  ///< DDS' ("rt/clock").
  std::string type;  ///< DDS' ("rosgraph_msgs::msg::dds_::Clock_").
  std::string hash;  ///< "RIHS01_...", or nothing.
  std::size_t depth = 1;
  bool reliable = true;
  bool latched = false;
  bool in_graph = true;  ///< The node's own: listed by `ros2 node info`.
};

/// A writer and what it needs to write.
struct RawWriter {
  dds_entity_t entity = 0;
  const ddsi_sertype* type = nullptr;
};

/// A participant of DDS that other ROS 2 nodes see as a node of its name. Errors are
/// std::runtime_error with words for the user.
class Node {
 public:
  Node(std::string name, const DiscoverySettings& discovery);
  /// Ends all endpoints; when it returns no listener is called any more.
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  RawWriter make_writer(const EndpointSettings& settings, const dds_listener_t* listener);
  /// Messages of this node itself are not read.
  dds_entity_t make_reader(const EndpointSettings& settings, const dds_listener_t* listener);

  /// Says which endpoints belong to the node.
  void send_graph();

 private:
  RawTopic topic_for(const EndpointSettings& settings) const;

  std::string name_;
  bool old_gids_;
  dds_entity_t domain_ = 0;
  dds_entity_t participant_ = 0;
  RawWriter graph_;
  std::vector<RawGid> readers_, writers_;
};

}  // namespace pointflight
