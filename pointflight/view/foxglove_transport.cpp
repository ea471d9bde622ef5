#include "pointflight/view/foxglove_transport.hpp"

#include <utility>

namespace pointflight {
namespace {

/// The two halves of the services that runs have (std_srvs).
struct Halves {
  const char* request;
  const char* response;
};
Halves halves_of(const std::string& type) {
  constexpr const char* kResponse = "bool success\nstring message\n";
  return {type == "SetBool" ? "bool data\n" : "", kResponse};
}

}  // namespace

int FoxgloveTransport::advertise(const Topic& topic) {
  foxglove::Channel channel;
  channel.topic = topic.name;
  channel.encoding = "cdr";
  channel.schema_name = topic.type.ros2_name();
  channel.schema = topic.type.ros2_definition;
  channel.schema_encoding = "ros2msg";
  channels_.push_back(server_->add_channel(std::move(channel), topic.latched));
  return static_cast<int>(channels_.size()) - 1;
}

bool FoxgloveTransport::has_readers(int topic) const {
  return server_->has_subscribers(channels_[static_cast<std::size_t>(topic)]);
}

int FoxgloveTransport::reader_count(int topic) const {
  return server_->subscriber_count(channels_[static_cast<std::size_t>(topic)]);
}

void FoxgloveTransport::send(int topic, const Bytes& bytes, std::int64_t time) {
  server_->publish(channels_[static_cast<std::size_t>(topic)], bytes, time);
  server_->publish_time(time);
}

void FoxgloveTransport::subscribe(const Topic& topic,
                                  std::function<void(const Received&)> on_message) {
  server_->subscribe(topic, std::move(on_message));
}

void FoxgloveTransport::serve(const Service& service, Answer answer) {
  const Halves halves = halves_of(service.type);
  server_->serve(
      {0, service.name, service.package + "/srv/" + service.type, halves.request, halves.response},
      std::move(answer));
}

}  // namespace pointflight
