// Messages of any type as Fast DDS takes them: bytes.
#pragma once

#include <cstring>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <string>
#include <vector>

namespace pointflight::testing {

/// A sample of any type: CDR with its header of four bytes.
struct FastSample {
  const std::vector<std::byte>* out = nullptr;  ///< To be written.
  std::vector<std::byte> in;                    ///< That was read.
};

/// A type by its DDS name; bytes go through as they are.
class FastType : public eprosima::fastdds::dds::TopicDataType {
 public:
  using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;

  explicit FastType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 1024;  // grows with what is written
    m_isGetKeyDefined = false;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }

  bool serialize(void* data, Payload* payload) override {
    const auto& bytes = *static_cast<FastSample*>(data)->out;
    if (bytes.size() > payload->max_size) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(Payload* payload, void* data) override {
    const auto* first = reinterpret_cast<const std::byte*>(payload->data);
    static_cast<FastSample*>(data)->in.assign(first, first + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return
        [data] { return static_cast<std::uint32_t>(static_cast<FastSample*>(data)->out->size()); };
  }
  void* createData() override { return new FastSample; }
  void deleteData(void* data) override { delete static_cast<FastSample*>(data); }
  bool getKey(void* /*data*/,
              eprosima::fastrtps::rtps::InstanceHandle_t* /*handle*/,
              bool /*force_md5*/) override {
    return false;
  }
  [[nodiscard]] bool is_bounded() const override { return false; }
};

}  // namespace pointflight::testing
