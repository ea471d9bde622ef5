#include "pointflight/ros/ros1/transport.hpp"

#include <future>

#include "pointflight/ros/ros1/node.hpp"

namespace pointflight {
namespace {

/// roscpp has queues and threads of its own: a slow subscriber costs nobody but itself.
class Ros1Transport : public Transport {
 public:
  explicit Ros1Transport(const TransportOptions& options)
      : log_(options.log), node_(std::make_shared<Ros1Node>(options.node, options.log)) {}
  ~Ros1Transport() override { close(); }

  Wire wire() const override { return Wire::kRos1; }
  int advertise(const Topic& topic) override { return node_->advertise(topic); }
  void subscribe(const Topic& topic, std::function<void(const Received&)> on_message) override {
    node_->subscribe(topic, std::move(on_message));
  }
  void serve(const Service& service, Answer answer) override {
    node_->serve(service, std::move(answer));
  }
  void start() override { node_->start(); }
  bool is_connected() const override { return node_->is_connected(); }
  bool has_senders() const override { return node_->has_senders(); }
  bool has_readers(int topic) const override { return node_->reader_count(topic) > 0; }
  int reader_count(int topic) const override { return node_->reader_count(topic); }
  void send(int topic, const Bytes& bytes, std::int64_t /*time*/) override {
    node_->send(topic, bytes);
  }
  std::uint64_t dropped() const override { return node_->dropped(); }
  bool is_over() const override { return node_->is_over(); }
  std::string failure() const override { return node_->failure(); }
  bool has_ended() const override { return ended_; }

  /// A master that does not answer is waited for no longer than a second: the node then leaves
  /// without its goodbye, and threads of roscpp's stay behind.
  void close() override {
    if (closed_) return;
    closed_ = true;
    constexpr std::chrono::seconds kGoodbye(1);
    node_->stop();
    std::packaged_task<bool()> leave([node = node_] { return node->leave(); });
    auto left = leave.get_future();
    std::thread leaving(std::move(leave));
    const bool answered = left.wait_for(kGoodbye) == std::future_status::ready;
    if (answered) {
      leaving.join();
      ended_ = left.get();
    } else {
      leaving.detach();
      ended_ = false;
      if (log_) log_("ROS 1: the master does not answer; left without its goodbye");
    }
    // what roscpp's threads still use stays until the process ends
    if (!ended_) new std::shared_ptr<Ros1Node>(node_);  // NOLINT(bugprone-unused-raii)
  }

 private:
  std::function<void(const std::string&)> log_;
  std::shared_ptr<Ros1Node> node_;  ///< Shared with a thread that may have to stay behind.
  bool closed_ = false;
  bool ended_ = true;
};

}  // namespace

std::unique_ptr<Transport> make_ros1_transport(const TransportOptions& options) {
  return std::make_unique<Ros1Transport>(options);
}

}  // namespace pointflight
