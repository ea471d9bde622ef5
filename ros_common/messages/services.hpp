// Services of std_srvs: what is asked and what is answered.
#pragma once

#include "ros_common/messages/standard.hpp"

namespace pointflight::msg {

/// Asks for something without saying more.
struct TriggerRequest {
  static constexpr TypeName kType{"std_srvs", "Trigger_Request"};
  std::uint8_t none = 0;  ///< Of no meaning: see kNoField.
  template <class M, class V>
  static void fields(M& m, V& v) {
    if constexpr (V::kRos == 2) v(kNoField, m.none);
  }
};

/// Turns something on or off.
struct SetBoolRequest {
  static constexpr TypeName kType{"std_srvs", "SetBool_Request"};
  bool data = false;  ///< True: on.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("data", m.data);
  }
};

/// Of Trigger and of SetBool.
struct DoneResponse {
  static constexpr TypeName kType{"std_srvs", "Trigger_Response"};
  bool success = false;  ///< False: it was not taken.
  std::string message;   ///< Why not, in words, or empty.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("success", m.success);
    v("message", m.message);
  }
};

}  // namespace pointflight::msg
