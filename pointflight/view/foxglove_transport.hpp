#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/view/live_server.hpp"

namespace pointflight {

/// A run's messages for whoever looks: to a `RosLink` a ROS like others, in the CDR of ROS 2.
/// Topics become channels, what profiles read becomes what clients may publish, services are
/// services.
class FoxgloveTransport : public Transport {
 public:
  /// The server is shared with what else speaks to its clients; `close` leaves it open.
  explicit FoxgloveTransport(std::shared_ptr<LiveServer> server) : server_(std::move(server)) {}

  [[nodiscard]] Wire wire() const override { return Wire::kCdr; }
  int advertise(const Topic& topic) override;
  [[nodiscard]] bool has_readers(int topic) const override;
  [[nodiscard]] int reader_count(int topic) const override;
  void send(int topic, const Bytes& bytes, std::int64_t time) override;
  void subscribe(const Topic& topic, std::function<void(const Received&)> on_message) override;
  [[nodiscard]] bool is_connected() const override { return true; }
  void serve(const Service& service, Answer answer) override;
  void close() override { server_->refuse_input(); }
  [[nodiscard]] bool has_senders() const override { return server_->has_senders(); }
  [[nodiscard]] std::uint64_t dropped() const override { return server_->dropped(); }

 private:
  std::shared_ptr<LiveServer> server_;
  std::vector<std::uint32_t> channels_;  ///< By topic.
};

}  // namespace pointflight
