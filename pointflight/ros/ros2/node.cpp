#include "pointflight/ros/ros2/node.hpp"

#include <cstdlib>
#include <stdexcept>

namespace pointflight {
namespace {

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, QosDeleter>;

RawGid gid_of(dds_entity_t entity) {
  dds_guid_t guid;
  dds_get_guid(entity, &guid);
  RawGid raw;
  std::copy(std::begin(guid.v), std::end(guid.v), raw.begin());
  return raw;
}

Qos qos_of(const EndpointSettings& settings) {
  // how long a writer may wait for room; histories that keep the last never do
  constexpr dds_duration_t kBlockingMax = DDS_MSECS(100);
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(),
                       settings.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       kBlockingMax);
  dds_qset_durability(qos.get(),
                      settings.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  const auto depth = static_cast<std::int32_t>(settings.depth);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  if (settings.latched) {
    dds_qset_durability_service(qos.get(),
                                0,
                                DDS_HISTORY_KEEP_LAST,
                                depth,
                                DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED);
  }
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  if (!settings.hash.empty()) {
    const std::string text = "typehash=" + settings.hash + ";";
    dds_qset_userdata(qos.get(), text.data(), text.size());
  }
  return qos;
}

}  // namespace

Node::Node(std::string name, const DiscoverySettings& discovery)
    : name_(std::move(name)), old_gids_(discovery.old_gids) {
  const char* user = std::getenv("CYCLONEDDS_URI");  // NOLINT(concurrency-mt-unsafe)
  const std::string configuration = cyclone_configuration(discovery, user == nullptr ? "" : user);
  const auto refuse = [&](dds_return_t code) {
    if (domain_ > 0) dds_delete(domain_);
    if (code == DDS_RETCODE_PRECONDITION_NOT_MET) {  // this process has one there already
      throw std::runtime_error("ROS 2: domain " + std::to_string(discovery.domain) +
                               " is that of --share; set POINTFLIGHT_DOMAIN_ID to another");
    }
    throw std::runtime_error(
        "ROS 2: no DDS participant could be made in domain " + std::to_string(discovery.domain) +
        " (" + dds_strretcode(-code) + "); is CYCLONEDDS_URI right, are there network interfaces," +
        " and free ports from " + std::to_string(7400 + 250 * discovery.domain) + " on?");
  };
  domain_ = dds_create_domain(discovery.domain, configuration.c_str());
  if (domain_ < 0) refuse(domain_);
  const Qos qos(dds_create_qos());
  const std::string enclave = "enclave=/;";
  dds_qset_userdata(qos.get(), enclave.data(), enclave.size());
  participant_ = dds_create_participant(discovery.domain, qos.get(), nullptr);
  if (participant_ < 0) refuse(participant_);
  EndpointSettings graph;
  graph.name = "ros_discovery_info";
  graph.type = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
  graph.hash = kGraphTypeHash;
  graph.latched = true;
  graph.in_graph = false;
  graph_ = make_writer(graph, nullptr);
}

Node::~Node() {
  dds_delete(domain_);
}

RawTopic Node::topic_for(const EndpointSettings& settings) const {
  return make_raw_topic(participant_, settings.name, settings.type);
}

RawWriter Node::make_writer(const EndpointSettings& settings, const dds_listener_t* listener) {
  const RawTopic topic = topic_for(settings);
  const Qos qos = qos_of(settings);
  const dds_entity_t writer = dds_create_writer(participant_, topic.topic, qos.get(), listener);
  if (writer < 0) {
    throw std::runtime_error("ROS 2: cannot write " + settings.name + ": " +
                             dds_strretcode(-writer));
  }
  if (settings.in_graph) writers_.push_back(gid_of(writer));
  return {writer, topic.type};
}

dds_entity_t Node::make_reader(const EndpointSettings& settings, const dds_listener_t* listener) {
  const RawTopic topic = topic_for(settings);
  const Qos qos = qos_of(settings);
  const dds_entity_t reader = dds_create_reader(participant_, topic.topic, qos.get(), listener);
  if (reader < 0) {
    throw std::runtime_error("ROS 2: cannot read " + settings.name + ": " +
                             dds_strretcode(-reader));
  }
  if (settings.in_graph) readers_.push_back(gid_of(reader));
  return reader;
}

void Node::send_graph() {
  const RawGid own = gid_of(participant_);
  write_raw(graph_.entity,
            graph_.type,
            std::make_shared<const std::vector<std::byte>>(
                old_gids_ ? graph_message<24>(own, name_, readers_, writers_)
                          : graph_message<16>(own, name_, readers_, writers_)));
}

}  // namespace pointflight
