// A participant of DDS on the topics of a shared run that does not belong there.
//
// stranger DOMAIN NAME SECONDS SEED: random bytes, messages of another version, messages cut short,
// on all four topics, some hundred per second.
#include <dds/dds.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "pointflight/ros/ros2/raw_type.hpp"

namespace {

using pointflight::RawTopic;

dds_entity_t writer_on(dds_entity_t participant, const RawTopic& topic, bool reliable) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(
      qos, reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_MSECS(10));
  dds_qset_durability(qos, reliable ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  // as all others do: without it readers would not listen
  if (reliable) dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, DDS_MSECS(100));
  const dds_entity_t writer = dds_create_writer(participant, topic.topic, qos, nullptr);
  dds_delete_qos(qos);
  return writer;
}

}  // namespace

int main(int count, char** words) {
  if (count != 5) return 2;
  const auto domain = static_cast<std::uint32_t>(std::atoi(words[1]));
  const std::string name = words[2];
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(std::atoi(words[3]));
  std::mt19937 draws(static_cast<unsigned>(std::atoi(words[4])));
  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  if (participant < 0) return 1;
  struct Out {
    RawTopic topic;
    dds_entity_t writer;
  };
  std::vector<Out> outs;
  const char* types[][2] = {
      {"crew", "Introduction_"}, {"states", "States_"}, {"clock", "Clock_"}, {"past", "Past_"}};
  for (const auto& [topic, type] : types) {
    const RawTopic raw =
        pointflight::make_raw_topic(participant,
                                    "pointflight/" + name + "/" + topic,
                                    std::string("pointflight_share::msg::dds_::") + type);
    const bool reliable = std::string(topic) == "crew" || std::string(topic) == "past";
    outs.push_back({raw, writer_on(participant, raw, reliable)});
    if (outs.back().writer < 0) return 1;
  }
  while (std::chrono::steady_clock::now() < end) {
    for (const Out& out : outs) {
      auto bytes = std::make_shared<std::vector<std::byte>>(4 + draws() % 400);
      for (std::byte& byte : *bytes) byte = static_cast<std::byte>(draws());
      (*bytes)[0] = (*bytes)[2] = (*bytes)[3] = std::byte{0};
      (*bytes)[1] = std::byte{1};
      if (draws() % 2 == 0 && bytes->size() > 20) {
        // the right beginning; the version ours or another
        const unsigned char head[] = {'P',
                                      'F',
                                      'S',
                                      'W',
                                      static_cast<unsigned char>(1 + draws() % 2),
                                      0,
                                      static_cast<unsigned char>(1 + draws() % 5),
                                      0};
        for (std::size_t i = 0; i < sizeof head; ++i)
          (*bytes)[4 + i] = static_cast<std::byte>(head[i]);
      }
      pointflight::write_raw(out.writer, out.topic.type, bytes);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  dds_delete(participant);
  return 0;
}
